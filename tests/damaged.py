"""Campaigns damaged in every way that a file can be, for Hypothesis; and what they must end in."""

from __future__ import annotations

import signal
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

import numpy as np
from campaigns import csv, decay
from hypothesis import strategies as st

from bayesimpact.data.read import load_campaign
from bayesimpact.errors import InputError
from bayesimpact.report.check_text import campaign_text, campaign_warnings, measured_noise

LIMIT = 2.0  # s of this process' own time
LINES, COLUMNS = 10, 100

BASE = """name = "rig"
mass_kg = 0.503
stop = true
mass_uncertainty_kg = 0.001

[[recording]]
file = "a.csv"
case = "1"
start_s = 0.0
end_s = 1.0

[[recording]]
file = "b.csv"
case = "2"
sample_rate_hz = 500

[measurement]
noise_um = 5.0
smoothing = { kind = "savgol", window = 21, polyorder = 2 }
clock_uncertainty_ppm = 20
gain_uncertainty_percent = 0.5

[priors]
k1 = { distribution = "normal", mean = 800, sd = 20 }
"k2[1]" = { distribution = "loguniform", lower = 1, upper = 1e5 }
coulomb_friction.force = { distribution = "halfnormal", scale = 1e-3 }

[beam.1]
length_mm = 110
width_mm = 20
thickness_mm = 5
youngs_modulus_mpa = 2e5
"""
NUMBERS = (
    *("0", "-0.0", "1e200", "-1e200", "1e-300", "1e308", "1.8e308", "5e-324", "nan", "inf", "-inf"),
    *("1e30", "1e-30", "1e12", "1e-12", "3", "-1", "0.5", "1_000", "0x10", "0b11", "1" * 400),
    *("9" * 5000, "1979-05-27", "07:32:00", "1979-05-27T07:32:00Z", "true", "1e9", "1e-9", "1000"),
)
TEXTS = (
    *(
        '""',
        '" "',
        '"a.csv"',
        '"b.csv"',
        '"1"',
        '"2"',
        '"\\u0000"',
        '"a\\u0000.csv"',
        '"\\u001b[2J"',
    ),
    *('"\\u202e"', '"$x$"', '"a$b"', "'C:\\x'", '"x"', '"]"', '"["', '"k2[1]"', '"a/../a.csv"'),
    *('"../a.csv"', '"/etc/passwd"', '"/dev/zero"', '"/dev/stdin"', '"."', '"~"', '"a\\nb"'),
    *('"' + "n" * 201 + '"', '"' + "y" * 70_000 + '"', '"' + "d/" * 3000 + '"', '"é\\U0001F600"'),
    *('"rad"', '"deg"', '"mm"', '"um"', '"time_s"', '"displacement_m"', '"savgol"', '"lag"'),
    *('"<script>alert(1)</script>"', '"%s%n{0}{x}"', '"_re"', '"\\\\frac"', '"CON"', '"a.b.c"'),
)
KEYS = (
    *("name", "mass_kg", "stop", "mass_uncertainty_kg", "file", "case", "start_s", "end_s", "unit"),
    *("column", "sample_rate_hz", "noise_um", "noise_mrad", "smoothing", "kind", "window", "lower"),
    *("polyorder", "time_constant_s", "clock_uncertainty_ppm", "distribution", "mean", "sd", "k1"),
    *("length_mm", "youngs_modulus_mpa", "colour", "_re", '"a b"', '""', "recording", "priors"),
    *("measurement", "beam", "y" * 60_000, '"k2[9]"', "a.b.c", "upper", "scale", "median", "sigma"),
)
FIELDS = (
    *("", " ", "nan", "inf", "1e999", "1e200", "-1e300", "1e-300", "0", "x", "1_0", "1,5", "1;5"),
    *("0x1p3", '"0.001"', "\x00", "\x1b[31m", "-", "1e", "9" * 400, "٣", "é", "#", "1e6", "-1e6"),
)
HEADERS = (
    *("time_s,displacement_m", "time_ms,displacement_mm", "time_s;displacement_um", "time_s"),
    *("time_s\tangle_deg", "time_s,angle_rad", "displacement_m", "t,x", "time_s,time_ms", ","),
    *("time_s,displacement_m,displacement_mm", "time_s," + ",".join(f"c{i}" for i in range(3000))),
    *("0.0,1.0", "# only a comment", "", "time_s,displacment_m", "\x1b]0;x\x07,y" + "z" * 9000),
)


@dataclass(frozen=True)
class Case:
    """The bytes of campaign.toml and of both recordings."""

    toml: bytes
    a: bytes
    b: bytes


@st.composite
def tomls(draw: st.DrawFn) -> bytes:
    """BASE with up to four changes."""
    lines = BASE.splitlines()
    values = (
        st.sampled_from(NUMBERS) | st.sampled_from(TEXTS) | st.builds(nested, depths(), kinds())
    )
    for _ in range(draw(st.integers(0, 4))):
        at = draw(st.integers(0, len(lines) - 1))
        match draw(st.integers(0, 6)):
            case 0 | 1 | 2 if "=" in lines[at] and "{" not in lines[at]:
                lines[at] = lines[at].split("=")[0] + "= " + draw(values)
            case 3 if "{" in lines[at]:
                words = lines[at].split("= ")
                word = draw(st.integers(1, len(words) - 1))
                tail = words[word][words[word].find(",") :] if "," in words[word] else " }"
                lines[at] = "= ".join([*words[:word], draw(values) + tail, *words[word + 1 :]])
            case 4:
                lines.insert(at, f"{draw(st.sampled_from(KEYS))} = {draw(values)}")
            case 5:
                del lines[at]
            case 6:
                lines.insert(at, lines[draw(st.integers(0, len(lines) - 1))])
            case _:
                pass
        if not lines:
            break
    text = "\n".join(lines).encode()
    if draw(st.integers(0, 9)) == 0:
        at = draw(st.integers(0, len(text)))
        text = text[:at] + draw(st.binary(max_size=20)) + text[at + draw(st.integers(0, 30)) :]
    return text


def depths() -> st.SearchStrategy[int]:
    return st.sampled_from((1, 3, 40, 400, 5000, 60_000))


def kinds() -> st.SearchStrategy[str]:
    return st.sampled_from(("[", "{", "."))


def nested(depth: int, kind: str) -> str:
    """A value in many brackets."""
    if kind == "[":
        return "[" * depth + "]" * depth
    if kind == "{":
        return "{ a = " * min(depth, 5000) + "1" + " }" * min(depth, 5000)
    return "{ " + "a." * depth + "b = 1 }"


@st.composite
def signals(draw: st.DrawFn) -> np.ndarray:
    """A decay, or something that is none, (n,)."""
    n = draw(st.sampled_from((0, 1, 2, 3, 5, 12, 40, 300, 300, 300, 600)))
    interval = 2e-3
    y = decay(n, interval) if n else np.zeros(0)
    rng = np.random.default_rng(draw(st.integers(0, 3)))
    match draw(st.integers(0, 12)):
        case 0:
            y = rng.standard_normal(n) * 1e-3
        case 1:
            y = np.full(n, draw(st.sampled_from((0.0, 1.0, 1e200, -1e-300))))
        case 2:
            y = 1e-3 * (-1.0) ** np.arange(n)
        case 3:
            y = np.round(y, draw(st.integers(2, 5)))
        case 4 if n > 9:
            y[n // 3] = draw(st.sampled_from((1.0, 1e5, 1e150, -2e-3, 1e-320)))
        case 5:
            y[n // 4 :] = y[n // 4] if n else 0.0
        case 6:
            y = np.sign(y)
        case 7:
            y = np.linspace(0, 1, n)
        case 8:
            y[: n // 2] = 0.0
        case _:
            y = y + 5e-6 * rng.standard_normal(n)
    return y * draw(st.sampled_from((1.0, 1.0, 1.0, 1e-9, 1e-300, 1e6, 1e8, 1e300, 1e-14))) + draw(
        st.sampled_from((0.0, 0.0, 0.0, 1.0, 1e6, 1e15))
    )


@st.composite
def tables(draw: st.DrawFn) -> bytes:
    """A recording's file: a signal, and up to three changes to its text."""
    with np.errstate(all="ignore"):
        y = draw(signals())
    interval = draw(st.sampled_from((2e-3, 2e-3, 2e-3, 1e-12, 1e6, 1e200, 1e-300, -1e-3, 0.0)))
    header = draw(st.sampled_from(HEADERS)) if draw(st.integers(0, 3)) == 0 else HEADERS[0]
    separator = next((mark for mark in ";\t" if mark in header), ",")
    start = draw(st.sampled_from((0.0, 0.0, -5.0, 1.7e9, 1e300)))
    text = csv(y, interval=interval, header=header, start=start, separator=separator)
    lines = text.splitlines()
    for _ in range(draw(st.integers(0, 3))):
        at = draw(st.integers(0, len(lines) - 1)) if lines else 0
        match draw(st.integers(0, 5)):
            case 0 | 1 if lines:
                fields = lines[at].split(separator)
                fields[draw(st.integers(0, len(fields) - 1))] = draw(st.sampled_from(FIELDS))
                lines[at] = separator.join(fields)
            case 2 if lines:
                del lines[at]
            case 3:
                lines.insert(at, draw(st.sampled_from(("", "# x", "1,2,3", "x" * 40_000))))
            case 4 if lines:
                lines.insert(at, lines[at])
            case _:
                pass
    data = "\n".join(lines).encode()
    if draw(st.integers(0, 9)) == 0:
        at = draw(st.integers(0, len(data)))
        data = data[:at] + draw(st.binary(max_size=20)) + data[at:]
    return data


GOOD = csv(decay(300) + 5e-6 * np.random.default_rng(1).standard_normal(300)).encode()
cases = st.builds(Case, tomls(), st.just(GOOD) | tables(), st.just(GOOD)) | st.builds(
    Case, st.just(BASE.split("[measurement]")[0].encode()), tables(), st.just(GOOD)
)


class Hang(BaseException):
    """The time is over."""


@contextmanager
def within(seconds: float) -> Iterator[None]:
    """Raise `Hang` after that much of this process' own time."""

    def over(number: int, frame: FrameType | None) -> None:
        raise Hang

    before = signal.signal(signal.SIGPROF, over)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def outcome(folder: Path, case: Case) -> tuple[str, str]:
    """("accepted" | "refused" | "long message" | "hang" | "traceback", details)."""
    for name, content in (("campaign.toml", case.toml), ("a.csv", case.a), ("b.csv", case.b)):
        (folder / name).write_bytes(content)
    began = time.process_time()
    try:
        with within(LIMIT), np.errstate(all="ignore"):
            campaign = load_campaign(folder)
            noise = measured_noise(campaign)
            words = campaign_text(campaign, noise)
            campaign_warnings(campaign, noise)
    except InputError as error:
        words = str(error)
        rows = sum(1 + len(line) // COLUMNS for line in words.split("\n"))
        fine = rows <= LINES and words.isprintable()
        return ("refused" if fine else "long message"), words
    except Hang:
        return "hang", f"{time.process_time() - began:.1f} s\n{traceback.format_exc()}"
    except Exception:
        return "traceback", traceback.format_exc()
    shown = words.replace("\n", "").isprintable()
    return ("accepted" if shown else "traceback"), f"control characters in {words!r}"
