"""Noise that is louder for a while, and what only looks like it."""

from __future__ import annotations

import numpy as np
import pytest

from bayesimpact.data.faults.noise import find_noise
from bayesimpact.data.recording import Recording


@pytest.mark.parametrize("burst", [5e-4, 3e-3])
def test_a_burst_louder_than_the_motion_is_noise_and_a_ring_down_is_none(burst: float) -> None:
    """The fast modes of an impact are as loud, where they are, as a burst would be."""
    rng = np.random.default_rng(0)
    t = np.arange(6000) * 1e-3
    motion = 1e-4 * np.cos(2 * np.pi * 6 * t) + 1e-6 * rng.standard_normal(t.size)
    loud = motion.copy()
    loud[2000:2500] += burst * rng.standard_normal(500)
    modes = sum(np.cos(2 * np.pi * f * t + f) for f in (47.0, 61.0, 83.0, 101.0))
    ring = np.exp(-t / 0.3) * (modes + 0.05 * rng.standard_normal(t.size))
    readings = {"loud": loud, "ring": ring + 1e-3 * rng.standard_normal(t.size)}
    found = {
        n: [f.id for f in find_noise(Recording("a", "", x, 1e-3))] for n, x in readings.items()
    }
    assert found == {"loud": ["recording_noise"], "ring": []}
