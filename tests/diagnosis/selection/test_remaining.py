"""What a search that was cut short is compared with at its end."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from effect_rigs import BY_ID
from made_up_evidence import COST, candidate, examined, selection
from made_up_models import Table

from bayesimpact.diagnosis.refits.refit import Candidate
from bayesimpact.diagnosis.score_test.scan import Scan
from bayesimpact.diagnosis.selection.remaining import Remaining, without_a_force

DRAG, FRICTION, SPRING = "quadratic_drag", "coulomb_friction", "spring_cubic"


@pytest.mark.parametrize("rivals", [(), (FRICTION,), (FRICTION, "structural_damping")])
def test_the_effect_that_scores_promise_most_of_takes_the_place(rivals: tuple[str, ...]) -> None:
    """Effects of the model itself do not count, however much they promise."""
    effects = tuple(BY_ID.values())
    search: Any = Remaining(effects, None, np.random.default_rng(0), lambda words: None)
    fit: Any = SimpleNamespace(reduced_chi2=2.0)
    chosen = Candidate((BY_ID[DRAG], BY_ID[SPRING]), fit, 0.0)
    rest = Candidate((BY_ID[SPRING],), fit, 0.0)
    gains = {DRAG: 900.0, **{name: 10.0 * (i + 1) for i, name in enumerate(rivals)}}
    scores = tuple(Table.score(BY_ID[name], gain) for name, gain in gains.items())
    search.drop = lambda candidate, effect: rest
    search.scanned = lambda candidate, effects: Scan(scores, 1e-6, None, (), ())
    fitted: list[Any] = []
    search.fit_one = lambda left, found, score, rival: fitted.append((left, score.effect.id))
    search.exchange_in_place = lambda model, old, new: fitted.append((old.id, new.id))
    search.likeliest_in_place(chosen, BY_ID[DRAG])
    best = rivals[-1:]
    assert fitted == [step for name in best for step in ((rest, name), (DRAG, name))]


@pytest.mark.parametrize("alone", [-3.0, 3.0])
def test_odds_are_those_that_the_model_was_chosen_by(alone: float) -> None:
    """Beside a force of time friction leads; by itself it is less likely than nothing, or leads."""
    chosen, drag = candidate(FRICTION, COST + alone), candidate(DRAG, COST - 6.0)
    beside: Any = SimpleNamespace(
        log_evidence_gain=lambda fit, evidence: 20.0 * (fit is chosen.fit)
    )
    found = replace(selection(examined(chosen), drag), beside=beside)
    likeliest_first = tuple(sorted(found.tried, key=found.log_odds, reverse=True))
    told = without_a_force(replace(found, tried=likeliest_first))
    assert (told.beside is beside) is (alone < 0.0)
    assert told.tried[0] is chosen
    odds = [told.log_odds(c) for c in told.tried]
    assert odds == sorted(odds, reverse=True)
