"""Campaigns from memory are those from files: same samples, same refusals."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from campaigns import TOML, decay, write

import bayesimpact as bi
from bayesimpact.errors import InputError

INTERVAL = 2e-3
TIMES = np.arange(600) * INTERVAL
A = {"name": "a", "case": "1", "samples": decay() * 1e3, "unit": "mm", "times_s": TIMES}
B = {**A, "name": "b", "case": "2"}
K1 = {"k1": {"distribution": "normal", "mean": np.float64(800.0), "sd": 50}}


def _made(*recordings: Any, **tables: Any) -> bi.Campaign:
    tables = {"name": "rig", "mass_kg": 0.503, **tables}
    return bi.Campaign.from_arrays(recordings or (A, B), **tables)


def _same(first: bi.Campaign, second: bi.Campaign) -> None:
    assert (first.name, first.mass, first.stop) == (second.name, second.mass, second.stop)
    assert first.measurement == second.measurement
    assert {k: dict(p) for k, p in first.priors.items()} == {
        k: dict(p) for k, p in second.priors.items()
    }
    assert dict(first.beams) == dict(second.beams)
    for mine, other in zip(first.recordings, second.recordings, strict=True):
        assert (mine.name, mine.case, mine.quantity) == (other.name, other.case, other.quantity)
        assert mine.interval == pytest.approx(other.interval, rel=1e-12)
        assert mine.start == pytest.approx(other.start, abs=1e-12)
        np.testing.assert_allclose(mine.samples, other.samples, rtol=1e-11)


def test_arrays_are_what_files_would_be(tmp_path: Path) -> None:
    chain = "[measurement]\nnoise_um = 5.0\n"
    priors = '[priors]\nk1 = { distribution = "normal", mean = 800.0, sd = 50 }\n'
    from_files = bi.load(write(tmp_path, TOML + chain + priors))
    _same(_made(measurement={"noise_um": 5.0}, priors=K1), from_files)


def test_rate_start_and_end() -> None:
    entry = {k: v for k, v in A.items() if k != "times_s"}
    timed = {**entry, "sample_rate_hz": np.int64(500), "start_s": 0.1, "end_s": 1.0}
    (recording,) = _made(timed).recordings
    np.testing.assert_allclose(recording.samples, decay()[50:501], rtol=1e-12)
    assert recording.start == pytest.approx(0.1)


def test_recordings_in_si() -> None:
    made = _made()
    _same(_made(*made.recordings), made)


def test_samples_that_are_set_aside_stay_so() -> None:
    used = np.ones(600, dtype=bool)
    used[100:103] = False
    spoiled = np.where(used, A["samples"], 1e3)
    (made,) = _made({**A, "samples": spoiled, "used": used}).recordings
    (again,) = _made(made).recordings
    (even,) = _made({**A, "samples": spoiled, "used": used, "resample": True}).recordings
    for recording in (made, again, even):
        assert recording.used is not None
        np.testing.assert_array_equal(recording.used, used)
        np.testing.assert_allclose(recording.samples, decay(), atol=1e-5)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"used": [True]}, ("key used", "shape (1,)", "(600,)")),
        ({"used": np.arange(600)}, ("key used", "int64")),
        ({"used": np.arange(600) == 3}, ("key used", "1 samples")),
        ({"used": np.arange(600) < 60}, ("60 of 600", "20% or more")),
        ({"samples": decay()[:, None]}, ("key samples", "shape (600, 1)")),
        ({"samples": np.where(TIMES[7] == TIMES, np.nan, 1.0)}, ("sample 7", "nan", "finite")),
        ({"samples": np.ma.masked_equal(np.arange(600.0), 9)}, ("sample 9", "nan", "finite")),
        ({"samples": decay() + 0j}, ("key samples", "complex128")),
        ({"samples": ["1"] * 600}, ("key samples", "finite numbers")),
        ({"samples": None}, ("key samples", "nothing")),
        ({"unit": None}, ("key unit", "nothing", "mm")),
        ({"unit": "m"}, ("key unit", "m at 6.4 Hz", "m/s", "below 100")),
        ({"unit": "inch"}, ("key unit", '"inch"')),
        ({"name": None}, ("recording 1", "key name")),
        ({"name": "a/b"}, ("key name", '"a/b"', "slashes")),
        ({"name": "a[1]"}, ("key name", "brackets")),
        ({"case": 1}, ("recording 1 (a)", "key case", "found 1")),
        ({"case": None}, ("recording 1 (a)", "key case", "nothing")),
        ({"times_s": TIMES[1:]}, ("key times_s", "599 times of 600")),
        ({"times_s": TIMES[::-1]}, ("sample 1", "time running backwards")),
        ({"times_s": np.where(TIMES > 0.5, TIMES + 0.1, TIMES)}, ("sample 251", "a gap")),
        ({"times_s": None}, ("no clock", "sample_rate_hz")),
        ({"sample_rate_hz": 1000}, ("500 Hz", "both agreeing")),
        ({"start_s": 9.0}, ("key start_s", "no samples left")),
        ({"colour": 3}, ("key colour", "unknown key")),
        ({"column": "x"}, ("key column", "recordings in files")),
        ({"samples": np.ones(600)}, ("recording 1 (a)", "all equal")),
        ({"samples": decay()[:90], "times_s": TIMES[:90]}, ("fewer than two periods",)),
    ],
)
def test_refused(change: dict[str, Any], words: tuple[str, ...]) -> None:
    with pytest.raises(InputError) as refusal:
        _made({**A, **change}, B)
    assert [
        word for word in (*words, "Campaign.from_arrays") if word not in str(refusal.value)
    ] == []


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ({"priors": {"k3": K1["k1"]}}, ("key k3", "no parameter of this campaign")),
        ({"priors": {"k1": {"distribution": "gauss"}}}, ("k1", '"gauss"')),
        ({"mass_kg": 0.0}, ("key mass_kg", "above 0")),
        ({"mass_kg": float("nan")}, ("key mass_kg", "nan")),
        ({"colour": 3}, ("key colour", "unknown key")),
        ({"measurement": {"noise_deg": 1}}, ("noise_deg", "noise_um")),
    ],
)
def test_refused_tables(tables: dict[str, Any], words: tuple[str, ...]) -> None:
    with pytest.raises(InputError) as refusal:
        _made(**tables)
    assert [word for word in words if word not in str(refusal.value)] == []


def test_refused_as_a_whole() -> None:
    with pytest.raises(InputError, match=r'recording 2.*a second recording called "a"'):
        _made(A, A)
    with pytest.raises(InputError, match="an empty list"):
        bi.Campaign.from_arrays([], name="x", mass_kg=1.0)
    with pytest.raises(InputError, match="found a dict"):
        bi.Campaign.from_arrays(A, name="x", mass_kg=1.0)


def _long() -> pd.DataFrame:
    parts = [
        pd.DataFrame(
            {"recording": n, "case": c, "time_ms": TIMES * 1e3, "displacement_mm": decay() * 1e3}
        )
        for n, c in (("a", "1"), ("b", "2"))
    ]
    return pd.concat(parts, ignore_index=True)


def _wide() -> pd.DataFrame:
    index = pd.Index(TIMES, name="time_s")
    return pd.DataFrame({"near": decay() * 1e3, "far": decay() * 1e3}, index=index)


def _from_wide() -> bi.Campaign:
    recordings = [
        {"name": "a", "case": "1", "column": "near", "unit": "mm"},
        {"name": "b", "case": "2", "column": "far", "unit": "mm"},
    ]
    return bi.Campaign.from_dataframe(_wide(), name="rig", mass_kg=0.503, recordings=recordings)


def _padded() -> xr.DataArray:
    rows = np.full((2, 700), np.nan)
    rows[:, :600] = decay() * 1e6
    times = xr.DataArray(np.arange(700) * 2.0, dims="time", attrs={"units": "ms"})
    coords = {"recording": ["a", "b"], "case": ("recording", ["1", "2"]), "time": times}
    return xr.DataArray(rows, dims=("recording", "time"), coords=coords, attrs={"units": "um"})


def _dataset() -> xr.Dataset:
    stamps = np.datetime64("2024-05-01T12:00:00", "ns") + (TIMES * 1e9).astype("m8[ns]")
    variables = {
        n: ("time", decay() * 1e3, {"units": "mm", "case": c}) for n, c in (("a", "1"), ("b", "2"))
    }
    return xr.Dataset(variables, coords={"time": stamps})


@pytest.mark.parametrize(
    "made",
    [
        lambda: bi.Campaign.from_dataframe(_long(), name="rig", mass_kg=0.503),
        _from_wide,
        lambda: bi.Campaign.from_xarray(_padded(), name="rig", mass_kg=0.503),
        lambda: bi.Campaign.from_xarray(_dataset(), name="rig", mass_kg=0.503),
    ],
    ids=["long frame", "wide frame", "padded array", "dataset"],
)
def test_frames_and_labelled_arrays(made: Callable[[], bi.Campaign]) -> None:
    _same(made(), _made())


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda k: bi.Campaign.from_dataframe(decay(), **k), ("ndarray", "DataFrame")),
        (lambda k: bi.Campaign.from_dataframe(_wide(), **k), ("columns", "near", "displacement_m")),
        (
            lambda k: bi.Campaign.from_dataframe(
                _wide(), recordings=[{"column": "laser", "unit": "mm"}], **k
            ),
            ("'laser'", "near, far"),
        ),
        (
            lambda k: bi.Campaign.from_dataframe(_long().assign(case=list("12") * 600), **k),
            ("recording a", "cases 1, 2"),
        ),
        (lambda k: bi.Campaign.from_xarray(decay(), **k), ("ndarray", "Dataset")),
        (
            lambda k: bi.Campaign.from_xarray(_padded().drop_attrs(deep=False), **k),
            ("recording 1 (a)", "key unit", "nothing"),
        ),
        (
            lambda k: bi.Campaign.from_xarray(_padded().rename(time="t"), **k),
            ("recording a", "dimensions t"),
        ),
    ],
)
def test_refused_frames(call: Callable[..., bi.Campaign], words: tuple[str, ...]) -> None:
    with pytest.raises(InputError) as refusal:
        call({"name": "rig", "mass_kg": 0.503})
    assert [word for word in words if word not in str(refusal.value)] == []


def test_saved_and_read_again(tmp_path: Path) -> None:
    beam = {"length_mm": 110, "width_mm": 20, "thickness_mm": 5, "youngs_modulus_mpa": 2.1e5}
    smoothing = {"kind": "savgol", "window": 20, "polyorder": 2}
    made = _made(measurement={"smoothing": smoothing, "noise_um": 5}, priors=K1, beam={"1": beam})
    file = made.save(tmp_path / "new")
    assert file == tmp_path / "new" / "campaign.toml"
    again = bi.load(file)
    _same(again, made)
    for mine, other in zip(made.recordings, again.recordings, strict=True):
        np.testing.assert_array_equal(mine.samples, other.samples)  # every digit
    with pytest.raises(InputError, match="a campaign already"):
        made.save(tmp_path / "new")
    made.save(tmp_path / "new", overwrite=True)


def test_pickled() -> None:
    made = _made(priors=K1)
    again = pickle.loads(pickle.dumps(made))
    _same(again, made)
    with pytest.raises(TypeError):
        again.priors["k1"]["sd"] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        again.recordings[0].samples[0] = 0.0
