"""Which effects deserve a refit in the place of another, and which can add nothing."""

from __future__ import annotations

import numpy as np
import pytest
from effect_rigs import BY_ID

from bayesimpact.diagnosis.candidates.promising import (
    NEAR_BEST,
    NEAR_MARGIN,
    in_place_of,
    is_redundant,
)
from bayesimpact.diagnosis.refits.refit import Candidate
from bayesimpact.diagnosis.score_test.scores import Score


def score(effect: str, gain: float) -> Score:
    none = np.zeros(0)
    return Score(BY_ID[effect], {}, 0.0, 1.0, none, none, 0.0, none, 1.0, gain, ())


def stand_ins(effect: str, large: bool = False, **gains: float) -> set[str]:
    scores = [score(e, g) for e, g in gains.items()]
    return {s.effect.id for s in in_place_of(BY_ID[effect], scores, large)}


def test_what_explains_less_than_half_cannot_stand_for_an_effect():
    half = NEAR_BEST * 1000.0 - NEAR_MARGIN
    near, far = half + 0.1, half - 0.1
    gains = {"spring_cubic": 1000.0, "spring_quintic": near, "spring_quadratic": far}
    assert stand_ins("spring_cubic", **gains) == {"spring_quintic"}


@pytest.mark.parametrize(
    ("effect", "other", "kept"),
    [
        ("spring_cubic", "pendulum_sine", True),  # of one family
        ("coulomb_friction", "pendulum_sine", False),
        ("contact_damping_speed", "contact_no_tension", True),  # both in contact
        ("stiffness_drift", "contact_no_tension", False),
        ("sensor_hum", "contact_no_tension", False),
        ("harmonic_forcing", "hunt_crossley", False),
        ("obstacle_mass", "adhesion", True),  # begins at another contact
        ("coulomb_friction", "hysteresis_bouc_wen", False),  # begins at the base model: has a score
        ("quadratic_drag", "power_damping", False),
    ],
)
def test_what_is_on_or_off_stands_for_its_family_or_for_the_contact(effect, other, kept):
    gains = {effect: 1000.0, other: 0.0}
    assert (other in stand_ins(effect, **gains)) == kept


def test_where_the_misfit_is_large_the_score_of_what_is_on_or_off_says_nothing():
    gains = {"coulomb_friction": 1000.0, "pendulum_sine": 2000.0}
    assert stand_ins("coulomb_friction", **gains) == {"pendulum_sine"}
    assert stand_ins("coulomb_friction", large=True, **gains) == set()


def test_an_effect_without_parameters_is_contained_in_what_refines_it():
    def model(effect: str) -> Candidate:
        return Candidate((BY_ID["spring_quadratic"], BY_ID[effect]), None, 0.0)  # type: ignore[arg-type]

    sine, free, mass = (
        BY_ID[i] for i in ("pendulum_sine", "pendulum_with_spring", "obstacle_mass")
    )
    assert is_redundant(model("pendulum_with_spring"), sine)
    assert is_redundant(model("pendulum_sine"), free)
    assert is_redundant(model("contact_no_tension"), mass)
    assert not is_redundant(model("quadratic_drag"), BY_ID["power_damping"])  # both have a size
    assert not is_redundant(model("spring_cubic"), sine)
