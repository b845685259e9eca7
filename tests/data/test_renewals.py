"""Rows that repeat because a probe was asked more often than it renews its reading."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from campaigns import csv, write

import bayesimpact as bi
from bayesimpact.data.renewals import renewed

HEAD = 'name = "rig"\nmass_kg = 0.5\nstop = false\n[[recording]]\nfile = "a.csv"\nresample = true\n'


def asked(
    ratio: float, seed: int, *, jitter: float = 0.01, step: float = 0.0, end: float = np.inf
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stamps of rows about 2 ms apart, what they hold, and the readings of the renewals between,
    `ratio` rows apart; in steps, and not beyond an end.
    """
    rng = np.random.default_rng(seed)
    times = (np.arange(900) + rng.uniform(-jitter, jitter, 900)) * 2e-3
    renewals = 2e-3 * (rng.uniform(-1.0, 0.0) + ratio * np.arange(900))
    y = np.exp(-0.8 * renewals) * np.cos(2 * np.pi * 9.0 * renewals)
    y = np.clip(y + 2e-4 * rng.standard_normal(y.size), -end, end)
    y = step * np.round(y / step) if step else y
    which = np.searchsorted(renewals, times, side="right") - 1
    return times, y[which], y[which[0] : which[-1] + 1]


@pytest.mark.parametrize("ratio", [1.21, 4 / 3, 1.5, 2.0, 2.37, 4.2])
@pytest.mark.parametrize("seed", range(3))
def test_a_beat_gives_the_readings_of_the_renewals(ratio: float, seed: int) -> None:
    times, samples, expected = asked(ratio, seed)
    found = renewed(times, samples)
    assert found is not None
    np.testing.assert_array_equal(found[0], expected)
    assert found[1] == pytest.approx(2e-3 * ratio, rel=1e-3)


@pytest.mark.parametrize("seed", range(4))
def test_numbers_that_repeat_by_themselves_are_kept(seed: int) -> None:
    """Steps, and an end of the range: a renewal may bring the number before again."""
    times, samples, expected = asked(4 / 3, seed, step=2e-3, end=0.7)
    found = renewed(times, samples)
    assert found is not None and abs(found[0].size - expected.size) <= 2
    size = min(found[0].size, expected.size)
    np.testing.assert_array_equal(found[0][:size], expected[:size])


@pytest.mark.parametrize("seed", range(40))
def test_no_beat_where_every_row_was_read(seed: int) -> None:
    """Fine and coarse steps, slow motions, rows lost or written twice here and there."""
    rng = np.random.default_rng(seed)
    times = (np.arange(900) + rng.uniform(-0.3, 0.3, 900)) * 2e-3
    y = np.exp(-0.8 * times) * np.cos(2 * np.pi * rng.uniform(1.0, 30.0) * times)
    y += 10 ** rng.uniform(-5, -1) * rng.standard_normal(y.size)
    step = 10 ** rng.uniform(-3, -0.5)
    assert renewed(times, step * np.round(y / step)) is None
    assert renewed(times, np.clip(y, -0.4, 0.4)) is None
    twice = np.where(rng.uniform(size=y.size) < rng.uniform(0.0, 0.5), np.roll(y, 1), y)
    assert renewed(times, twice) is None


def test_a_recording_is_read_so_and_says_so(tmp_path: Path) -> None:
    times, samples, expected = asked(4 / 3, 0)
    rows = [f"{t:.6f},{x:.6f}" for t, x in zip(times, samples, strict=True)]
    text = "\n".join(["time_s,displacement_m", *rows]) + "\n"
    campaign = bi.load(write(tmp_path / "rig", HEAD, a=text, b=None))
    (recording,) = campaign.recordings
    assert recording.samples.size == expected.size
    assert recording.interval == pytest.approx(2e-3 * 4 / 3, rel=1e-3)
    assert any("repeat the one before" in doubt for doubt in campaign.doubts)
    rated = HEAD + "sample_rate_hz = 500.0\n"
    stated = bi.load(write(tmp_path / "stated", rated, a=text, b=None))
    assert stated.recordings[0].samples.size == 900
    even = bi.load(write(tmp_path / "even", HEAD, a=csv(), b=None))
    assert not any("repeat" in doubt for doubt in even.doubts)
