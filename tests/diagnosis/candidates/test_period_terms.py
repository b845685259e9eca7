"""Forces of no effect that periods ahead ask for."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.diagnosis.candidates.period_sets import PeriodSets
from bayesimpact.diagnosis.candidates.period_terms import periods_with_terms
from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.selection import unlisted
from bayesimpact.diagnosis.thresholds import EXCESS, LARGE
from bayesimpact.formula.law import is_formula, is_formula_id
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import identify
from bayesimpact.model.effects import SEARCHED

FRICTION = {"contact_friction": {"force": 0.5}, "spring_cubic": {"stiffness": 4e6}}
WANTED = {"formula_sign_v_in_contact", "spring_cubic"}


@pytest.fixture(scope="module")
def rubbing() -> Fit:
    """A base fit to recordings of an obstacle that rubs, and a cubic spring."""
    campaign = small_rig.record(2, FRICTION, duration=4.0)
    return identify(campaign, rng=np.random.default_rng(0), search=False).fit


def test_terms_stand_beside_sets_and_are_in_none(rubbing: Fit) -> None:
    """And cost what their formula is long."""
    scales = campaign_scales(rubbing)
    problem, plain = (
        periods_with_terms(rubbing, SEARCHED, scales),
        PeriodSets(rubbing, SEARCHED, scales),
    )
    own, others = problem.best(3), plain.best(3)
    assert [s.effects for s in own] == [s.effects for s in others]
    assert not any(map(is_formula_id, problem.gains()))
    assert any(map(is_formula_id, problem.gains(with_terms=True)))
    t = next(t for t, term in enumerate(problem.terms) if is_formula(term.effect))
    effect, price = problem.terms[t].effect, problem.terms[t].effect.price
    assert effect.price > 0
    odds = problem.log_odds((t,))
    problem.cost += price
    object.__setattr__(effect, "price", 0.0)
    assert problem.log_odds((t,)) == pytest.approx(odds)


@pytest.mark.parametrize("times, taken", [(0.9, False), (1.1, True)])
def test_a_model_with_a_term_must_leave_far_less(monkeypatch, times: float, taken: bool) -> None:
    """An effect more explains a little of anything; the search goes on with the catalogue then."""
    search = object.__new__(unlisted.Unlisted)
    search.asked = SimpleNamespace(has_stop=True)
    monkeypatch.setattr(unlisted.Unlisted, "is_large", True)
    monkeypatch.setattr(search, "may_go_on", lambda: True)
    above = 100.0 * LARGE**2
    noise = SimpleNamespace(level_error=0.01)
    density = SimpleNamespace(likelihood=SimpleNamespace(noise=noise))

    def made(above_noise: float, is_white: bool = False) -> Any:
        fit = SimpleNamespace(reduced_chi2=1.0 + above_noise, density=density)
        return SimpleNamespace(candidate=SimpleNamespace(fit=fit), is_white=is_white)

    with_term = made(above / (times * EXCESS)).candidate
    monkeypatch.setattr(search, "asked_again", lambda about, problem: with_term)
    monkeypatch.setattr(search, "examine", lambda c: SimpleNamespace(candidate=c))
    base, examined = made(above), made(above)
    assert (search.with_a_term_ahead(base, examined).candidate is with_term) is taken
    for of, name, value in (
        (unlisted.Unlisted, "is_large", False),
        (search, "may_go_on", lambda: False),
    ):
        with monkeypatch.context() as changed:
            changed.setattr(of, name, value)
            assert search.with_a_term_ahead(base, examined) is examined
    white = made(above, is_white=True)
    assert search.with_a_term_ahead(base, white) is white
    search.asked.has_stop = False
    assert search.with_a_term_ahead(base, examined) is examined


@pytest.mark.long
def test_a_force_in_contact_is_named_by_its_formula() -> None:
    campaign = small_rig.record(5, FRICTION, duration=2.0)
    names = (
        "spring_cubic", "quadratic_drag", "coulomb_friction", "contact_hardening",
        "contact_damping_speed", "hunt_crossley", "sensor_drift",
    )  # fmt: skip
    effects = tuple(BY_ID[name] for name in names)
    found = diagnose(campaign, rng=np.random.default_rng(0), effects=effects, search=False)
    assert found.verdict == "named" and {e.id for e in found.effects} == WANTED
    assert found.after.reduced_chi2 < 1.1
