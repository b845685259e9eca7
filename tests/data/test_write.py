"""A campaign that is saved and read again is the same, whichever key of campaign.toml made it."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from campaigns import csv, decay, write

import bayesimpact as bi
from bayesimpact.data import schema
from bayesimpact.data.faults.find import set_aside
from bayesimpact.errors import InputError

TOP = 'name = "rig"\nmass_kg = 0.5\n'
ENTRY = '[[recording]]\nfile = "a.csv"\ncase = "1"\n'
OTHER = '[[recording]]\nfile = "b.csv"\ncase = "2"\n'
CHAIN = "[measurement]\n"
BEAM = (
    '[beam."1"]\nlength_mm = 110.0\nwidth_mm = 20.0\nthickness_mm = 5.0\n'
    "youngs_modulus_mpa = 210000.0\n"
)
VALUES = {"lower": 500.0, "upper": 1500.0, "sigma": 0.3}
"""Of the keys of a prior of k1, which is about 809 N/m here; others are 800."""


def _prior(kind: str) -> str:
    keys = [key for key in schema._TAGGED["distribution"][kind].model_fields][1:]
    rest = "".join(f"priors.k1.{key} = {VALUES.get(key, 800.0)}\n" for key in keys)
    return f'priors.k1.distribution = "{kind}"\n{rest}{TOP}{ENTRY}'


def _uneven() -> str:
    times = np.arange(600) * 2e-3 + np.random.default_rng(0).uniform(-4e-4, 4e-4, 600)
    times[300:] += 0.05
    wave = -6e-3 * np.exp(-0.15 * times) * np.cos(2 * np.pi * 6.4 * times)
    pairs = zip(times.tolist(), wave.tolist(), strict=True)
    return "time_s,displacement_m\n" + "".join(f"{t:.9g},{y!r}\n" for t, y in pairs)


_MM, _SECONDS = decay() * 1e3, np.arange(600) * 2e-3
TWO = "t,near,far\n" + "".join(
    f"{t:.4f},{x:.9g},{2 * x:.9g}\n" for t, x in zip(_SECONDS, _MM, strict=True)
)
FILES: dict[str, str | bytes] = {
    "no clock": "displacement_m\n" + "".join(f"{y!r}\n" for y in decay().tolist()),
    "two columns": TWO,
    "angle": csv(header="time_s,angle_rad", scale=20.0),
    "uneven": _uneven(),
    "shifted": csv(start=115.0),
    "preamble": "1,2,3\n" + TWO,
    "two sensors": TWO.replace("t,near,far", "t [s],near [mm],far [mm/s]"),
    "Latin-1": TWO.replace("near", "näh").encode("latin-1"),
}
NEAR = 'column = "near"\nunit = "mm"\n'
INPUT = (
    f'{TOP}{ENTRY}time_column = 1\n{NEAR}[recording.input]\ncolumn = "far"\n'
    'kind = "base_m_s2"\nscale = 3.0\ngain = "free"\nremove_mean = true\nhold = "band_limited"\n'
)
KEYS: dict[str, dict[str, tuple[str, str]]] = {
    "CampaignTable": {
        "name": (TOP + ENTRY, ""),
        "mass_kg": (TOP + ENTRY, ""),
        "mass_uncertainty_kg": (f"mass_uncertainty_kg = 0.0123\n{TOP}{ENTRY}", ""),
        "stop": ("stop = false\n" + TOP + ENTRY, ""),
        "recording": (TOP + ENTRY + OTHER, ""),
        "measurement": (TOP + ENTRY + "[measurement]\nnoise_um = 7.0\n", ""),
        "priors": (_prior("normal"), ""),
        "beam": (TOP + ENTRY + BEAM, ""),
        "faults": ('faults = "keep"\n' + TOP + ENTRY, ""),
    },
    "RecordingTable": {
        "file": (TOP + ENTRY, ""),
        "case": (TOP + ENTRY, ""),
        "name": (f'{TOP}{ENTRY}name = "release 1: \\"stiff\\" ü?"\n', ""),
        "sample_rate_hz": (f"{TOP}{ENTRY}sample_rate_hz = 500.0\n", "no clock"),
        "column": (f"{TOP}{ENTRY}time_column = 1\n{NEAR}", "two columns"),
        "channel": (f'{TOP}{ENTRY}time_column = 1\nchannel = "far"\nunit = "mm"\n', "two columns"),
        "time_column": (f"{TOP}{ENTRY}time_column = 1\n{NEAR}", "two columns"),
        "time_unit": (f'{TOP}{ENTRY}time_column = 1\ntime_unit = "ms"\n{NEAR}', "two columns"),
        "block": (TOP + ENTRY.replace("csv", "npz") + "block = 1\n", ""),
        "skip_rows": (f"{TOP}{ENTRY}skip_rows = 1\ntime_column = 1\n{NEAR}", "preamble"),
        "encoding": (
            f'{TOP}{ENTRY}encoding = "latin-1"\ntime_column = 1\n{NEAR.replace("near", "näh")}',
            "Latin-1",
        ),
        "unit": (f"{TOP}{ENTRY}time_column = 1\n{NEAR}", "two columns"),
        "quantity": (f'{TOP}{ENTRY}quantity = "velocity"\n', "two sensors"),
        "motion": (f'{TOP}{ENTRY}motion = "first"\n', ""),
        "gain": (f'{TOP}{ENTRY}name = "a"\n{ENTRY}name = "b"\ngain = "free"\n', ""),
        "high_pass_hz": (f"{TOP}{ENTRY}high_pass_hz = 0.35\n", ""),
        "start_s": (f"{TOP}{ENTRY}start_s = 115.2\n", "shifted"),
        "end_s": (f"{TOP}{ENTRY}end_s = 116.0\n", "shifted"),
        "exclude_s": (f"{TOP}{ENTRY}exclude_s = [[115.1, 115.15], [115.5, 115.5]]\n", "shifted"),
        "invert": (f"{TOP}{ENTRY}invert = true\n", ""),
        "scale": (f"{TOP}{ENTRY}scale = 1.7\n", ""),
        "clock_ratio": (f"{TOP}{ENTRY}clock_ratio = 1.0002\n", "shifted"),
        "resample": (f"{TOP}{ENTRY}resample = true\n", "uneven"),
        "input": (
            f'{TOP}{ENTRY}time_column = 1\n{NEAR}input = {{ column = "far", kind = "force_N" }}\n',
            "two columns",
        ),
        "skip": (f'{TOP}{OTHER}{ENTRY}skip = "the probe came loose"\n', ""),
    },
    "InputTable": {
        key: (INPUT, "two columns")
        for key in ("column", "kind", "scale", "gain", "remove_mean", "hold", "absolute")
    },
    "MeasurementTable": {
        "noise_um": (TOP + ENTRY + CHAIN + "noise_um = 7.0\n", ""),
        "noise_mrad": (TOP + ENTRY + CHAIN + "noise_mrad = 0.7\n", "angle"),
        "noise_deg": (TOP + ENTRY + CHAIN + "noise_deg = 0.7\n", "angle"),
        "smoothing": (TOP + ENTRY + CHAIN + 'smoothing = "none"\n', ""),
        "clock_uncertainty_ppm": (TOP + ENTRY + CHAIN + "clock_uncertainty_ppm = 30.0\n", ""),
        "gain_uncertainty_percent": (TOP + ENTRY + CHAIN + "gain_uncertainty_percent = 0.3\n", ""),
    },
    **{
        kind.__name__: {key: (f"{TOP}{ENTRY}[measurement.smoothing]\n{text}", "") for key in fields}
        for kind, text, fields in (
            (
                schema.SavgolTable,
                'kind = "savgol"\nwindow = 20\npolyorder = 2\n',
                ("kind", "window", "polyorder"),
            ),
            (
                schema.LagTable,
                'kind = "lag"\ntime_constant_s = 0.002\n',
                ("kind", "time_constant_s"),
            ),
            (schema.UnfilteredTable, 'kind = "none"\n', ("kind",)),
        )
    },
    "BeamTable": {
        key: (TOP + ENTRY + BEAM, "")
        for key in ("length_mm", "width_mm", "thickness_mm", "youngs_modulus_mpa")
    },
}
"""Table of the schema -> key -> (campaign.toml in which it acts, the kind of file it is for)."""
for _kind, _table in schema._TAGGED["distribution"].items():  # any key of any prior acts in one
    KEYS[_table.__name__] = {key: (_prior(_kind), "") for key in _table.model_fields}


def _tables() -> dict[str, type[schema._Table]]:
    found = schema._Table.__subclasses__()
    return {table.__name__: table for table in found}


def assert_same(mine: Any, other: Any, place: str = "") -> None:
    """Equal in all attributes, however deep; numbers within the rounding of a change of units."""
    if dataclasses.is_dataclass(mine):
        assert type(mine) is type(other), place
        for field in dataclasses.fields(mine):
            if field.name not in (
                "sha256",
                "folder",
                "scaled",
                "doubts",
            ):  # of the files, not of the campaign
                pair = getattr(mine, field.name), getattr(other, field.name)
                assert_same(*pair, f"{place}.{field.name}")
    elif isinstance(mine, Mapping):
        assert list(mine) == list(other), place
        for key in mine:
            assert_same(mine[key], other[key], f"{place}[{key}]")
    elif isinstance(mine, tuple):
        assert len(mine) == len(other), place
        for i, pair in enumerate(zip(mine, other, strict=True)):
            assert_same(*pair, f"{place}[{i}]")
    elif isinstance(mine, np.ndarray) and mine.dtype.kind == "f":
        np.testing.assert_allclose(mine, other, rtol=1e-11, atol=1e-13, err_msg=place)
    elif isinstance(mine, np.ndarray):
        np.testing.assert_array_equal(mine, other, place)
    elif isinstance(mine, float):
        assert other == pytest.approx(mine, rel=1e-12, abs=1e-12), place
    else:
        assert mine == other, place


def _same(mine: bi.Campaign, other: bi.Campaign) -> bool:
    try:
        assert_same(mine, other)
    except AssertionError:
        return False
    return True


def _folder(folder: Path, toml: str, kind: str) -> Path:
    text = FILES[kind] if kind else csv()
    np.savez(folder / "a.npz", x_mm=decay() * 1e3, fs=500.0)
    return write(folder, toml, a=text)


def test_every_key_of_the_schema_is_here() -> None:
    said = {name: list(table.model_fields) for name, table in _tables().items()}
    assert {name: list(keys) for name, keys in KEYS.items()} == said


@pytest.mark.parametrize(("table", "key"), [(t, k) for t, keys in KEYS.items() for k in keys])
def test_every_key_survives_saving(tmp_path: Path, table: str, key: str) -> None:
    toml, kind = KEYS[table][key]
    campaign = bi.load(_folder(tmp_path, toml, kind))
    campaign.save(tmp_path / "new")
    assert_same(bi.load(tmp_path / "new"), campaign)


@pytest.mark.parametrize("key", [k for k in KEYS["RecordingTable"] if k not in ("file", "block")])
def test_the_examples_of_a_recording_depend_on_their_key(tmp_path: Path, key: str) -> None:
    """Else that a key survives would say nothing."""
    toml, kind = KEYS["RecordingTable"][key]
    lines = [line for line in toml.split("\n") if not line.startswith(f"{key} = ")]
    assert len(lines) < toml.count("\n") + 1
    campaign = bi.load(_folder(tmp_path, toml, kind))
    try:
        without = bi.load(_folder(tmp_path, "\n".join(lines), kind))
    except InputError:
        return
    assert not _same(campaign, without)


def test_what_was_set_aside_stays_so(tmp_path: Path) -> None:
    samples = decay() + np.random.default_rng(0).normal(0.0, 5e-6, 600)
    samples[[100, 350, 351]] += 2e-3
    entry = {"samples": samples, "unit": "m", "times_s": 1e6 + np.arange(600) * 2e-3}
    entries = [{**entry, "name": "a", "case": "1"}, {**entry, "name": "b", "case": "1"}]
    made = bi.Campaign.from_arrays(entries, name="rig", mass_kg=0.5)
    cleaned, faults = set_aside(made)
    assert {f.id for f in faults} == {"recording_spikes", "recording_duplicate"}
    again = bi.load(cleaned.save(tmp_path / "new"))
    used = again.recordings[0].used
    assert used is not None and not used[[100, 350, 351]].any() and used.sum() > 550
    assert_same(again.recordings, cleaned.recordings)
    assert dict(again.skipped) == dict(cleaned.skipped)
    said = (tmp_path / "new" / "campaign.toml").read_text()
    assert [note for note in cleaned.notes if f"# {note}" not in said] == []
    assert_same(set_aside(again)[0].recordings, again.recordings)


@pytest.mark.parametrize("name", ["a*b", "x" * 300, "a\u202eb", "a\x7fb", "what?", "C:", "über"])
def test_names_that_no_file_may_have(tmp_path: Path, name: str) -> None:
    entry = f"{ENTRY}name = {json.dumps(name)}\n".replace("\x7f", "\\u007f")
    made = bi.load(write(tmp_path, TOP + entry))
    assert made.recordings[0].name == name
    skipped = dataclasses.replace(made, mass=np.float64(0.5), skipped={"b*": "no"})
    again = bi.load(skipped.save(tmp_path / "new"))
    assert_same(dataclasses.replace(again, notes=()), skipped)
