"""Where the mass turns: friction makes an acceleration jump there, and readings repeat."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from bayesimpact.data.faults.held import find_held
from bayesimpact.data.faults.slip import find_slips
from bayesimpact.data.recording import Recording


@pytest.mark.parametrize("turns, found", [(0.0, False), (0.25, True)])
def test_an_acceleration_that_friction_makes_jump_has_lost_no_samples(turns, found) -> None:
    """It jumps where the mass turns; where that moves fast, samples are lost."""
    t = np.arange(4000) * 1e-3 - 0.5 + turns / 7.0
    jumps = np.where(t < turns / 7.0, 1.08, 1.0) * np.cos(2 * np.pi * 7.0 * t)
    jumps += np.where(t < turns / 7.0, 0.1, 0.0)
    noise = 2e-3 * np.random.default_rng(1).standard_normal(t.size)
    recording = Recording("a", "", jumps + noise, 1e-3)
    assert [f.id for f in find_slips(recording)] == ["recording_slip"]
    acceleration = replace(recording, quantity="acceleration")
    assert bool(find_slips(acceleration)) is found


def test_readings_that_repeat_where_the_mass_turns_are_not_held() -> None:
    """Correlated noise of two steps: rare over the recording, no wonder at a turning point."""
    t, step = np.arange(5000) * 2.5e-3, 5e-7
    for seed in range(40):
        white = 6e-7 * np.random.default_rng(seed).standard_normal(t.size)
        free_decay = 1.4e-3 * np.exp(-0.02 * t) * np.cos(2 * np.pi * 1.1 * t)
        samples = np.round((free_decay + lfilter([1.0], [1.0, -0.9], white)) / step) * step
        assert find_held(Recording("a", "", samples, 2.5e-3)) == []
        samples[2087:2095] = samples[2087]  # where it moves fast
        assert find_held(Recording("a", "", samples, 2.5e-3))
