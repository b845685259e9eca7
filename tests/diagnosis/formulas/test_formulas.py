"""From a learned force to a formula: found, named only where nothing else fits alike, written."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from effect_rigs import BY_ID
from formula_answers import DETENT, DRAG, asked, unknown

from bayesimpact.diagnosis.candidates.asked import Asked
from bayesimpact.diagnosis.formulas import refits as formula_refits
from bayesimpact.diagnosis.formulas import rounds as formula_rounds
from bayesimpact.diagnosis.formulas import search as formulas
from bayesimpact.diagnosis.formulas.listing import formula_text
from bayesimpact.diagnosis.formulas.refits import refit_candidates
from bayesimpact.diagnosis.formulas.rounds import joined
from bayesimpact.diagnosis.formulas.search import Answer
from bayesimpact.diagnosis.refits.refit import Candidate, base_candidate
from bayesimpact.diagnosis.remainder import likeliest_formula, remainder
from bayesimpact.diagnosis.residual_force.learned import LEARNED
from bayesimpact.diagnosis.score_test.scan import scan
from bayesimpact.diagnosis.selection.decision import Decision
from bayesimpact.diagnosis.thresholds import DECISIVE
from bayesimpact.formula.evidence import Subset
from bayesimpact.formula.grammar import ONE, Power, Term
from bayesimpact.formula.law import is_formula, kind_id
from bayesimpact.model.effects.effect import Effect, Scales
from bayesimpact.model.own_effects import load_effects
from bayesimpact.report.diagnosis.formula_arrays import formula_arrays
from bayesimpact.report.diagnosis.formula_entries import formula_entries, found_file


@pytest.fixture(scope="module")
def detent() -> tuple[Answer, Answer, Scales]:
    before, scales = unknown({"detent": DETENT})
    return before, asked(before, scales), scales


@pytest.fixture(scope="module")
def drag() -> tuple[Answer, Answer, Scales]:
    before, scales = unknown({"quadratic_drag": DRAG})
    return before, asked(before, scales), scales


@pytest.mark.parametrize("looks", [0, 1, 2])
def test_where_time_ends_no_formula_is_named(detent: Any, looks: int) -> None:
    """One that was not fitted might be the likelier one."""
    before, whole, scales = detent
    assert whole.selection.finished and before.selection.finished
    found = asked(before, scales, looks)
    assert not found.selection.finished and found.decision is before.decision
    assert found.after is before.after and found.selection.tried == before.selection.tried
    listed = found.formulas.ranked if found.formulas else ()
    assert sum(row.refitted for row in listed) == max(looks - 1, 0)


def test_a_force_of_no_catalogue_is_named_with_its_numbers(detent: Any) -> None:
    _, found, _ = detent
    assert found.decision.verdict == "named" and found.examined is None
    assert all(map(is_formula, found.decision.effects)) and len(found.decision.effects) == 1
    first = found.formulas.ranked[0]
    (term,) = first.terms
    assert (term.region, term.side, term.position.odd) == ("bump", -1, True)
    values = dict(zip(found.after.names, found.after.mode, strict=True))
    sd = dict(zip(found.after.names, found.after.sd, strict=True))
    names = {n.split(".")[1]: n for n in values if n.startswith("formula_")}
    for own, true in (("size", "stiffness"), ("place", "place"), ("width", "width")):
        off = (values[names[own]] - abs(DETENT[true])) / sd[names[own]]
        assert abs(off) < 4.0, own
    assert LEARNED not in {e.id for e in found.after.density.oscillator.effects}


@pytest.mark.long
def test_an_effect_that_imitated_the_force_goes_once_the_formula_is_in(detent: Any) -> None:
    cubic = BY_ID["spring_cubic"]
    before, scales = unknown({"detent": DETENT}, named=(cubic,))
    assert before.decision.effects == (cubic,)
    found = asked(before, scales)
    assert found.decision.verdict == "named"
    named = [e.id for e in found.decision.effects]
    assert named == [e.id for e in detent[1].decision.effects]
    assert found.selection.chosen.candidate.ids == tuple(named)


def test_a_formula_takes_the_place_of_effects_that_only_imitate_it(detent: Any) -> None:
    imitating = tuple(BY_ID[i] for i in ("spring_cubic", "spring_quadratic"))
    before, scales = unknown({"detent": DETENT}, named=imitating)
    found = asked(_said(before), scales)
    assert found.decision.verdict == "named"
    own, alone = ([kind_id(e.id) for e in a.decision.effects] for a in (found, detent[1]))
    assert own == alone


def test_no_formula_takes_the_place_of_the_law_that_acts() -> None:
    before, scales = unknown({"quadratic_drag": DRAG}, named=(BY_ID["quadratic_drag"],))
    named = _said(before)
    said: list[str] = []
    assert asked(named, scales, said=said) is named
    assert said == ["scoring formulas in place of the effects"]


def test_where_the_search_did_not_end_no_formula_takes_the_place_of_its_effects() -> None:
    imitating = tuple(BY_ID[i] for i in ("spring_cubic", "spring_quadratic"))
    before, scales = unknown({"detent": DETENT}, named=imitating)
    late = replace(_said(before), selection=replace(before.selection, finished=False))
    assert asked(late, scales) is late and asked(_said(before), scales, 0).decision.effects


def _said(answer: Answer) -> Answer:
    """An answer that names the effects of its model, as if nothing were left."""
    decision = replace(answer.decision, verdict="named")
    return Answer(answer.selection, decision, answer.selection.chosen.candidate.fit, None)


def test_a_term_that_says_nothing_beside_another_goes(detent: Any, monkeypatch: Any) -> None:
    """Where scores, which are linear, put no shorter formula among those that are fitted."""
    before, whole, scales = detent
    kinds = {repr(t.kind) for t in whole.formulas.ranked[0].terms}

    def longer(ranked: list[Subset], terms: list[Term]) -> list[Subset]:
        own = [(s, {repr(terms[i].kind) for i in s.terms}) for s in ranked]
        return [s for s, has in own if kinds < has and "bump" not in str(has - kinds)][:1]

    monkeypatch.setattr(formula_rounds, "refit_candidates", longer)
    found = asked(before, scales)
    (first, *others) = found.formulas.ranked
    assert {repr(t.kind) for t in first.terms} == kinds
    assert all({repr(t.kind) for t in f.terms} != kinds for f in others)
    assert found.formulas.named and len(found.decision.effects) == len(kinds)


def test_a_formula_is_scored_and_asked_for_like_any_effect(detent: Any) -> None:
    """Its fixed numbers are no sizes: they have no place among the unknowns."""
    before, found, scales = detent
    base, (law,) = before.selection.base.candidate.fit, found.decision.effects
    (score,) = scan(base, (law,), scales, rng=np.random.default_rng(0)).best()
    assert score.names == (f"{law.id}.size",) and score.gain > 10.0
    model = base_candidate(base)
    assert Asked(base, (law,), scales).first(model, model) == ({law.id}, {law.id})


def test_formulas_that_still_speak_against_the_likeliest_are_fitted_next(
    detent: Any, monkeypatch: Any
) -> None:
    """The first round meets only one that the force is not."""
    before, whole, scales = detent
    chosen, turns = formula_rounds.refit_candidates, []

    def late(ranked: list[Subset], terms: list[Term]) -> list[Subset]:
        turns.append(len(ranked))
        if len(turns) > 1:
            return chosen(ranked, terms)
        return [s for s in ranked if all(terms[i].region != "bump" for i in s.terms)][:1]

    monkeypatch.setattr(formula_rounds, "refit_candidates", late)
    found = asked(before, scales)
    assert len(turns) > 1 and found.decision.verdict == "named"
    assert found.formulas.ranked[0].terms[0].kind == whole.formulas.ranked[0].terms[0].kind


def test_of_two_fits_of_one_kind_the_likelier_keeps_its_own_terms(detent: Any) -> None:
    """Terms on a grid have names of their own: those of another made a traceback."""
    _, found, _ = detent
    terms = [WIDE, replace(WIDE, place=1e-3), CUBE]
    near, far, cube = (Subset((i,), (1.0,), odds) for i, odds in enumerate((5.0, 9.0, 7.0)))
    fit = found.after
    good, bad, other = (Candidate((), fit, value) for value in (3.0, 2.0, 1.0))
    ends = [(near, good), (far, bad), (cube, other)]
    best = formula_rounds._different(ends, found.selection, terms)
    assert best == {replace(near, log_odds=9.0): good, cube: other}


@pytest.mark.long
@pytest.mark.parametrize("others", [(), ("quadratic_drag",)])
def test_no_effect_is_named_that_the_likeliest_formula_makes_idle(
    monkeypatch: Any, others: tuple[str, ...]
) -> None:
    """Nor where the formula is not named itself; what it has beside it stays."""
    drag = dict.fromkeys(others, DRAG)
    effects = tuple(BY_ID[i] for i in ("spring_cubic", *others))
    before, scales = unknown({"detent": DETENT, **drag}, named=effects)
    assert before.decision.effects == effects
    monkeypatch.setattr(formulas, "_may_be_named", lambda *_: False)
    found = asked(before, scales)
    assert not found.formulas.named and found.after is before.after
    assert tuple(e.id for e in found.decision.effects) == others
    assert found.decision.verdict == ("partly" if others else "unknown")
    left = remainder(found.selection, found.after, found.examined, found.formulas)
    assert left.guess == "a force " + formula_text(found.formulas.ranked[0].terms)
    low, high = (x - DETENT["place"] for x in left.displacement)  # where the formula acts
    assert -2 * DETENT["width"] < low < 0 < high < 2 * DETENT["width"]
    scored = replace(found.formulas.ranked[0], refitted=False)
    assert not likeliest_formula(replace(found.formulas, ranked=(scored,)))


def test_the_one_named_leads_all_others_by_the_decisive_odds(detent: Any) -> None:
    before, found, _ = detent
    first, own = found.formulas.ranked[0], set(found.selection.chosen.candidate.ids)
    rivals = [c for c in found.selection.tried if not own <= set(c.ids)]
    assert rivals and all(first.log_odds > found.selection.log_odds(c) + DECISIVE for c in rivals)
    assert found.selection.chosen.is_white and not before.selection.chosen.is_white
    assert sum(f.probability for f in found.formulas.ranked) <= 1.0 + 1e-9
    odds = [f.log_odds for f in found.formulas.ranked]
    assert odds == sorted(odds, reverse=True)


def test_a_law_that_another_imitates_is_listed_and_not_named(drag: Any) -> None:
    before, found, scales = drag
    assert found.decision is before.decision and found.after is before.after
    assert not found.formulas.named
    entries = formula_entries(found.formulas, scales, angle=False)
    near = [e for e in entries if e["log_odds"] > entries[0]["log_odds"] - DECISIVE]
    listed = [text for e in near for text in (e["formula"], *e["alike"])]
    assert {"A |v| v", "A v^3"} <= set(listed)
    assert all(e["unit"] == "N s2/m2" for e in entries if e["formula"] == "A |v| v")
    share = entries[0]["peak_n"] / scales.force
    assert entries[0]["percent"] == pytest.approx(100 * share)


def test_what_is_not_unknown_is_left_alone(drag: Any) -> None:
    before, _, scales = drag
    named = Answer(before.selection, Decision("named", ()), before.after, None)
    assert asked(named, scales) is named


def test_file_of_the_formula_is_ready_for_use(detent: Any, tmp_path: Any) -> None:
    _, found, _ = detent
    file = tmp_path / "effect_found.py"
    file.write_text(found_file(found.formulas))
    assert [e.id for e in load_effects(file)] == [e.id for e in found.decision.effects]
    assert "named" in file.read_text().split('"""')[1]


def test_picture_shows_the_formula_within_the_band_of_the_learned_force(detent: Any) -> None:
    _, found, _ = detent
    arrays = formula_arrays(SimpleNamespace(formulas=found.formulas))  # type: ignore[arg-type]
    learned, seen, sd = (arrays[k] for k in ("reference_a", "formula_a", "reference_a_sd"))
    assert np.mean(np.abs(seen - learned) < 3 * sd) > 0.9
    assert np.abs(seen - learned).max() < 0.5 * np.abs(learned).max()


def test_samples_are_counted_by_the_best_of_all_models(detent: Any) -> None:
    before, found, _ = detent
    again = joined(before.selection, [found.selection.chosen.candidate])
    assert again.repetition < before.selection.repetition
    assert again.tried[0] is found.selection.chosen.candidate


def test_text_has_a_letter_for_every_size(detent: Any) -> None:
    _, found, _ = detent
    text = formula_text([f.terms[0] for f in found.formulas.ranked[:2]])
    assert text.startswith("A ") and " + B " in text


def test_places_of_an_angle_are_angles_wherever_they_are_written(
    detent: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    before, _, scales = detent
    said: list[str] = []
    found = asked(before, replace(scales, angle=True), said=said)
    entries = formula_entries(found.formulas, scales, angle=True)
    written = [*said, *(text for e in entries for text in (e["formula"], *e["alike"]))]
    assert any("fitting the formula" in text and "mrad" in text for text in said)
    assert any("mrad" in text for e in entries for text in e["alike"])
    assert not any(" mm" in text for text in written)
    campaign = found.formulas.reference.density.oscillator.campaign
    assert " mm" in found_file(found.formulas).split('"""')[1]
    monkeypatch.setattr(type(campaign), "angular", True)
    title = found_file(found.formulas).split('"""')[1]
    assert "mrad" in title and " mm" not in title


CUBE = Term("everywhere", ONE, Power(3.0, True))
WIDE = Term("bump", ONE, Power(2.0, True), -1, 2e-3, 5e-3)


@pytest.mark.parametrize(
    ("rival", "price", "named"),
    [(CUBE, 12.0, False), (CUBE, 5.0, True), (WIDE, 9.0, True), (WIDE, 13.0, False)],
)
def test_no_name_rests_on_being_shorter_to_write(
    rival: Term, price: float, named: bool, detent: Any
) -> None:
    """A rival seven nats behind, for its length or for what it explains; a wide bump refines."""
    _, found, _ = detent
    fit = found.after
    terms = (Term("everywhere", ONE, Power(2.0, True)), rival)
    question = SimpleNamespace(
        scores=SimpleNamespace(terms=terms), reference=fit, cost=4.0,
        kind_prices=np.array([5.0, price]), ranked=(),
    )  # fmt: skip
    length = 1.0, price - 4.0
    own = Effect("formula_one", "formula", "", "", "free", "either", "", price=length[0])
    other = Effect("formula_two", "formula", "", "", "free", "either", "", price=length[1])
    first, second = Subset((0,), (1.0,), 100.0), Subset((1,), (1.0,), 93.0)
    fitted = {
        first: Candidate((own,), fit, length[0]),
        second: Candidate((other,), fit, length[1] - 7.0),
    }
    selection = replace(found.selection, tried=tuple(fitted.values()))
    refits = formula_rounds.Refits(frozenset(fitted), fitted, selection, False)
    said = formulas._may_be_named(question, refits, first)  # type: ignore[arg-type]
    assert said is named


def test_refitted_are_formulas_of_different_kinds_few_of_which_only_add() -> None:
    square, cube = Power(2.0, True), Power(3.0, True)
    bump = Term("bump", ONE, square, -1, 2e-3, 5e-4)
    terms = [Term("everywhere", ONE, square), CUBE, Term("everywhere", cube), bump]
    terms += [replace(bump, place=3e-3), Term("everywhere", square)]
    order = [(0,), (0, 1), (0, 2), (3,), (4,), (3, 4), (5,)]
    ranked = [Subset(t, (1.0,) * len(t), 50.0 - i) for i, t in enumerate(order)]
    ranked.append(Subset((1, 2), (1.0, 1.0), -20.0))
    found = [s.terms for s in refit_candidates(ranked, terms)]
    assert found == [(0,), (0, 1), (3,), (5,)]


def test_a_fitted_formula_that_only_its_numbers_on_the_grid_made_unlikely_is_listed(
    detent: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first one alone is likely on the grid: fitting another ended in a traceback."""
    before, _, scales = detent
    scored = formula_refits.subsets

    def shifted(problem: Any) -> list[Subset]:
        ranked = scored(problem)
        by = ranked[0].log_odds - 1e-6
        return [replace(s, log_odds=s.log_odds - by) for s in ranked]

    monkeypatch.setattr(formula_refits, "subsets", shifted)
    found = asked(before, scales)
    assert found.formulas is not None
    assert len(found.formulas.ranked) > 1
