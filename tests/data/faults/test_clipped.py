"""Clipping behind an uneven clock, and at an end of the range that is not sharp."""

from __future__ import annotations

import numpy as np
import pytest

from bayesimpact.data.even_clock import on_even_clock
from bayesimpact.data.faults.clipped import find_clipped
from bayesimpact.data.faults.fault import Fault
from bayesimpact.data.recording import Recording

LIMIT = 0.55


def decay(t: np.ndarray) -> np.ndarray:
    """One period a second."""
    return np.exp(-0.15 * t) * np.cos(2 * np.pi * t + 1.0)


def marked(faults: list[Fault], size: int) -> np.ndarray:
    """Which samples the faults name, (size,)."""
    found = np.zeros(size, bool)
    for first, end in (span for fault in faults for span in fault.spans):
        found[first:end] = True
    return found


@pytest.mark.parametrize("seed", range(4))
def test_a_spline_through_clipped_readings_hides_nothing(seed: int) -> None:
    """Values between readings stay within the range, and what was cut is found as before."""
    rng = np.random.default_rng(seed)
    times = (np.arange(260) + rng.uniform(-0.2, 0.2, 260)) / 26
    samples = np.clip(decay(times), -LIMIT, LIMIT)
    even = on_even_clock("a.csv", times, samples, np.arange(260))
    assert even.interval == pytest.approx(1 / 26, rel=2e-3)
    assert np.abs(even.samples).max() == LIMIT
    exact = decay(times[0] + even.interval * np.arange(even.samples.size))
    cut = np.convolve(np.abs(exact) > LIMIT, np.ones(5), "same") > 0
    assert np.abs(even.samples - exact)[~cut].max() < 0.02
    faults = find_clipped(Recording("a", "", even.samples, even.interval))
    assert [f.size for f in faults] == [LIMIT, -LIMIT]
    found = marked(faults, even.samples.size)
    assert found[np.abs(exact) > 1.1 * LIMIT].all() and not found[~cut].any()


def test_an_uneven_clock_alone_changes_no_turning_point() -> None:
    """Sixty readings a period: those next to a peak are within half a per cent of it."""
    times = (np.arange(600) + np.random.default_rng(0).uniform(-0.2, 0.2, 600)) / 60
    even = on_even_clock("a.csv", times, decay(times), np.arange(600))
    exact = decay(times[0] + even.interval * np.arange(even.samples.size))
    assert np.abs(even.samples - exact).max() < 2e-5


def test_half_cycles_cut_a_little_short_of_the_end_are_found_beside_one_at_it() -> None:
    """A sensor that settles towards the end of its range reaches it in the longest stay alone."""
    t = np.arange(260) / 26
    x = decay(t)
    soft = LIMIT * (1.0 - 0.003 * np.exp(-(np.abs(x) - LIMIT) / 0.1))
    soft = np.where(np.abs(x) > 0.8, LIMIT, soft)
    samples = np.where(np.abs(x) > LIMIT, np.sign(x) * soft, x)
    hidden = np.abs(x) > 1.05 * LIMIT
    found = marked(find_clipped(Recording("a", "", samples, 1 / 26)), t.size)
    assert found[hidden].all()
    assert not found[np.abs(x) < 0.95 * LIMIT].any()
