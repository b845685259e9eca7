"""Crossings, extremes and the noise level from local polynomials."""

from __future__ import annotations

import numpy as np
import pytest

from bayesimpact.response import local


def sine(n: int, period: float, phase: float = 0.3) -> np.ndarray:
    return np.sin(2 * np.pi * np.arange(n) / period + phase)


@pytest.mark.parametrize("sigma", [1e-4, 1e-3, 1e-2])
@pytest.mark.parametrize("period", [24.0, 157.0, 3000.0])
def test_noise_level_of_white_noise(sigma: float, period: float) -> None:
    n = int(40 * period)
    samples = sine(n, period) + sigma * np.random.default_rng(1).standard_normal(n)
    # A median absolute value of n correlated differences: sd about 2 / sqrt(n).
    assert local.noise_level(samples, period) == pytest.approx(sigma, rel=8 / np.sqrt(n) + 0.02)


def test_noise_level_sees_smoothed_noise() -> None:
    rng = np.random.default_rng(2)
    noise = np.convolve(rng.standard_normal(8000), np.full(5, 0.2), "same")
    samples = sine(8000, 160.0) + 1e-3 * noise
    differences = np.median(np.abs(np.diff(samples, 6))) / 0.6745 / np.sqrt(924)
    assert differences < 0.35e-3 * noise.std()
    # A local quartic follows the slow part of it, about half.
    assert 0.4e-3 * noise.std() < local.noise_level(samples, 160.0) < 1e-3 * noise.std()


def test_noise_level_of_a_rounded_signal_is_its_rounding_noise() -> None:
    """Also where most differences are zero, so that their median is."""
    step = 0.02
    samples = np.round(sine(20_000, 4000.0) / step) * step
    assert np.mean(np.diff(samples, 6) == 0) > 0.5
    assert local.noise_level(samples, 4000.0) == pytest.approx(step / np.sqrt(12), rel=0.2)


def test_fit_recovers_a_polynomial_also_at_the_ends() -> None:
    index = np.arange(50.0)
    coefficients, rms = local.fit(1 + 0.5 * index - 0.02 * index**2, np.array([0, 25, 49]), 6, 2)
    centres = np.array([6.0, 25.0, 43.0])
    assert coefficients[:, 0] == pytest.approx(1 + 0.5 * centres - 0.02 * centres**2, abs=1e-12)
    assert np.all(rms < 1e-12)


def test_crossings_of_a_clean_sine() -> None:
    period = 31.7
    samples = sine(700, period)
    exact = (np.arange(1, 40) * np.pi - 0.3) * period / (2 * np.pi)
    exact = exact[exact < 690]
    found = local.crossings(samples, exact.astype(np.intp), np.full(exact.size, 8.0), 0.0)
    assert np.abs(found - exact).max() < 1e-3  # cubic splines, 32 samples per period: (h^4) / 384


def test_a_wide_window_averages_the_noise_of_crossings() -> None:
    period, sigma = 400.0, 0.01
    n = int(period * 200)
    samples = sine(n, period) + sigma * np.random.default_rng(3).standard_normal(n)
    exact = (np.arange(1, 390) * np.pi - 0.3) * period / (2 * np.pi)
    found = local.crossings(samples, exact.astype(np.intp), np.full(exact.size, 40.0), sigma)
    slope = 2 * np.pi / period
    # The value of a cubic in the middle of w samples has 9/4 of the variance of their mean. The
    # widest window of the ladder below 40 is 2 x 35 + 1 or so.
    assert np.std(found - exact) == pytest.approx(1.5 * sigma / slope / np.sqrt(71), rel=0.2)


def test_windows_shrink_at_a_kink() -> None:
    """A straight line that bends at the crossing: a wide window would be off by much more."""
    index = np.arange(400.0) - 200.3
    samples = np.where(index > 3, index + 0.05 * (index - 3) ** 3, index) * 1e-3
    found = local.crossings(samples, np.array([200]), np.array([90.0]), 1e-6)
    assert found[0] == pytest.approx(200.3, abs=0.01)


def test_extremes_of_a_clean_and_of_a_noisy_sine() -> None:
    period = 157.0
    samples = 3.0 * sine(3000, period)
    turns = np.arange(1, 36) * np.pi - 0.5 * np.pi
    exact = (turns - 0.3) * period / (2 * np.pi)
    exact = exact[(exact > 80) & (exact < 2900)]
    first, last = (exact - 0.25 * period).astype(int), (exact + 0.25 * period).astype(int)
    sign = np.sign(np.sin(2 * np.pi * exact / period + 0.3)).astype(int)
    position, value = local.extremes(samples, first, last, sign, 0.0)
    assert np.abs(value * sign - 3.0).max() < 1e-6
    assert np.abs(position - exact).max() < 1e-2
    noisy = samples + 0.03 * np.random.default_rng(4).standard_normal(3000)
    position, value = local.extremes(noisy, first, last, sign, 0.03)
    # Quartic over about 45 of 78 samples: 3.5 / 45 of the variance of one sample.
    assert np.std(value * sign) < 0.03 * 0.45
    assert abs(np.mean(value * sign) - 3.0) < 0.03 * 0.3


def test_windows_that_hold_more_than_noise_are_skipped_alone() -> None:
    """Crossings and extremes are each what they would be alone, whatever the others' windows."""
    rng = np.random.default_rng(5)
    samples = sine(4000, 157.0) + 0.01 * rng.standard_normal(4000)
    samples[:2000] += 0.2 * np.sign(sine(2000, 9.0))  # nothing smooth passes there
    centres = np.flatnonzero(np.diff(np.signbit(samples)))
    caps = np.full(centres.size, 35.0)
    together = local.crossings(samples, centres, caps, 0.01)
    alone = [local.crossings(samples, c, caps[:1], 0.01)[0] for c in centres[:, None]]
    assert together == pytest.approx(np.array(alone), abs=1e-9)
    first, last = centres[:-1] + 1, centres[1:]
    sign = np.where(samples[first] > 0, 1, -1)
    position, value = local.extremes(samples, first, last, sign, 0.01)
    for k in range(first.size):
        one = slice(k, k + 1)
        own = local.extremes(samples, first[one], last[one], sign[one], 0.01)
        assert (position[k], value[k]) == pytest.approx((own[0][0], own[1][0]), abs=1e-9)


def test_a_spline_that_is_known_changes_nothing() -> None:
    samples = sine(700, 31.7)
    centres = np.flatnonzero(np.diff(np.signbit(samples)))
    caps, sign = np.full(centres.size, 8.0), np.where(samples[centres[:-1] + 1] > 0, 1, -1)
    spline = local.cubic(samples)
    known = local.crossings(samples, centres, caps, 0.0, spline)
    assert np.array_equal(known, local.crossings(samples, centres, caps, 0.0))
    turns = samples, centres[:-1] + 1, centres[1:], sign, 0.0
    assert np.array_equal(local.extremes(*turns, spline), local.extremes(*turns))
