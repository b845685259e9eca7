"""The compiled simulator against two independent ones, for every effect and for several at once."""

from __future__ import annotations

import numpy as np
import pytest
from effect_rigs import BY_ID, MOVING, TestRig, by_hand, by_rig, moved, typical

TOLERANCE = 1e-9  # m
RELATIVE = 5e-8  # of the release height, where that is more (the heavy rig swings by 60 and 100 mm)
PAPER = TestRig(duration=0.5)
SLOW = TestRig(duration=1.5, rate=200.0)
OTHERS = {
    "paper, long": TestRig(duration=2.0),
    "stiff": TestRig(
        mass=0.02, c1=0.05, k1=5000.0, c2=1.0, g=2e-4, k2=(2e5, 6e4), y0=(-1e-3, -8e-4),
        v0=(0.0, 0.3), rate=5000.0, duration=0.12,
    ),
    "heavy": TestRig(
        mass=40.0, c1=20.0, k1=3000.0, c2=300.0, g=0.02, k2=(40000.0, 9000.0), y0=(-0.1, -0.06),
        v0=(0.0, -0.2), rate=50.0, duration=6.0,
    ),
    "pressed against the stop": TestRig(g=-4e-4, duration=1.0),
    "overdamped stop": TestRig(c2=200.0, duration=1.0),
    "starts in contact": TestRig(y0=(2.5e-3, 3e-3), v0=(0.1, -0.2), duration=1.0),
}  # fmt: skip
COMBINATIONS = (
    ("coulomb_friction", "obstacle_mass"),
    ("coulomb_friction", "quadratic_drag"),
    ("contact_relaxation", "contact_no_tension"),
    ("contact_power_law", "gap_wear"),
    ("contact_second_stage", "opposite_stop", "coulomb_friction"),
    ("contact_stiffness_drift", "obstacle_mass", "quadratic_drag"),
    ("harmonic_forcing", "coulomb_friction", "contact_damping_speed"),
    ("stiffness_drift", "contact_hardening", "gap_per_recording"),
    ("obstacle_mass", "contact_damping_indentation", "gap_wear", "spring_quadratic"),
    ("contact_relaxation", "contact_damping_per_case", "spring_cubic", "quadratic_drag"),
    ("structural_damping", "obstacle_mass", "contact_relaxation"),
    ("power_damping", "spring_quintic", "contact_power_law"),
    ("structural_damping", "coulomb_friction", "harmonic_forcing"),
    ("hysteresis_bouc_wen", "contact_relaxation", "structural_damping"),
    ("presliding_friction", "hunt_crossley", "spring_piecewise", "gap_wear"),
    ("hysteresis_bouc_wen", "coulomb_friction", "harmonic_forcing"),
    ("adhesion", "obstacle_restitution", "contact_relaxation", "gap_wear"),
    ("adhesion", "obstacle_mass", "second_mode"),
    ("obstacle_restitution", "base_motion", "second_mode", "obstacle_mass"),
    ("second_mode", "contact_power_law"),
    ("second_mode", "coulomb_friction"),
    ("obstacle_mode", "base_motion", "contact_no_tension", "quadratic_drag"),
    ("second_mode", "obstacle_mode", "coulomb_friction", "gap_wear"),
    ("base_motion", "obstacle_mass", "second_mode", "spring_cubic"),
    ("second_mode", "obstacle_mass", "contact_relaxation", "coulomb_friction"),
    ("second_mode", "contact_second_stage", "harmonic_forcing", "gap_wear"),
)


def combined(names: tuple[str, ...], rig: TestRig) -> tuple[list, dict[str, float]]:
    effects = [BY_ID[name] for name in names]
    values: dict[str, float] = {}
    for effect in effects:
        values |= typical(effect, rig)
    return effects, values


@pytest.mark.parametrize("effect", MOVING, ids=lambda e: e.id)
def test_naive_twin(effect):
    values = typical(effect, PAPER)
    ours, theirs = moved([effect], values, PAPER), by_hand([effect], values, PAPER)
    assert np.abs(ours - theirs).max() < TOLERANCE
    # but of the first, of which this is the first case, and of pendulums, which hardly swing here
    if effect.id not in ("contact_damping_per_case", "pendulum_sine", "pendulum_with_spring"):
        assert np.abs(ours - moved([], {}, PAPER)).max() > 1e3 * TOLERANCE


@pytest.mark.long
@pytest.mark.parametrize("name", OTHERS)
@pytest.mark.parametrize("effect", MOVING, ids=lambda e: e.id)
def test_independent_rig(effect, name):
    rig = OTHERS[name]
    values = typical(effect, rig)
    for r in (0, 1):
        difference = moved([effect], values, rig, r) - by_rig([effect], values, rig, r)
        assert np.abs(difference).max() < max(TOLERANCE, RELATIVE * abs(rig.y0[r]))


@pytest.mark.long
@pytest.mark.parametrize("names", COMBINATIONS, ids="+".join)
def test_combinations(names):
    for rig in (OTHERS["paper, long"], SLOW):
        effects, values = combined(names, rig)
        difference = moved(effects, values, rig, 1) - by_rig(effects, values, rig, 1)
        assert np.abs(difference).max() < TOLERANCE


@pytest.mark.parametrize("names", COMBINATIONS[:4] + COMBINATIONS[9:21], ids="+".join)
def test_combinations_by_hand(names):
    effects, values = combined(names, PAPER)
    difference = moved(effects, values, PAPER) - by_hand(effects, values, PAPER)
    assert np.abs(difference).max() < TOLERANCE


@pytest.mark.parametrize("effect", [e for e in MOVING if not e.needs_stop], ids=lambda e: e.id)
def test_without_a_stop(effect):
    rig = TestRig(k2=(), duration=2.0)
    values = typical(effect, rig)
    difference = moved([effect], values, rig) - by_rig([effect], values, rig)
    assert np.abs(difference).max() < TOLERANCE


@pytest.mark.parametrize("effect", MOVING, ids=lambda e: e.id)
def test_the_sampling_does_not_matter(effect):
    """Samples inside long steps, at their ends and between short ones agree."""
    coarse, fine = TestRig(duration=1.2, rate=500.0), TestRig(duration=1.2, rate=4500.0)
    values = typical(effect, coarse)
    assert (
        np.abs(moved([effect], values, coarse) - moved([effect], values, fine)[::9]).max()
        < TOLERANCE
    )
