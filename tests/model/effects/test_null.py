"""At its null value every effect is the base model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from effect_rigs import BY_ID, TestRig, null_values

from bayesimpact.model.effects import EFFECTS
from bayesimpact.model.oscillator import build_oscillator

RIG = TestRig(duration=3.0)
PLAIN = TestRig(k2=(), duration=3.0)
EXACT = {"contact_damping_per_case", "gap_per_recording"}
# some have no size, and obstacle_mass reduces to contact_no_tension
OTHERS = [e for e in EFFECTS if e.has_size and e.id not in ("obstacle_mass", "adhesion")]
ALONE = {"contact_no_tension", "pendulum_sine", "hunt_crossley"}


@pytest.mark.parametrize("effect", OTHERS, ids=lambda e: e.id)
def test_null_is_the_base_model(effect):
    base = RIG.readings([], {})
    added = RIG.readings([effect], null_values(effect, RIG))
    bypassed = effect.id in EXACT or effect.observe is not None
    for a, b in zip(added, base, strict=True):
        assert np.abs(b).max() > 1e-3
        if bypassed:
            np.testing.assert_array_equal(a, b)
        else:
            np.testing.assert_allclose(a, b, rtol=0, atol=1e-13)


@pytest.mark.parametrize("effect", [e for e in OTHERS if not e.needs_stop], ids=lambda e: e.id)
def test_null_without_a_stop(effect):
    base = PLAIN.readings([], {})
    added = PLAIN.readings([effect], null_values(effect, PLAIN))
    for a, b in zip(added, base, strict=True):
        np.testing.assert_allclose(a, b, rtol=0, atol=5e-13)


@pytest.mark.parametrize(
    ("effect_id", "size", "shape", "slot", "share"),
    [
        ("power_damping", "coefficient", "exponent", "c1", 0.3),
        ("contact_second_stage", "stiffness", "depth", "k2", 0.1),
    ],
)
def test_where_a_shape_is_one_of_the_base_model_the_law_adds_to_a_parameter(
    effect_id, size, shape, slot, share
):
    effect, own = BY_ID[effect_id], getattr(RIG, slot)
    more = share * float(np.mean(own))
    larger = replace(RIG, **{slot: tuple(np.add(own, more)) if slot == "k2" else own + more})
    at = effect.parameter(shape).in_base
    added = RIG.readings([effect], {f"{effect_id}.{size}": more, f"{effect_id}.{shape}": at})
    for a, b in zip(added, larger.readings([], {}), strict=True):
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-9)


def test_what_has_no_null_has_no_size():
    assert {e.id for e in EFFECTS if not e.has_size} == ALONE


def test_no_effect_runs_in_the_exact_simulator():
    assert build_oscillator(RIG.campaign(), []).is_base
    assert not build_oscillator(RIG.campaign(), [BY_ID["coulomb_friction"]]).is_base


def test_a_massless_obstacle_is_one_that_cannot_pull():
    mass, none = BY_ID["obstacle_mass"], BY_ID["contact_no_tension"]
    massless = RIG.readings([mass], {"obstacle_mass.mass": 0.0})
    dry = RIG.readings([BY_ID["adhesion"]], {"adhesion.force": 0.0})
    for a, b, c in zip(massless, RIG.readings([none], {}), dry, strict=True):
        np.testing.assert_array_equal(a, b)
        np.testing.assert_array_equal(c, b)
    assert mass.prefer == BY_ID["adhesion"].prefer == none.id


def test_all_effects_at_once_at_their_nulls():
    """Together they must not disturb one another either."""
    values = {}
    for effect in OTHERS:
        values |= null_values(effect, RIG)
    base = RIG.readings([], {})
    for a, b in zip(RIG.readings(OTHERS, values), base, strict=True):
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-13)
