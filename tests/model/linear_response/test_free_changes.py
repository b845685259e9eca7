"""Free changes of a motion that brief touches stretch, and forces superposed from them."""

from __future__ import annotations

import numpy as np
import pytest
from effect_rigs import BY_ID, TestRig, typical

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.input import Input
from bayesimpact.data.recording import Recording
from bayesimpact.model.linear_response.free_changes import PARALLEL, motions_beside
from bayesimpact.model.linear_response.superposition import Motion, answers, motion_along
from bayesimpact.model.oscillator import Oscillator, build_oscillator

RATE, END, MASS = 2000.0, 8.0, 0.396
REACH = 6e-3
TRUTH = {"k1": 696.5, "c1": 0.143, "g": 1.483e-3, "c2": 0.674, "k2[1]": 4792.0, "y0[a]": -1e-5}


@pytest.fixture(scope="module")
def rig() -> tuple[Oscillator, np.ndarray]:
    """Under a sweep from above that touches the stop lightly, then deeper: oscillator and slots."""
    t = np.arange(0.0, END, 1 / RATE)
    force = Input(0.587 * np.sin(2 * np.pi * (13.34 * t + 0.5 * (4.0 - 13.34) * t**2 / END)))
    recording = Recording("a", "1", np.zeros(t.size), 1 / RATE, input=force)
    oscillator = build_oscillator(Campaign("sweep", MASS, (recording,)))
    theta = np.array([TRUTH.get(name, 0.0) for name in oscillator.layout.names])
    return oscillator, oscillator.layout.slots(theta)[0]


@pytest.fixture(scope="module")
def motion(rig: tuple[Oscillator, np.ndarray]) -> Motion:
    return motion_along(rig[0], 0, rig[1], REACH)


@pytest.mark.parametrize("at", [1.0, 4.3, 4.7, 5.5, 6.5, 7.2])
def test_a_blip_of_force_moves_the_motion_as_a_simulation_with_it(
    rig: tuple[Oscillator, np.ndarray], motion: Motion, at: float
) -> None:
    """Before, among and after the touches; of 1 % of the largest answer."""
    oscillator, slots = rig
    blip = np.exp(-(((motion.t[:: motion.factor] - at) / 0.02) ** 2))
    fine = np.interp(motion.t, motion.t[:: motion.factor], blip)
    told = answers(motion, fine[None])[0]
    size = 1e-6
    waves = np.stack([size * blip, np.zeros_like(blip)])
    there, base = motions_beside(oscillator, 0, np.tile(slots, (2, 1)), 0, waves=waves)
    exact = (base - there) / size  # laws stand on the left-hand side
    assert np.max(np.abs(exact)) > 1e-4
    assert np.max(np.abs(told - exact)) < 0.01 * np.max(np.abs(exact))


def test_changes_stay_apart(motion: Motion) -> None:
    """From stretch to stretch, each of which begins where the one before it ends."""
    parts = motion.changes.stretches
    for part in parts:
        assert np.mean(part.sine > PARALLEL) > 0.9
    joined = [a.begin + a.readings.shape[0] - 1 for a in parts[:-1]]
    assert parts[0].begin == 0 and len(parts) > 2
    assert joined == [b.begin for b in parts[1:]]


@pytest.mark.parametrize("law", ["hysteresis_bouc_wen", "base_motion", "second_mode"])
def test_laws_that_remember_and_bodies_answer_too(law: str) -> None:
    """A state begun anew would move what they are counted from; of 5 % of the largest answer."""
    rig = TestRig(duration=3.0, c1=0.6)
    oscillator = build_oscillator(rig.campaign(), [BY_ID[law]])
    slots = oscillator.layout.slots(rig.theta(oscillator, typical(BY_ID[law], rig, 0.3)))[0]
    motion = motion_along(oscillator, 0, slots, REACH)
    samples = motion.t[:: motion.factor]
    blip = np.exp(-(((samples - 1.5) / 0.02) ** 2))
    told = answers(motion, np.interp(motion.t, samples, blip)[None])[0]
    waves = 1e-6 * np.stack([blip, np.zeros_like(blip)])
    there, base = motions_beside(oscillator, 0, np.tile(slots, (2, 1)), 0, waves=waves)
    exact = (base - there) / 1e-6
    assert np.max(np.abs(told - exact)) < 0.05 * np.max(np.abs(exact))
