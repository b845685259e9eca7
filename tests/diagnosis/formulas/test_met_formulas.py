"""Terms of the grammar that a search has met, compared with all others before they are names."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from effect_rigs import BY_ID
from formula_answers import asked, state_of
from small_rig import PLAIN, PLAIN_RELEASES, record

from bayesimpact.diagnosis.diagnose import without_uncertain_formulas
from bayesimpact.diagnosis.formulas import rounds as formula_rounds
from bayesimpact.diagnosis.formulas.search import Answer
from bayesimpact.diagnosis.measurement.repetition import residual_repetition
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import Candidate, base_candidate, fit_from
from bayesimpact.diagnosis.selection.decision import Decision
from bayesimpact.diagnosis.selection.outcome import Selection
from bayesimpact.formula.grammar import ONE, Term
from bayesimpact.formula.law import effect_of, kind_id, starts_of
from bayesimpact.formula.library import V
from bayesimpact.inference.identify import identify
from bayesimpact.model.effects.effect import Effect, Scales


def met(wrong: Term) -> tuple[Answer, Scales]:
    """What a search ends with that has met a term on its way, and takes it for what is there."""
    rng = np.random.default_rng(0)
    bump = {"coefficient": 4.0, "place": -2.5e-3, "width": 7e-4}
    campaign = record(
        3, {"damping_bump": bump}, rig=PLAIN, releases=PLAIN_RELEASES, duration=4.0, rate=500.0
    )
    base = base_candidate(identify(campaign, rng=rng, search=False).fit)
    scales = campaign_scales(base.fit)
    law = effect_of(wrong, 0.1, 1e-2, scales.speed, signed=False)
    chosen = fit_from(base.fit, (law,), starts_of(wrong) | {f"{law.id}.size": 4.0}, scales)
    first, examined = (state_of(c, scales, rng) for c in (base, chosen))
    selection = Selection(
        first, examined, (chosen, base), np.log(50.0), residual_repetition(chosen.fit)
    )
    return Answer(selection, Decision("named", (law,)), chosen.fit, None), scales


BOX = Term("box", ONE, V, -1, 2.5e-3, 8e-4)


def test_formulas_are_scored_again_along_the_motion_of_the_likeliest() -> None:
    """Along that of a wrong one others seem as good as the right one is."""
    before, scales = met(BOX)
    assert before.after.reduced_chi2 > 1.2
    said: list[str] = []
    found = asked(before, scales, said=said)
    assert said.count("scoring formulas") > 1
    kinds = [frozenset(map(kind_id, c.ids)) for c in found.selection.tried]
    assert len(set(kinds)) == len(kinds)  # no model is its own rival
    assert found.decision.verdict == "named" and found.after.reduced_chi2 < 1.1
    (term,) = found.formulas.ranked[0].terms
    assert (term.region, term.speed) == ("bump", V)


def test_what_a_search_has_met_is_fitted_whatever_scores_say(monkeypatch: Any) -> None:
    """Large forces are scored less exactly than they are fitted."""
    monkeypatch.setattr(formula_rounds, "refit_candidates", lambda ranked, terms: [])
    before, scales = met(replace(BOX, region="bump"))
    found = asked(before, scales)
    (first,) = (f for f in found.formulas.ranked if f.refitted)
    assert [t.kind for t in first.terms] == [replace(BOX, region="bump").kind]


def test_what_is_ambiguous_beside_a_formula_stays_so() -> None:
    """Two effects that do the same are not told apart by what else is named."""
    before, scales = met(replace(BOX, region="bump"))
    (law,) = before.decision.effects
    rival = before.selection.tried[1]
    open_ = replace(before, decision=Decision("ambiguous", (law,), (rival,)))
    found = asked(open_, scales)
    assert found.formulas.named
    assert (found.decision.verdict, found.decision.rivals) == ("ambiguous", (rival,))
    assert [kind_id(e.id) for e in found.decision.effects] == [kind_id(law.id)]


def test_no_term_that_a_search_has_met_is_a_name_by_itself() -> None:
    """Where time ends before it was compared with others, nor with what is still missing beside."""
    before, scales = met(BOX)
    found = asked(before, scales, 0)
    assert not found.selection.finished and found.after is before.after
    assert found.examined is before.selection.base  # what the formula does is what is left
    imitation = Decision("named", (BY_ID["spring_cubic"], *before.decision.effects))
    for answer in (found, asked(replace(before, decision=imitation), scales, 0)):
        assert (answer.decision.verdict, answer.decision.effects) == ("unknown", ())


@pytest.mark.parametrize("named", [True, False])
def test_what_a_formula_that_is_not_named_hides_is_looked_for_without_it(named: bool) -> None:
    """Such as first instants in which a recording is not yet free."""
    law, cubic = effect_of(BOX, 1.0, 1e-2, 1.0, signed=False), BY_ID["spring_cubic"]

    def fit(*effects: Effect) -> Any:
        return SimpleNamespace(density=SimpleNamespace(oscillator=SimpleNamespace(effects=effects)))

    whole, alone, base = fit(cubic, law), fit(cubic), fit()
    tried = (Candidate((cubic,), alone, 0.0),)

    def shown(after: Any, tried: tuple[Candidate, ...]) -> Any:
        found = SimpleNamespace(
            after=after, before=base, formulas=SimpleNamespace(named=named),
            selection=SimpleNamespace(tried=tried),
        )  # fmt: skip
        return without_uncertain_formulas(found)  # type: ignore[arg-type]

    assert shown(whole, tried) is (whole if named else alone)
    assert shown(whole, ()) is (whole if named else base)
    assert shown(alone, tried) is alone
