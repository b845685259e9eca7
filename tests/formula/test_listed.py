"""Terms that are called an effect of the catalogue are its law, and no other term is one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from effect_rigs import BY_ID

from bayesimpact.diagnosis.refits.size import force_along
from bayesimpact.formula.grammar import Term
from bayesimpact.formula.law import effect_of, starts_of
from bayesimpact.formula.library import library
from bayesimpact.formula.listed import LISTED, STAGES, listed_as
from bayesimpact.model.effects.effect import Scales
from bayesimpact.model.parameters import SLOTS

GAP = 2e-3
RNG = np.random.default_rng(4)
Y, W, T = RNG.uniform(-6e-3, 4e-3, 400), RNG.uniform(-0.3, 0.3, 400), RNG.uniform(0, 2, 400)
SLOT = np.zeros(len(SLOTS))
SLOT[[SLOTS.index(name) for name in ("g", "k1", "k2")]] = GAP, 1.0, 1.0


def terms() -> tuple[Term, ...]:
    scales = Scales(
        mass=0.5, stiffness=800.0, damping=0.1, contact_stiffness=5e3, contact_damping=2.0,
        amplitude=6e-3, speed=0.25, indentation=2e-3, impact_speed=0.2, duration=2.0,
        interval=1e-3, impacts=9, gap=GAP, cases=1, recordings=1, angle=False, reading=1e-2,
    )  # fmt: skip
    return library(scales, -6e-3, 4e-3)


def force(effect_id: str, values: Sequence[float], term: Term | None = None) -> np.ndarray:
    effect = BY_ID[effect_id] if term is None else effect_of(term, 1.0, 6e-3, 0.3, signed=True)
    assert effect.law is not None
    return force_along(effect.law, Y, W, T, values, SLOT)


def of_effect(effect_id: str, place: float) -> np.ndarray:
    """Of unit size, and of this place where it has one."""
    parameters = BY_ID[effect_id].parameters
    return force(effect_id, [1.0 if p.is_size else place for p in parameters])


def of_term(term: Term) -> np.ndarray:
    effect = effect_of(term, 1.0, 6e-3, 0.3, signed=True)
    start = {f"{effect.id}.size": 1.0, **starts_of(term)}
    values = [
        start[f"{effect.id}.{p.name}"] if p.fixed is None else p.fixed for p in effect.parameters
    ]
    return force("", values, term)


def is_proportional(one: np.ndarray, other: np.ndarray) -> bool:
    shared = float(one @ other) ** 2
    return shared > (1 - 1e-12) * float(one @ one) * float(other @ other) > 0.0


@pytest.mark.parametrize("effect_id", sorted({*LISTED.values(), *STAGES.values()}))
def test_a_listed_term_is_the_effect_s_law(effect_id: str) -> None:
    if effect_id == "coulomb_friction":  # the oscillator's own friction, no law of the path
        assert BY_ID[effect_id].law is None
        return
    named = [t for t in terms() if listed_as(t) == effect_id]
    assert named
    for term in named:
        assert is_proportional(of_term(term), of_effect(effect_id, term.place))


def test_no_other_term_is_one() -> None:
    whole = [t for t in terms() if listed_as(t) is None]
    assert len(whole) > 300
    ids = sorted(set(LISTED.values()) - {"coulomb_friction"})
    laws = {effect_id: of_effect(effect_id, 0.0) for effect_id in ids}
    for term in whole:
        own = of_term(term)
        assert not any(is_proportional(own, law) for law in laws.values()), term
