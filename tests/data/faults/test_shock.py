"""A hammer that still strikes at the first readings is told from all that a free motion does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import savgol_filter

from bayesimpact.data.faults.find import recording_faults
from bayesimpact.data.faults.shock import find_shock
from bayesimpact.data.recording import Recording

RATE = 1280.0
T = np.arange(2000) / RATE


def modes(*given: tuple[float, float, float]) -> np.ndarray:
    """Sizes, frequencies and decays of modes that ring down."""
    parts = [a * np.exp(-r * T) * np.sin(2 * np.pi * f * T + a) for a, f, r in given]
    return np.sum(parts, axis=0)


THREE = (4.0, 212.0, 1.2), (0.7, 579.0, 7.0), (0.15, 34.0, 0.04)


def recording(samples: np.ndarray, noise: float = 5e-3, seed: int = 0) -> Recording:
    x = samples + noise * np.random.default_rng(seed).standard_normal(samples.size)
    return Recording("a", "", x, 1 / RATE, quantity="acceleration")


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("count", [2, 4])
def test_readings_under_a_blow_are_cut(count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    struck = modes(*THREE)
    struck[:count] += rng.choice([-1.0, 1.0], count) * rng.uniform(1.5, 4.0, count)
    found = recording_faults(recording(struck, seed=seed))
    (start,) = (f for f in found if f.id == "recording_start")
    assert start.action == "cut" and start.spans == ((0, count),)
    assert "not yet free" in start.statement


@pytest.mark.parametrize("seed", range(30))
def test_modes_that_ring_down_are_free(seed: int) -> None:
    """Up to four, from 20 to 600 Hz, the fastest gone within a tenth of the recording."""
    rng = np.random.default_rng(seed)
    given = [
        (10 ** rng.uniform(-1, 0.5), 10 ** rng.uniform(1.3, 2.75), 10 ** rng.uniform(-1, 1.2))
        for _ in range(rng.integers(1, 5))
    ]
    for noise in (1e-4, 1e-2, 0.3):
        assert not find_shock(recording(modes(*given), noise, seed))
        slow = recording(modes(*((a, 0.05 * f, 0.1 * r) for a, f, r in given)), noise, seed)
        smooth = replace(slow, samples=savgol_filter(slow.samples, 21, 2))
        assert not find_shock(slow) and not find_shock(smooth)


def test_a_blow_beside_a_stop_is_left_to_the_stop() -> None:
    struck = modes(*THREE)
    struck[:3] += 4.0
    assert find_shock(recording(struck))
    assert not find_shock(replace(recording(struck), case="1"))
