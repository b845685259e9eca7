"""Readings that come in steps: what is read on average, and that a fit follows it."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from bayesimpact.data.recording import Recording
from bayesimpact.model.rounding import (
    LEAST,
    MOST,
    Rounding,
    coarse_step,
    likeliest_rounding,
    scatter,
)

STEP = 8e-4


def rounded(noise: float, seed: int = 0, size: int = 200_000) -> tuple[np.ndarray, np.ndarray]:
    """A motion over many steps and its readings, noise in steps ahead of rounding."""
    motion = np.linspace(-40.0, 40.0, size) * STEP
    drawn = noise * STEP * np.random.default_rng(seed).standard_normal(size)
    return motion, STEP * np.round((motion + drawn) / STEP)


def recorded(samples: np.ndarray) -> Recording:
    return Recording("a", "", samples, 0.01, quantity="angle")


@pytest.mark.parametrize("noise", [LEAST, 0.2, MOST])
def test_the_average_is_that_of_all_readings(noise):
    """Sum over the steps, each with the chance that noise leads to it (mpmath)."""
    values = STEP * np.array([-7.5, -0.3, 0.0, 0.1, 0.49, 2.5, 11.25])
    rounding = Rounding(STEP, noise * STEP)

    def exactly(x):
        u, s = mpmath.mpf(x) / STEP, mpmath.mpf(noise)
        steps = range(int(mpmath.nint(u)) - 6, int(mpmath.nint(u)) + 7)
        chance = [mpmath.ncdf((n + 0.5 - u) / s) - mpmath.ncdf((n - 0.5 - u) / s) for n in steps]
        return STEP * mpmath.fsum(n * p for n, p in zip(steps, chance, strict=True))

    exact = [float(exactly(x)) for x in values]
    np.testing.assert_allclose(rounding.read(values), exact, atol=1e-6 * STEP)
    readings = values + 0.3 * STEP
    rise = 1e-4 * STEP
    up, down = (rounding.squares(values + r, readings) for r in (rise, -rise))
    told = -2.0 * (readings - np.array(exact))
    np.testing.assert_allclose((up - down) / (2 * rise), told, atol=1e-5 * STEP)


@pytest.mark.parametrize("noise", [0.16, 0.2, 0.3, 0.4])
def test_noise_ahead_of_the_steps_is_found_from_the_readings(noise):
    motion, readings = rounded(noise)
    level = float(np.std(readings - motion))
    recording = recorded(readings)
    assert coarse_step(recording, level) == pytest.approx(STEP)
    found = likeliest_rounding(STEP, motion, readings)
    assert found is not None and found.noise == pytest.approx(noise * STEP, rel=0.03)
    left = readings - found.read(motion)
    assert np.std(left) == pytest.approx(scatter(recording, level), rel=0.01)
    assert np.std(left) < level  # the average takes its share


def test_steps_that_are_fine_beside_the_noise_are_no_rounding():
    motion, readings = rounded(0.6)
    level = float(np.std(readings - motion))
    assert coarse_step(recorded(readings), level) == 0.0
    assert scatter(recorded(readings), level) == level
    assert likeliest_rounding(STEP, motion, readings) is None
    assert coarse_step(recorded(motion), 0.1 * STEP) == 0.0  # no steps


def test_a_model_that_misses_by_more_is_not_rounded():
    """Its readings show no average: nor does one that is half a step off show the other sign."""
    motion, readings = rounded(0.2)
    for seen in (1.05 * motion, motion + 0.5 * STEP):
        assert likeliest_rounding(STEP, seen, readings) is None
