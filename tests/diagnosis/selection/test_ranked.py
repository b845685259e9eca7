"""How far the climbs of a search go."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from effect_rigs import BY_ID

from bayesimpact.diagnosis.candidates.promising import SCORE_UNDERESTIMATE
from bayesimpact.diagnosis.refits.refit import LITTLE, TO_THE_MODE, Candidate
from bayesimpact.diagnosis.selection import models, ranked
from bayesimpact.diagnosis.selection.ranked import Ranked
from bayesimpact.diagnosis.selection.search import _Search
from bayesimpact.diagnosis.thresholds import DECISIVE, LARGE

REPETITION = 30.0


def examined(ids: str, chi2: float, converged: bool = True) -> SimpleNamespace:
    fit = SimpleNamespace(reduced_chi2=chi2, converged=converged)
    found = Candidate(tuple(BY_ID[i] for i in ids.split()), fit, 0.0)
    return SimpleNamespace(candidate=found, is_white=False)


def searching(monkeypatch, chi2: float) -> Ranked:
    """A search whose base model leaves so much."""
    monkeypatch.setattr(ranked, "residual_repetition", lambda fit: REPETITION)
    search = Ranked((), None, np.random.default_rng(0), lambda words: None)
    base = examined("", chi2)
    search.examined_models[frozenset()] = base
    search.tried[frozenset()] = base.candidate
    return search


@pytest.mark.parametrize("times", [0.5, 2.0])
def test_beside_a_large_misfit_ascents_end_where_odds_no_longer_ask(monkeypatch, times):
    search = searching(monkeypatch, times * LARGE**2)
    enough = search.enough()
    if times > 1.0:
        assert enough.goal == -np.inf and enough.least_gain == pytest.approx(LITTLE * REPETITION)
    else:
        assert enough == TO_THE_MODE


@pytest.mark.parametrize(
    ("times", "converged", "again"), [(2.0, False, True), (2.0, True, False), (0.5, False, False)]
)
def test_a_model_that_is_chosen_is_fitted_to_its_mode(monkeypatch, times, converged, again):
    search = searching(monkeypatch, times * LARGE**2)
    chosen = examined("spring_cubic power_damping", 1.0, converged)
    begun = []

    def grown(smaller, effects, scales):
        begun.append((smaller.ids, effects))
        return smaller

    monkeypatch.setattr(ranked, "grown", grown)
    monkeypatch.setattr(search, "examine", lambda candidate: "examined")
    found = search.at_its_mode(chosen)
    assert begun == ([(chosen.candidate.ids, chosen.candidate.effects)] if again else [])
    assert found == "examined" if again else found is chosen


@pytest.mark.parametrize(
    ("times", "chi2", "more", "leads"),
    [
        (2.0, 1.0, DECISIVE - 1.0, False),  # within the noise, less than decisive
        (2.0, 1.0, DECISIVE + 1.0, True),
        (2.0, 5.0, DECISIVE - 1.0, True),  # more than the noise: any gain
        (0.5, 1.0, DECISIVE - 1.0, True),  # the misfit was never large
    ],
)
def test_what_odds_would_leave_out_again_is_not_taken_in(monkeypatch, times, chi2, more, leads):
    search = searching(monkeypatch, times * LARGE**2)
    monkeypatch.setattr(ranked, "leaves_something", lambda fit: fit.reduced_chi2 > 1.0)
    small, large = examined("spring_cubic", chi2), examined("spring_cubic power_damping", chi2)
    odds = {1: 0.0, 2: more}
    monkeypatch.setattr(search, "log_odds", lambda c: odds[len(c.effects)])
    monkeypatch.setattr(search, "promise", lambda c: 30.0 * odds[len(c.effects)])
    assert search.leads_on(small, large.candidate) == leads


@pytest.mark.parametrize("ids", ["", "spring_cubic"])
def test_a_larger_model_is_of_no_use_below_the_one_that_it_contains(monkeypatch, ids):
    """But an effect alone may be: beside others it may still be right."""
    search, ends = searching(monkeypatch, 2.0 * LARGE**2), []
    smaller = examined(ids, 1.0).candidate
    smaller.fit.log_posterior = smaller.fit.log_likelihood = 70.0
    monkeypatch.setattr(models, "refit", lambda *_, enough: ends.append(enough.goal))
    monkeypatch.setattr(search, "keep", lambda candidate: candidate)
    search.start(smaller, [SimpleNamespace(effect=BY_ID["quadratic_drag"], shapes={})])
    assert ends == [70.0 if ids else -np.inf]


def test_beside_a_rival_only_what_may_pay_for_itself_too_is_fitted(monkeypatch):
    """An effect has a price: what makes up for a rival's arrears alone cannot overtake."""
    catalogue = [BY_ID[i] for i in ("contact_damping_speed", "coulomb_friction", "spring_cubic")]
    search = _Search(catalogue, None, np.random.default_rng(0), lambda words: None)
    base, best, rival = (examined(i, 1.0) for i in ("", "spring_cubic", "quadratic_drag"))
    behind = 6.0
    odds = {(): -100.0, best.candidate.ids: 0.0, rival.candidate.ids: -behind}
    search.examined_models[frozenset()] = base
    for model in (base, best, rival):
        search.tried[frozenset(model.candidate.ids)] = model.candidate
    monkeypatch.setattr(search, "log_odds", lambda c: odds[c.ids])
    least = (behind + search.cost) / SCORE_UNDERESTIMATE
    effects = (BY_ID["contact_damping_speed"], BY_ID["coulomb_friction"])
    pairs = zip(effects, (least - 0.1, least + 0.1), strict=True)
    scores = [SimpleNamespace(effect=e, gain=gain) for e, gain in pairs]
    rival.scan = SimpleNamespace(best=lambda: scores)
    fitted = []

    def fit_one(chosen, scan, score):
        fitted.append(score.effect.id)
        return examined(f"quadratic_drag {score.effect.id}", 1.0).candidate

    monkeypatch.setattr(search, "fit_one", fit_one)
    search.extended(rival)
    assert fitted == ["coulomb_friction"]
