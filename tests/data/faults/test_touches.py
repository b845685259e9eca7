"""Touches of a stop that are no fault of a recording."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayesimpact.data.faults.find import recording_faults
from bayesimpact.data.recording import Recording


def chatter(seed: int) -> np.ndarray:
    """An acceleration, m/s2, with three brief contacts a period and flights between them."""
    t = np.arange(6000) * 2.5e-4
    x = 9.0 * np.exp(-0.4 * t) * np.cos(2 * np.pi * 6.0 * t)
    for start in np.arange(330, 5600, 667):
        for k in range(3):
            first = start + 11 * k
            x[first : first + 8] -= 18.0 * np.sin(np.pi * (np.arange(8) + 0.5) / 8)
    return np.asarray(x + 0.02 * np.random.default_rng(seed).standard_normal(t.size))


@pytest.mark.parametrize("seed", range(3))
def test_flights_between_brief_contacts_are_no_spikes(seed: int) -> None:
    """But what lies above them is one."""
    x = chatter(seed)
    recording = Recording("a", "1", x, 2.5e-4, quantity="acceleration")
    assert "recording_spikes" not in {f.id for f in recording_faults(recording)}
    x[2900] += 25.0
    found = recording_faults(replace(recording, samples=x))
    spikes = [f for f in found if f.id == "recording_spikes"]
    assert [f.spans for f in spikes] == [((2900, 2901),)]


def rebounds(seed: int) -> np.ndarray:
    """A velocity, m/s, of which an obstacle's mass takes a part at every contact onset."""
    t = np.arange(6000) * 5e-4
    x = 0.2 * np.exp(-0.2 * t) * np.cos(2 * np.pi * 7.0 * t)
    for touch in (551, 837):
        x[touch:] *= 0.97
    return np.asarray(x + 2e-5 * np.random.default_rng(seed).standard_normal(t.size))


@pytest.mark.parametrize("seed", range(3))
def test_touches_of_an_obstacle_with_a_mass_are_no_slips(seed: int) -> None:
    """A velocity towards the stop becomes less; without a stop samples were lost."""
    x = rebounds(seed)
    for case, slips in (("1", False), ("", True)):
        recording = Recording("a", case, x, 5e-4, quantity="velocity")
        assert any(f.id == "recording_slip" for f in recording_faults(recording)) is slips
