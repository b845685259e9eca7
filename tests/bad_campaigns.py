"""Campaigns that must be refused, and what the message must say."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from campaigns import TOML, csv, decay

ROWS = csv().splitlines()


@dataclass(frozen=True)
class Bad:
    """A change to the good campaign of `campaigns.write`, and words that its refusal contains."""

    id: str
    words: tuple[str, ...]
    toml: str | bytes = TOML
    files: dict[str, str | bytes | None] = field(default_factory=dict)


def _toml(id: str, old: str, new: str, *words: str) -> Bad:
    assert old in TOML, old
    return Bad(id, ("campaign.toml", *words), TOML.replace(old, new, 1))


def _more(id: str, text: str, *words: str) -> Bad:
    return Bad(id, ("campaign.toml", *words), TOML + text)


def _file(id: str, content: str | bytes | None, *words: str, keys: str = "") -> Bad:
    """`b.csv` is at fault; `keys` are added to its [[recording]]."""
    return Bad(id, ("b.csv", *words), TOML + keys, {"b": content})


def _row(line: int, text: str) -> str:
    """The good file with another line (counted from 1)."""
    return "\n".join([*ROWS[: line - 1], text, *ROWS[line:]]) + "\n"


def _without(*lines: int) -> str:
    return "\n".join(row for i, row in enumerate(ROWS, 1) if i not in lines) + "\n"


BEAM = "length_mm = 110\nwidth_mm = 20\nthickness_mm = 5\n"

BAD_TOML = [
    _more("a corner of zero", "high_pass_hz = 0\n", "key high_pass_hz", "above 0"),
    _more("a corner below zero", "high_pass_hz = -0.5\n", "key high_pass_hz", "above 0"),
    _more("a corner in words", 'high_pass_hz = "AC"\n', "key high_pass_hz", "above 0"),
    _more("a corner beyond the band", "high_pass_hz = 250.0\n", "key high_pass_hz", "below half"),
    _toml("deep lists", "0.503", "[" * 9000 + "]" * 9000, "nested without end"),
    _toml("deep keys", "mass_kg", "a" + ".a" * 9000 + " = 1\nmass_kg", "unknown key"),
    _toml("a key without end", "mass_kg", "a" + ".a" * 60_000 + " = 1", "line 2", "in a line"),
    _toml("digits without end", "0.503", "9" * 5000, "a value that is none"),
    _toml("mass of a galaxy", "0.503", "1e200", "key mass_kg", "1e+200", "1e-15 to 1e+12"),
    _toml("mass of nothing", "0.503", "1e-300", "key mass_kg", "1e-300", "1e-15 to 1e+12"),
    _toml("escape sequence", '"rig"', '"a\\u001b[2J"', "key name", "\\x1b[2J", "a title"),
    _toml("turned writing", '"2"', '"\\u202e2"', "key case", "\\u202e"),
    _toml("long case", '"2"', f'"{"n" * 201}"', "key case", "nnnn"),
    _toml("NUL in a path", "b.csv", "b\\u0000.csv", "recording 2", "key file", "\\x00"),
    _toml("path without end", "b.csv", "d/" * 400 + "b.csv", "recording 2", "no such file"),
    _toml("a device", "b.csv", "/dev/zero", "recording 2", "leads out", "--data"),
    _more("start at the end of time", "start_s = 1e200\n", "key start_s", "1e+200"),
    _toml("syntax", "mass_kg = 0.503", "mass_kg = ", "line 2", "syntax"),
    _toml("syntax at the end", 'case = "2"', 'case = "2', "line 10", "syntax"),
    _toml("key twice", "mass_kg = 0.503", "mass_kg = 1\nmass_kg = 2", "line 3", "syntax"),
    Bad("toml not utf-8", ("campaign.toml, line 1", "UTF-8", "0xe4"), TOML.encode() + b"#", {}),
    _toml("no name", 'name = "rig"', "", "key name", "nothing", "a title"),
    _toml("blank name", '"rig"', '" "', "key name", "a title"),
    _toml("no mass", "mass_kg = 0.503", "", "key mass_kg", "nothing", "above 0", "inertia"),
    _toml("mass zero", "0.503", "0", "key mass_kg", "found 0", "above 0"),
    _toml("mass negative", "0.503", "-0.5", "key mass_kg", "-0.5", "above 0"),
    _toml("mass text", "0.503", '"heavy"', "key mass_kg", 'the text "heavy"', "above 0"),
    _toml("mass true", "0.503", "true", "key mass_kg", "found true", "above 0"),
    _toml("mass nan", "0.503", "nan", "key mass_kg", "nan", "above 0"),
    _toml("mass infinite", "0.503", "inf", "key mass_kg", "inf", "above 0"),
    _toml("misspelt key", "mass_kg", "mass_kq", "key mass_kq", "unknown key", "mean mass_kg"),
    _toml("unknown key", "mass_kg", "colour = 3\nmass_kg", "key colour", "unknown", "mass_kg, "),
    _toml("stop as text", "mass_kg", 'stop = "no"\nmass_kg', "key stop", "true or false"),
    _toml("stop as number", "mass_kg", "stop = 0\nmass_kg", "key stop", "true or false"),
    Bad("no recording", ("campaign.toml", "key recording", "nothing", "[[recording]]"), TOML[:29]),
    Bad("empty recordings", ("key recording", "an empty list"), TOML[:29] + "recording = []\n"),
    Bad(
        "recording not a list",
        ("key recording", "a table with file", "[[recording]]"),
        TOML[:29] + '[recording]\nfile = "a.csv"\n',
    ),
    Bad("recording a number", ("recording 1", "[[recording]]"), TOML[:29] + "recording = [3]\n"),
    _toml("no file key", 'file = "b.csv"', "", "recording 2", "key file", "nothing", "file name"),
    _toml("file a number", '"b.csv"', "7", "recording 2", "key file", "found 7", "file name"),
    _toml("missing file", "b.csv", "c.csv", "recording 2 (c.csv)", "no such file", "readable file"),
    _toml("folder as file", "b.csv", ".", "recording 2 (.)", "a folder", "readable file"),
    _toml(
        "same file twice", "b.csv", "a.csv", "recording 2", 'called "a"', "file names that differ"
    ),
    _toml("same stem twice", "b.csv", "other/../a.csv", 'called "a"', "file names that differ"),
    _toml("no case", 'case = "2"', "", "recording 2 (b.csv)", "key case", 'case = "1"', "stop ="),
    _toml("case a number", '"2"', "2", "recording 2 (b.csv)", "key case", "found 2", "in quotes"),
    _toml("case blank", '"2"', '""', "recording 2 (b.csv)", "key case", "in quotes"),
    _more("misspelt rate", "sample_rate = 5\n", "key sample_rate", "mean sample_rate_hz"),
    _more("rate zero", "sample_rate_hz = 0\n", "recording 2", "key sample_rate_hz", "above 0"),
    _more("unknown unit", 'unit = "inch"\n', "recording 2", "key unit", '"inch"', "mm, um, rad"),
    _more("start as text", 'start_s = "0"\n', "recording 2", "key start_s", "a number"),
    _more("start at end", "start_s = 1\nend_s = 1\n", "recording 2", "key end_s", "after start_s"),
    _more(
        "starts too late", "start_s = 9\n", "recording 2", "key start_s", "within the file's 0 to"
    ),
    _more("ends too early", "end_s = -1\n", "recording 2", "key end_s", "within the file's 0 to"),
    _more("measurement a number", "[[measurement]]\n", "key measurement", "a table [measurement]"),
    _more("unknown in chain", "[measurement]\nnois_um = 5\n", "[measurement]", "mean noise_um"),
    _more("noise zero", "[measurement]\nnoise_um = 0\n", "key noise_um", "found 0", "above 0"),
    _more("noise of an angle", "[measurement]\nnoise_deg = 1\n", "noise_deg", "accepted: noise_um"),
    _more("noise twice", "[measurement]\nnoise_um = 5\nnoise_deg = 1\n", "noise_um and noise_deg"),
    _more(
        "unknown smoothing",
        '[measurement]\nsmoothing = { kind = "box", window = 5 }\n',
        *("[measurement]", "smoothing", '"box"', '"savgol"', '"lag"'),
    ),
    _more("smoothing kindless", "[measurement]\nsmoothing = { window = 5 }\n", 'kind = "savgol"'),
    _more("smoothing a number", "[measurement]\nsmoothing = 5\n", "smoothing", 'kind = "savgol"'),
    _more(
        "window fractional",
        '[measurement]\nsmoothing = { kind = "savgol", window = 20.5, polyorder = 2 }\n',
        *("key window", "20.5", "whole number"),
    ),
    _more(
        "window too long",
        '[measurement]\nsmoothing = { kind = "savgol", window = 701, polyorder = 2 }\n',
        *("key window", "701", "at most 600"),
    ),
    _more(
        "order too high",
        '[measurement]\nsmoothing = { kind = "savgol", window = 6, polyorder = 5 }\n',
        *("key polyorder", "found 5", "below 5"),
    ),
    _more("lag incomplete", '[measurement]\nsmoothing = { kind = "lag" }\n', "key time_constant_s"),
    _more("clock negative", "[measurement]\nclock_uncertainty_ppm = -1\n", "ppm", "0 or more"),
    _toml(
        "mass uncertainty",
        "mass_kg",
        "mass_uncertainty_kg = 1\nmass_kg",
        *("key mass_uncertainty_kg", "less than the mass, 0.503 kg"),
    ),
    _more("beam incomplete", f"[beam.1]\n{BEAM}", "[beam.1]", "youngs_modulus_mpa", "nothing"),
    _more(
        "beam of no case",
        f"[beam.9]\n{BEAM}youngs_modulus_mpa = 2e5\n",
        *("[beam.9]", "a case of no recording", "cases: 1, 2"),
    ),
    _more("beam a number", "[beam]\n1 = 5\n", "[beam.1]", "tables [beam.<case>]"),
    _more(
        "prior of nothing",
        '[priors]\nk3 = { distribution = "halfnormal", scale = 1 }\n',
        *("[priors]", "key k3", "no parameter", "<effect>.<parameter>"),
    ),
    _more(
        "prior of no case",
        '[priors]\n"k2[7]" = { distribution = "halfnormal", scale = 1 }\n',
        *("key k2[7]", "did you mean k2[", "k2[1], k2[2]"),
    ),
    _more("prior a number", "[priors]\nk1 = 800\n", "[priors] k1", "found 800", "distribution ="),
    _more("prior without kind", "[priors]\nk1 = { mean = 8 }\n", "[priors] k1", "distribution ="),
    _more(
        "unknown prior",
        '[priors]\nk1 = { distribution = "gauss", mean = 8 }\n',
        *("[priors] k1", '"gauss"', '"normal"', '"loguniform"'),
    ),
    _more(
        "prior incomplete",
        '[priors]\nk1 = { distribution = "normal", mean = 8 }\n',
        *("[priors] k1", "key sd", "nothing"),
    ),
    _more(
        "prior with a stray key",
        '[priors]\nk1 = { distribution = "normal", mean = 8, sd = 1, scale = 2 }\n',
        *("[priors] k1", "key scale", "unknown key", "distribution, mean, sd"),
    ),
    _more(
        "prior upside down",
        '[priors]\nk1 = { distribution = "uniform", lower = 9, upper = 8 }\n',
        *("[priors] k1", "key upper", "more than lower = 9"),
    ),
    _more(
        "prior below zero",
        '[priors]\nk1 = { distribution = "loguniform", lower = -1, upper = 8 }\n',
        *("[priors] k1", "key lower", "-1", "above 0"),
    ),
    _more(
        "prior of another world",
        '[priors]\nk1 = { distribution = "normal", mean = 1e29, sd = 1e-29 }\n',
        *("[priors] k1", "key sd", "a width of 1e-29", "1e+17 or more"),
    ),
    _more(
        "prior far beyond the recordings",
        '[priors]\nk1 = { distribution = "normal", mean = 1e10, sd = 1 }\n',
        *("[priors] k1", "key mean", "1e+10", "k1 from 1e+10 to 1e+10 SI", "8.13e+04 SI"),
    ),
    _more(
        "prior far below the recordings",
        '[priors]\nk1 = { distribution = "halfnormal", scale = 1e-20 }\n',
        *("[priors] k1", "key scale", "4.9e-20 SI", "0.000813 to"),
    ),
    _more(
        "prior in millimetres",
        '[priors]\n"y0[b]" = { distribution = "uniform", lower = 50, upper = 70 }\n',
        *("[priors] y0[b]", "key lower", "y0[b] from 50 to 70", "1.19 SI"),
    ),
    _more(
        "prior without room",
        "[priors]\n"
        '"gap_wear.step" = { distribution = "uniform", lower = 1, upper = 1.0000000000001 }\n',
        *("[priors] gap_wear.step", "key upper", "a width of 9.99e-14", "1e-12 or more"),
    ),
    Bad(
        "obstacle's prior without a stop",
        ("key g", "no parameter", "c1, k1, y0"),
        "stop = false\n" + TOML + '[priors]\ng = { distribution = "halfnormal", scale = 1 }\n',
    ),
    Bad(
        "beam without a stop",
        ("[beam.1]", "none (stop = false)"),
        f"stop = false\n{TOML}[beam.1]\n{BEAM}youngs_modulus_mpa = 2e5\n",
    ),
]

BAD_FILES = [
    _file("far too large", csv(decay() * 1e200), "a reading of", "at most 1e+06 m"),
    _file("far too small", csv(decay() * 1e-20), "differ by", "1e-15 m or more"),
    _file("picoseconds", csv(interval=1e-12), "1e-12 s apart", "1e-09 s to 1e+09 s"),
    _file("empty file", "", "an empty file", "a header row"),
    _file("only blank lines", "\n \n", "an empty file", "a header row"),
    _file("only comments", "# nothing\n# here\n", "no header row", "a header row"),
    _file("only a header", ROWS[0] + "\n", "only a header row", "rows of numbers"),
    _file("one sample", "\n".join(ROWS[:2]), "one sample", "rows of numbers"),
    _file("no header", "\n".join(ROWS[1:]), "line 1", "in place of the header", "displacement_mm"),
    _file("not utf-8", _row(4, "# 5 \xb5m").encode("latin-1"), "line 4", "UTF-8", "0xb5"),
    _file("utf-16", csv().encode("utf-16"), "UTF-8", "a text file"),
    _file("binary", b"MATLAB\0\0\1", "binary", "a text file"),
    _file("nan", _row(5, "0.006,nan"), "line 5", "displacement_m", '"nan"', "finite number"),
    _file("infinite", _row(5, "0.006,-inf"), "line 5", "displacement_m", '"-inf"', "finite"),
    _file("nan in time", _row(5, "nan,0"), "line 5", "column time_s", '"nan"', "finite number"),
    _file("overflow", _row(5, "0.006,1e999"), "line 5", '"1e999"', "finite number"),
    _file("text", _row(9, "0.014,saturated"), "line 9", '"saturated"', "finite number"),
    _file("empty field", _row(9, "0.014,"), "line 9", "an empty field", "finite number"),
    _file("underscore", _row(9, "0.014,1_0"), "line 9", '"1_0"', "finite number"),
    _file("field missing", _row(9, "0.014"), "line 9", "1 fields", "2 fields as in the header"),
    _file("field too many", _row(9, "0.014,0,1"), "line 9", "3 fields", "2 fields"),
    _file("decimal commas among commas", csv().replace(".", ","), "line 2", "need semicolons"),
    _file(
        "commas and points",
        csv(header="time_s;displacement_m", separator=";").replace(".", ",", 1),
        *("line 3", "a comma in a number", "decimal points throughout"),
    ),
    _file("empty line inside", _row(9, ""), "line 9", "an empty line", "a row of numbers"),
    _file("backwards", _row(9, "0.001,0"), "line 9", "time running backwards", "increase"),
    _file("same time twice", _row(9, ROWS[7]), "line 9", "the same time twice", "increase"),
    _file("gap", _without(100, 101), "line 100", "a gap from 0.194 s to 0.2 s", "evenly"),
    _file("uneven", _row(9, "0.0144,0"), "line 9", "of an interval off", "evenly spaced"),
    _file("no time", "displacement_m\n1\n2\n", "no time column", "sample_rate_hz"),
    _file("two times", csv(header="time_s,time_ms"), "line 1", "two time columns", "one of"),
    _file(
        "rates disagree",
        csv(),
        *("sample_rate_hz = 1000", "500 Hz", "both agreeing"),
        keys="sample_rate_hz = 1000\n",
    ),
    _file("no response", csv(header="time_s,volt"), "line 1", "no response column", "column and"),
    _file("misspelt", csv(header="time_s,displacment_mm"), "line 1", "mean displacement_mm"),
    _file(
        "two responses",
        "time_s,displacement_m,angle_rad\n0,1,1\n1,2,2\n",
        *("line 1", "several response columns", "column ="),
    ),
    _file(
        "no such column", csv(), "line 1", '"laser"', "displacement_m", keys='column = "laser"\n'
    ),
    _file("time as response", csv(), "is the time column", keys='column = "time_s"\n'),
    _file(
        "column without unit",
        csv(header="time_s,laser"),
        *("column laser", "no unit", "um, rad, deg"),
        keys='column = "laser"\n',
    ),
    _file("unit contradicts", csv(), 'unit = "mm"', 'unit = "m"', keys='unit = "mm"\n'),
    _file(
        "mixed quantities", csv(header="time_s,angle_rad"), "an angle", "displacement, throughout"
    ),
    _file("constant", csv(np.full(600, 1e-3)), "all equal 0.001 m", "two periods"),
    _file("too short", csv(decay(120)), "120 samples", "fewer than two periods", "two periods or"),
    _file("no oscillation", csv(np.exp(-np.arange(600) / 90)), "fewer than two periods"),
    _file("cut too short", csv(), "fewer than two periods", keys="start_s = 1.0\n"),
]

BAD = BAD_TOML + BAD_FILES
