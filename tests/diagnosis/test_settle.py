"""What is put in the place of an effect."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from effect_rigs import BY_ID
from made_up_models import Table

from bayesimpact.diagnosis.refit import Candidate
from bayesimpact.diagnosis.scan import Scan
from bayesimpact.diagnosis.settle import Settling

FRICTION, DRAG, SPRING = "coulomb_friction", "quadratic_drag", "spring_cubic"
HYSTERESIS = "hysteresis_bouc_wen"


def model(ids: str, chi2: float) -> Candidate:
    fit: Any = SimpleNamespace(reduced_chi2=chi2, converged=True, log_likelihood=0.0)
    return Candidate(tuple(BY_ID[i] for i in ids.split()), fit, 0.0)


@pytest.mark.parametrize("base", [400.0, 4.0])
def test_laws_that_are_asked_for_take_the_place_where_scores_see_nothing_of_them(base) -> None:
    """Where the misfit was large the model without either law may stand in a side minimum."""
    search: Any = Settling((), None, np.random.default_rng(0), lambda words: None)
    search.states = {frozenset(): SimpleNamespace(candidate=model("", base))}
    search.asked = SimpleNamespace(seen={DRAG}, first=lambda rest, about: {DRAG, HYSTERESIS})
    gains = {HYSTERESIS: 100.0, SPRING: 90.0, DRAG: 0.0}
    scores = tuple(Table.score(BY_ID[i], gain) for i, gain in gains.items())
    search.drop = lambda chosen, effect: model(FRICTION, 3.9)
    search.simplified = lambda chosen, effect: []
    search.scanned = lambda rest, effects: Scan(scores, 1e-6, None, (), ())
    fitted, in_place = [], []
    search.fit_one = lambda rest, found, score, rival: fitted.append(score.effect.id)
    search.exchange_in_place = lambda chosen, old, new: in_place.append((old.id, new.id))
    search.exchange(model(f"{FRICTION} {HYSTERESIS}", 1.0))
    assert SPRING in fitted and DRAG not in fitted
    assert ((HYSTERESIS, DRAG) in in_place) == (base > 9.0)
