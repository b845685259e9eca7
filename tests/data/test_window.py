"""What lies outside start_s and end_s does not matter, whatever it is and wherever it is read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from campaigns import decay, write

import bayesimpact as bi
from bayesimpact.data.window import unbroken, window
from bayesimpact.errors import InputError

KEYS = "start_s = 0.1\nend_s = 1.0\n"
HEADS = {"of its own kind": "time_s,displacement_m", "instrument's": "Time [s],x [m]"}


def _times() -> np.ndarray:
    return np.arange(600) * 2e-3


def _gap_after(times: np.ndarray, samples: np.ndarray) -> None:
    times[501:] += 0.003


def _gap_before(times: np.ndarray, samples: np.ndarray) -> None:
    times[:50] -= 0.003


def _slow_clock_after(times: np.ndarray, samples: np.ndarray) -> None:
    times[501:] += 2e-4 * np.arange(1, 100)


def _no_readings_outside(times: np.ndarray, samples: np.ndarray) -> None:
    samples[[3, 520, 599]] = np.nan


def _readings_of_any_size_outside(times: np.ndarray, samples: np.ndarray) -> None:
    samples[[3, 520]] = -1e12, 1e12


OUTSIDE = {
    "a gap after": _gap_after,
    "a gap before": _gap_before,
    "a slow clock after": _slow_clock_after,
    "readings that are none": _no_readings_outside,
    "absurd readings": _readings_of_any_size_outside,
}


def _campaign(
    folder: Path, times: np.ndarray, samples: np.ndarray, keys: str, head: str
) -> bi.Campaign:
    cells = ["" if np.isnan(x) else repr(x) for x in samples.tolist()]
    rows = [f"{t:.6f},{x}" for t, x in zip(times, cells, strict=True)]
    toml = 'name = "rig"\nmass_kg = 0.5\nstop = false\n[[recording]]\nfile = "a.csv"\n'
    return bi.load(write(folder, toml + keys, a="\n".join([head, *rows]) + "\n", b=None))


@pytest.mark.parametrize("change", OUTSIDE.values(), ids=OUTSIDE)
@pytest.mark.parametrize("head", HEADS.values(), ids=HEADS)
def test_a_file_is_read_as_without_what_lies_outside(tmp_path: Path, change, head: str) -> None:  # type: ignore[no-untyped-def]
    times, samples = _times(), decay()
    change(times, samples)
    (recording,) = _campaign(tmp_path, times, samples, KEYS, head).recordings
    assert recording.start == pytest.approx(0.1, abs=1e-9)
    assert recording.interval == pytest.approx(2e-3, rel=1e-9)
    np.testing.assert_allclose(recording.samples, decay()[50:501], rtol=1e-11)
    with pytest.raises(InputError):
        _campaign(tmp_path, times, samples, "", head)


@pytest.mark.parametrize("change", OUTSIDE.values(), ids=OUTSIDE)
def test_samples_in_memory_likewise(change) -> None:  # type: ignore[no-untyped-def]
    times, samples = _times(), decay()
    change(times, samples)
    entry = {"name": "a", "samples": samples, "unit": "m", "times_s": times}
    entry |= {"start_s": 0.1, "end_s": 1.0}
    made = bi.Campaign.from_arrays([entry], name="rig", mass_kg=0.5, stop=False)
    np.testing.assert_allclose(made.recordings[0].samples, decay()[50:501], rtol=1e-11)
    entry.pop("start_s"), entry.pop("end_s")
    with pytest.raises(InputError):
        bi.Campaign.from_arrays([entry], name="rig", mass_kg=0.5, stop=False)


def test_without_a_time_column(tmp_path: Path) -> None:
    samples = decay()
    samples[[3, 520]] = np.nan
    toml = 'name = "rig"\nmass_kg = 0.5\nstop = false\n[[recording]]\nfile = "a.csv"\n'
    keys = f"sample_rate_hz = 500\n{KEYS}"
    text = "\n".join(["displacement_m", *map(repr, samples.tolist())]) + "\n"
    read = bi.load(write(tmp_path, toml + keys, a=text, b=None)).recordings[0]
    entry = {"name": "a", "samples": samples, "unit": "m", "sample_rate_hz": 500.0}
    entry |= {"start_s": 0.1, "end_s": 1.0}
    made = bi.Campaign.from_arrays([entry], name="rig", mass_kg=0.5, stop=False).recordings[0]
    for recording in (read, made):
        assert recording.start == pytest.approx(0.1, abs=1e-9)
        np.testing.assert_allclose(recording.samples, decay()[50:501], rtol=1e-11)


@pytest.mark.parametrize("head", HEADS.values(), ids=HEADS)
def test_what_lies_inside_is_checked(tmp_path: Path, head: str) -> None:
    times, samples = _times(), decay()
    times[300:] += 0.003
    with pytest.raises(InputError, match=r"a\.csv, line 302: found a gap from 0\.598 s"):
        _campaign(tmp_path, times, samples, KEYS, head)
    samples[200] = np.nan
    with pytest.raises(InputError, match=r"a\.csv, line 202, .*accepted: a finite number"):
        _campaign(tmp_path, _times(), samples, KEYS, head)


@pytest.mark.parametrize("head", HEADS.values(), ids=HEADS)
def test_an_input_follows(tmp_path: Path, head: str) -> None:
    """Response and input are cut alike, also where the file has a gap outside."""
    times = _times()
    times[501:] += 0.003
    force = np.sin(20.0 * times)
    columns = np.column_stack([times, decay(), force]).tolist()
    rows = [f"{t:.6f},{x!r},{f!r}" for t, x, f in columns]
    toml = 'name = "rig"\nmass_kg = 0.5\nstop = false\n[[recording]]\nfile = "a.csv"\n' + KEYS
    toml += 'input = { column = "force_N", kind = "force_N" }\n'
    text = "\n".join([f"{head},force_N", *rows]) + "\n"
    (recording,) = bi.load(write(tmp_path, toml, a=text, b=None)).recordings
    assert recording.input is not None
    np.testing.assert_allclose(recording.input.samples, force[50:501], rtol=1e-11)


def test_resampling_ends_where_time_does_not_go_on(tmp_path: Path) -> None:
    times = _times() + np.random.default_rng(0).uniform(-4e-4, 4e-4, 600)
    times = np.round(times + 0.001, 4)
    times[550:] = times[:50]  # the logger began anew
    keys = KEYS.replace("0.1", "0.15") + "resample = true\n"  # what is used comes once only
    (recording,) = _campaign(tmp_path, times, decay(), keys, HEADS["of its own kind"]).recordings
    assert recording.used is None and recording.start == pytest.approx(0.15, abs=2e-3)
    with pytest.raises(InputError, match="line 552: found time that does not increase"):
        _campaign(tmp_path, times, decay(), "resample = true\n", HEADS["of its own kind"])


def test_positions() -> None:
    times = np.array([0.0, 1.0, 2.0, np.nan, 4.0])
    assert window(times, 5, 1.0, 2.0) == window((1.0, 0.0), 5, 1.0, 2.0) == (1, 3)
    assert window(times, 5, None, None) == (0, 5)
    assert window(times, 5, 1.5, 2.0) == (0, 5)  # one sample is none
    assert unbroken(times, np.zeros(5), 1, 3) == (0, 3)
    assert unbroken(np.array([1.0, 0.0, 1.0, 2.0, 2.0, 3.0]), np.zeros(6), 2, 4) == (1, 4)
