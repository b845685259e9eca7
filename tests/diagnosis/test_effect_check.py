"""The table of checks: the catalogue passes them, and every check can fail."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest
from effect_rigs import BY_ID

from bayesimpact.diagnosis.effect_check import check_effect
from bayesimpact.model.effects import EFFECTS, Effect, EffectParameter, Law
from bayesimpact.model.own_effects import load_effects

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "own_effect.py"


def failed(effect: Effect) -> set[str]:
    return {row.name for row in check_effect(effect) if row.result == "failed"}


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.id)
def test_the_catalogue_passes(effect):
    rows = check_effect(effect)
    assert len(rows) == 6 and not failed(effect), rows


def test_the_example_passes():
    (detent,) = load_effects(EXAMPLE)
    assert {row.result for row in check_effect(detent)} == {"passed"}


def test_energy_of_the_wrong_sign():
    drag = BY_ID["quadratic_drag"]
    assert failed(replace(drag, id="own", energy="conserves")) == {"sign of the energy"}
    spring = BY_ID["spring_cubic"]
    assert failed(replace(spring, id="own", energy="dissipates")) == {"sign of the energy"}
    assert not failed(replace(spring, id="own", energy="either"))


def step_force(y, v, d, t, z, touching, p, q):
    return p[0] if y < -p[1] else 0.0


def offset_force(y, v, d, t, z, touching, p, q):
    return p[0] + 1e-3


def root_force(y, v, d, t, z, touching, p, q):
    return math.log(p[0] - 0.1) * y


def rough_force(y, v, d, t, z, touching, p, q):
    return 1e-3 * math.floor(p[0] * 1e4) * y


def own(force, *more: EffectParameter) -> Effect:
    size = EffectParameter("size", "N", scale=lambda s: 0.1, lower=0.0)
    return Effect("own", "own", "own", "", "free", "either", "", (size, *more), Law(force))


def test_a_jump_that_no_step_ends_on():
    place = EffectParameter("place", "m", scale=lambda s: 2e-3, lower=0.0, null=None)
    assert "convergence of the steps" in failed(own(step_force, place))


def test_a_force_that_stays_at_its_null():
    assert failed(own(offset_force)) == {"limit at the null value"}


def test_a_force_that_is_not_finite():
    assert "finite over the prior" in failed(own(root_force))


def test_a_force_without_a_derivative():
    assert failed(own(rough_force)) == {"derivatives against differences"}
