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
from bayesimpact.diagnosis.selection import remaining
from bayesimpact.diagnosis.selection.decision import Decision
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


@pytest.mark.parametrize("refused", [0, 1, 5])
def test_a_family_is_compared_with_what_may_stand_in_its_place(
    monkeypatch: pytest.MonkeyPatch, refused: int
) -> None:
    """All of it is left out, and what scores promise most of tried until it is no refused line."""
    search: Any = Remaining(tuple(BY_ID.values()), None, np.random.default_rng(0), print)
    search.budget = SimpleNamespace(may_compare_on=lambda look: True)
    fit: Any = SimpleNamespace(reduced_chi2=2.0)
    chosen = Candidate(tuple(BY_ID[i] for i in (DRAG, FRICTION, SPRING)), fit, 0.0)
    told = Decision("partly", (BY_ID[SPRING],))
    monkeypatch.setattr(remaining, "decide", lambda found: told)
    promised = ["power_damping", "sensor_drift", "harmonic_forcing", "base_motion", "sensor_cubic"]
    scores = tuple(Table.score(BY_ID[i], 50.0 - n) for n, i in enumerate(promised))
    search.drop = lambda c, effect: Candidate(
        tuple(e for e in c.effects if e is not effect), fit, 0.0
    )
    search.scanned = lambda candidate, effects: Scan(scores, 1e-6, None, (), ())
    fitted: list[Any] = []

    def fit_one(rest: Candidate, found: Scan, score: Any, rival: Candidate) -> Any:
        fitted.append((rest.ids, score.effect.id))
        return SimpleNamespace(refused=1.0 if len(fitted) <= refused else None)

    search.fit_one = fit_one
    search.tried = {}
    base = examined(candidate(SPRING, 0.0))
    found = replace(selection(base), chosen=examined(chosen))
    search.without_families(found)
    others = promised[1 : 1 + min(refused + 1, remaining.INSTEAD)]  # none of the family
    assert fitted == [((SPRING,), i) for i in others]


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
