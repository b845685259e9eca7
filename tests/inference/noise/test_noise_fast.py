"""The noise of decays that few samples a period show."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.stats import binom

from bayesimpact.data.recording import Recording
from bayesimpact.errors import InputError
from bayesimpact.inference.noise.estimate import unfiltered_noise
from bayesimpact.inference.noise.fast import UNTOLD, fast_noise, floor_noise
from bayesimpact.inference.noise.whitening import Noise

SIGMA, INTERVAL, COUNT = 1e-3, 0.05, 400


def decay(period: float, cubic: float = 0.0) -> np.ndarray:
    """A mass of 1 kg from 0.5 m, `period` samples a cycle, damped by 1 %; cubic, 1/m2, of k1."""
    rate = 2 * np.pi / (period * INTERVAL)

    def motion(t: float, x: np.ndarray) -> list[float]:
        return [x[1], -rate * rate * (x[0] + cubic * x[0] ** 3) - 0.02 * rate * x[1]]

    times = INTERVAL * np.arange(COUNT)
    found = solve_ivp(motion, (0.0, times[-1]), [0.5, 0.0], t_eval=times, rtol=1e-10, atol=1e-12)
    return np.asarray(found.y[0])


def recordings(clean: np.ndarray, correlation: float, seed: int) -> list[Recording]:
    rng, noise = np.random.default_rng(seed), Noise(correlation)
    return [
        Recording(n, "", clean + noise.coloured(rng, COUNT, INTERVAL, SIGMA), INTERVAL)
        for n in "ab"
    ]


@pytest.mark.parametrize("cubic", [0.0, 0.5])
@pytest.mark.parametrize("period", [7.0, 12.0])
@pytest.mark.parametrize("correlation", [0.0, 0.5])
def test_the_spectrum_above_the_motion_tells_level_and_colour(
    period: float, cubic: float, correlation: float
) -> None:
    """Windows of twelve samples hold a period and more: their remainders are motion."""
    clean = decay(period, cubic)
    found = [unfiltered_noise(recordings(clean, correlation, seed)) for seed in range(8)]
    assert {n.source for n in found} == {"spectrum above the motion"}
    # what a law makes of the motion may fill it; of coloured noise it sees a part only
    assert all(n.is_bound is (n.correlation == 0.0) for n in found)
    ratios = np.array([n.level / SIGMA for n in found])
    if not correlation:
        error = np.mean([n.level_error for n in found])
        assert abs(ratios.mean() - 1.0) < 4 * error / np.sqrt(8) + 0.05 * bool(cubic)
    # of coloured noise it sees what is faster than the motion, and errs to less and to whiter
    assert np.all((ratios > 0.5) & (ratios < 1.5))
    assert np.all([-0.3 < n.correlation < correlation + 0.2 for n in found])


def test_white_noise_is_seldom_called_coloured() -> None:
    clean, count = decay(12.0), 400
    calls = 0
    for seed in range(count):
        found = fast_noise(recordings(clean, 0.0, 1000 + seed), None)
        assert found is not None
        calls += found.correlation != 0.0
    assert calls <= binom.isf(1e-3, count, 0.01)


def test_polynomials_tell_the_noise_of_a_slow_motion() -> None:
    slow = recordings(decay(60.0), 0.0, 0)
    remainders = Noise(level=2 * SIGMA, level_error=0.01)
    assert fast_noise(slow, remainders) is remainders
    assert unfiltered_noise(slow).source == "polynomial remainders"


def test_of_two_bounds_the_lower_one_counts() -> None:
    fast = recordings(decay(12.0), 0.0, 0)
    low, high = Noise(level=0.5 * SIGMA), Noise(level=2 * SIGMA)
    assert fast_noise(fast, low) == low
    found = fast_noise(fast, high)
    assert found is not None and found.level == pytest.approx(SIGMA, rel=0.15)


@pytest.mark.parametrize("count", [97, 117])
def test_one_median_tells_the_level_where_there_are_hardly_any_bands(count: int) -> None:
    """Of windows of twelve samples, two periods, some level with any correlation is as likely."""
    clean = 1.2 * np.exp(-0.03 * np.arange(count)) * np.cos(np.arange(count) + 1.0)
    ratios, errors = [], []
    for seed in range(30):
        noise = 0.04 * np.random.default_rng(seed).standard_normal(count)
        found = unfiltered_noise([Recording("a", "", clean + noise, INTERVAL)])
        assert found.is_bound and found.correlation == 0.0 and found.level_error < UNTOLD
        ratios.append(found.level / 0.04)
        errors.append(found.level_error)
    ratio, error = np.array(ratios), float(np.mean(errors))
    assert ratio.mean() == pytest.approx(1.0, abs=4 * error / np.sqrt(30) + 0.05)
    # remainders count up to three errors above, if they are no higher
    assert np.all((ratio > 1.0 - 3 * error) & (ratio < 1.0 + 5 * error))


def test_noise_whose_windows_tell_no_level_counts_as_white() -> None:
    """At the end of the correlation's range a level of many times the noise's is as likely."""
    clean = 1.2 * np.cos(2 * np.pi * np.arange(200) / 60.0 + 1.0)
    for seed in range(12):
        noise = Noise(0.5).coloured(np.random.default_rng(seed), 200, INTERVAL, 0.04)
        found = unfiltered_noise([Recording("a", "", clean + noise, INTERVAL)])
        assert found.level_error < UNTOLD
        assert 0.5 < found.level / 0.04 < 1.5


def test_of_a_recording_with_gaps_the_longest_stretch_tells() -> None:
    """Spikes that were set aside: bridged readings are none of the motion's."""
    whole = recordings(decay(12.0), 0.0, 3)
    used = np.ones(COUNT, dtype=bool)
    used[[40, 41, 42]] = False
    spoilt = [replace(r, samples=np.where(used, r.samples, 0.0), used=used) for r in whole]
    found = unfiltered_noise(spoilt)
    assert found.source == "spectrum above the motion"
    assert found.level == pytest.approx(unfiltered_noise(whole).level, rel=0.15)


def test_readings_without_rows_of_samples_are_refused_in_true_words() -> None:
    used = np.arange(COUNT) % 4 != 0
    samples = np.where(used, decay(60.0), 0.0)
    gappy = [Recording("a", "", samples, INTERVAL, used=used)]
    with pytest.raises(InputError, match="12 samples in a row among 400"):
        unfiltered_noise(gappy)


def test_the_end_of_a_spectrum_tells_noise_that_windows_do_not() -> None:
    """A velocity whose slope jumps eight times a period, as between damped stops on either side."""
    t = np.arange(5000) / 5000.0
    moved = 50 * SIGMA * np.abs((60.0 * t * 8) % 2 - 1) * np.exp(-t)
    noise = SIGMA * np.random.default_rng(4).standard_normal((4, t.size))
    rows = [
        Recording(f"r{i}", "1", moved + x, 2e-4, quantity="velocity") for i, x in enumerate(noise)
    ]
    found = floor_noise(rows, Noise(0.98, level=10 * SIGMA, level_error=9.0))
    assert found is not None and found.is_bound and found.correlation == 0.0
    assert found.level == pytest.approx(SIGMA, abs=4 * found.level_error * SIGMA)
    assert found.level_error < 0.05
    for known in (
        Noise(level=10 * SIGMA, level_error=0.1),
        Noise(level=0.1 * SIGMA, level_error=9.0),
    ):
        assert floor_noise(rows, known) is known
