"""Where a recording starts, from its first samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rigs import PAPER, paper_motion

from bayesimpact.inference.initial.release import RoughOscillator, release

RIG = RoughOscillator(**PAPER)
NOISE = 5e-6


def started(
    y0: float, v0: float, interval: float, seed: int, k2: float = RIG.k2
) -> tuple[float, float, float, float]:
    samples = paper_motion(round(0.4 / interval), interval, y0=y0, v0=v0, k2=k2)
    noise = NOISE * np.random.default_rng(seed).standard_normal(samples.size)
    return release(samples + noise, interval, replace(RIG, k2=k2), NOISE)


@pytest.mark.parametrize("interval", [1e-3, 5e-3])
@pytest.mark.parametrize(
    ("y0", "v0"),
    [
        (-6.5e-3, 0.0),  # as in the paper
        (-2e-3, -0.15),  # on its way out
        (0.9e-3, 0.2),  # about to touch
        (1.08e-3, 0.05),
        (2.5e-3, 0.0),  # on the stop
        (1.2e-3, -0.2),  # about to leave it
        (1.105e-3, 0.3),  # just touched
    ],
)
def test_within_its_errors(y0: float, v0: float, interval: float) -> None:
    found = np.array([started(y0, v0, interval, seed) for seed in range(6)])
    assert np.abs((found[:, 0] - y0) / found[:, 2]).max() < 4.5
    assert np.abs((found[:, 1] - v0) / found[:, 3]).max() < 4.5
    # Better than one sample, and than what 1 % of the speed would be.
    assert np.all(found[:, 2] < 1.05 * NOISE)
    assert np.all(found[:, 3] < 3e-3)


@pytest.mark.parametrize(("y0", "v0"), [(1.6e-3, 0.0), (1.0e-3, 0.2), (1.2e-3, 0.15)])
def test_on_a_hard_stop_that_lets_go_between_two_samples(y0: float, v0: float) -> None:
    """Contact takes 7 ms, a sample 5 ms: nothing can be read off the first ones alone."""
    found = np.array([started(y0, v0, 5e-3, seed, k2=1e5) for seed in range(6)])
    assert np.abs(found[:, 0] - y0).max() < 4.5 * NOISE
    assert np.abs(found[:, 1] - v0).max() < 0.01


def test_without_a_stop() -> None:
    free = RoughOscillator(PAPER["mass"], PAPER["c1"], PAPER["k1"], 0.0, np.inf, 0.0)
    samples = paper_motion(400, k2=0.0, c2=0.0, g=1.0, y0=3e-3, v0=0.1)
    y0, v0, sd_y0, sd_v0 = release(samples, 1e-3, free, NOISE)
    assert y0 == pytest.approx(3e-3, abs=1e-9)
    assert v0 == pytest.approx(0.1, abs=1e-7)
    assert 0 < sd_y0 < NOISE
    assert 0 < sd_v0 < 1e-3


def test_a_motion_that_creeps_back_without_a_swing() -> None:
    """Strongly damped: its two rates lie orders of magnitude apart."""
    creeping = RoughOscillator(PAPER["mass"], 4e4, PAPER["k1"], 0.0, np.inf, 0.0)
    b = creeping.c1 / (2 * creeping.mass)
    slow = b - np.sqrt(b**2 - creeping.k1 / creeping.mass)
    t = np.arange(4000) * 1e-3
    with np.errstate(all="raise", under="ignore"):
        y0, _, sd, _ = release(-4e-3 * np.exp(-slow * t), 1e-3, creeping, 1e-6)
    assert y0 == pytest.approx(-4e-3, abs=5 * sd)
