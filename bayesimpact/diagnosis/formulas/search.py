"""From a learned force to a formula.

Where a diagnosis ends with a learned force, or with a term of the grammar that the search has met,
every sum of up to three terms is scored in the linearised problem (`formulas.scores`,
`bayesimpact.formula.evidence`); the best few are refitted in full, as effects like any. One is
named when

- it leaves nothing, by the tests that the catalogue's models pass (`ExaminedModel.is_white`), and
- it leads every other hypothesis by the decisive odds: the models of the search, the learned force,
  and all other formulas that do not contain it, fitted or, where none of their kind was, scored;
  with the price of their lengths and without it, as effects are compared.

Where the misfit is small, formulas that score best beside the base model are asked, too, whether
one is decisively likelier than the effects that explain all: several of them may imitate one force
that the map of the free one is too coarse for, as a friction of the stop.

Else the formulas are listed with their odds, and the verdict stays; but an effect that the
likeliest of all models lacks, formulas among them, is not named: it imitated what a formula is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesimpact.diagnosis.budget import Budget
from bayesimpact.diagnosis.formulas.listing import Formulas, listed
from bayesimpact.diagnosis.formulas.refits import (
    Question,
    asked_about,
    kind_ids,
    kinds_of,
    length_price,
    refit_candidates,
    refitted,
)
from bayesimpact.diagnosis.formulas.rounds import (
    Refits,
    fitted_formulas,
    is_told,
    joined,
    scored_rivals,
)
from bayesimpact.diagnosis.refits.evidence import model_evidence
from bayesimpact.diagnosis.refits.refit import Candidate
from bayesimpact.diagnosis.residual_force.gaussian_process import missing_drift, missing_force
from bayesimpact.diagnosis.residual_force.learned import LEARNED
from bayesimpact.diagnosis.score_test.scan import scan
from bayesimpact.diagnosis.selection.decision import Decision
from bayesimpact.diagnosis.selection.outcome import (
    ExaminedModel,
    Selection,
    is_large,
    leaves_something,
)
from bayesimpact.diagnosis.thresholds import DECISIVE
from bayesimpact.formula.evidence import Subset
from bayesimpact.formula.grammar import Term
from bayesimpact.formula.law import is_formula, kind_id
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect, Scales

TURNS = 3  # of scoring formulas, each on the likeliest one before: set by hand


@dataclass(frozen=True, eq=False)
class Answer:
    """What a diagnosis says: see `loop.Diagnosis`."""

    selection: Selection
    decision: Decision
    after: Fit
    examined: ExaminedModel | None
    formulas: Formulas | None = None


def with_formulas(
    answer: Answer,
    effects: Sequence[Effect],
    scales: Scales,
    *,
    rng: np.random.Generator,
    progress: Callable[[str], None],
    budget: Budget,
) -> Answer:
    """The answer with formulas for what is unknown, and with one of them named where the odds say
    so; as it is where nothing is unknown, or the search ended by its limit.

    Where the budget ends before all formulas are fitted that may be the likeliest, none is named.
    """
    means = _Means(effects, scales, rng, progress, budget)
    something = answer.decision.verdict in ("unknown", "partly") or _has_formula(answer.after)
    if something and answer.selection.finished:
        answer = _compared(answer, means, TURNS)
    elif answer.decision.effects and not is_large(answer.selection.base.candidate.fit):
        answer = _or_a_formula(answer, means)
    certain = answer.formulas is not None and answer.formulas.named
    return answer if certain else _uncertain(answer)


@dataclass(frozen=True, eq=False)
class _Means:
    """What comparing formulas needs beside an answer."""

    effects: Sequence[Effect]
    scales: Scales
    rng: np.random.Generator
    progress: Callable[[str], None]
    budget: Budget


def _or_a_formula(answer: Answer, means: _Means) -> Answer:
    """The answer, or that of formulas where one that has no more terms than it names effects, and
    leaves nothing, is decisively likelier; as far as time allows to compare that with all others.
    """
    if not (answer.selection.finished and means.budget.may_go_on()):
        return answer
    selection, base = answer.selection, answer.selection.base.candidate.fit
    means.progress("scoring formulas in place of the effects")
    question = asked_about(base, selection.prior_cost, means.scales)
    if question is None:
        return answer
    most = len(answer.decision.effects)
    fewer = [s for s in question.ranked if len(s.terms) <= most]
    fitted = list[Candidate]()
    for subset in refit_candidates(fewer, question.scores.terms):
        one = refitted(question, subset) if means.budget.may_go_on() else None
        if one is not None and one.fit.converged and not leaves_something(one.fit):
            fitted.append(one)
    selection = joined(selection, fitted)
    first = max(fitted, key=selection.log_odds, default=selection.chosen.candidate)
    if not selection.log_odds(first) > selection.log_odds(selection.chosen.candidate) + DECISIVE:
        return answer
    found = _compared(replace(answer, selection=selection, after=first.fit), means, TURNS)
    return found if found.selection.finished else answer


def _compared(answer: Answer, means: _Means, turns: int) -> Answer:
    """The answer with formulas compared along its motion, and along that of the likeliest one if
    that was wrong, `turns` times at most.
    """
    if not means.budget.may_go_on():
        return replace(answer, selection=replace(answer.selection, finished=False))
    means.progress("scoring formulas")
    question = asked_about(answer.after, answer.selection.prior_cost, means.scales)
    if question is None:
        return answer
    found = fitted_formulas(question, answer.selection, means.progress, means.budget)
    answer = replace(answer, selection=replace(answer.selection, finished=not found.late))
    if not found.fitted:
        return answer
    first = max(found.fitted, key=lambda s: found.selection.log_odds(found.fitted[s]))
    if not found.late and turns > 1 and _misled(answer, found, first):
        answer = replace(answer, selection=found.selection, after=found.fitted[first].fit)
        return _compared(answer, means, turns - 1)
    named = not found.late and _may_be_named(question, found, first)
    examined = None
    if named:
        means.progress("scoring what the formula lacks")
        examined = _examined(found.fitted[first], means)
        named = examined.is_white
    return _answered(answer, question, found, first, examined if named else None)


def _answered(
    answer: Answer, question: Question, found: Refits, first: Subset, examined: ExaminedModel | None
) -> Answer:
    """The answer with the list of formulas; with the likeliest named where it was `examined`."""
    scores, selection, candidate = question.scores, found.selection, found.fitted[first]
    heads = [h for h in question.heads if not is_told(h, found, scores.terms)]
    rows = listed(question, selection, heads, found.fitted)
    seen = scores.seen[:, list(first.terms)] @ np.array(first.sizes)
    formulas = Formulas(rows, answer.after, examined is not None, seen, candidate.fit)
    if examined is None:
        return replace(answer, decision=_needed(answer.decision, selection), formulas=formulas)
    examined_models = {**selection.examined_models, frozenset(candidate.ids): examined}
    selection = replace(
        selection,
        chosen=examined,
        examined_models=examined_models,
        finished=answer.selection.finished,
    )
    return Answer(selection, _decided(answer, candidate), candidate.fit, None, formulas)


def _has_formula(fit: Fit) -> bool:
    return any(map(is_formula, fit.density.oscillator.effects))


def _misled(answer: Answer, found: Refits, first: Subset) -> bool:
    """Whether formulas were scored on one that another beats decisively: along a motion that is
    wrong the scores of all others are too.
    """
    own = [c for c in answer.selection.tried if c.fit is answer.after]
    if not (own and _has_formula(answer.after)):
        return False
    candidate, odds = found.fitted[first], found.selection.log_odds
    return odds(candidate) > odds(own[0]) + DECISIVE and kind_ids(candidate) != kind_ids(own[0])


def _may_be_named(question: Question, found: Refits, first: Subset) -> bool:
    """Whether a formula leads all other hypotheses by the decisive odds and explains the rest.

    With the price of their lengths, which says what is simpler, and with that of effects alone: no
    name rests on being shorter to write.
    """
    selection, fitted = found.selection, found.fitted
    candidate, scores = fitted[first], question.scores
    if not candidate.fit.converged or leaves_something(candidate.fit):
        return False
    own, terms = kind_ids(candidate), scores.terms
    reference = question.reference
    subset_of = {id(c): s for s, c in fitted.items()}
    kinds = set(kinds_of(first, terms))
    rivals: list[tuple[float, float, float]] = []  # odds, what length costs of them, lead needed
    for c in selection.tried:
        if not all(has_kind(c, i) for i in own):
            lead = needed_lead(kinds, subset_of.get(id(c)), terms)
            rivals.append((selection.log_odds(c), c.price(0.0), lead))
    if any(e.id == LEARNED for e in reference.density.oscillator.effects):
        evidence = model_evidence(reference)
        learned = Candidate(reference.density.oscillator.effects, reference, evidence)
        rivals.append((selection.log_odds(learned), 0.0, DECISIVE))
    reached, length = selection.log_odds(candidate), candidate.price(0.0)
    for s in scored_rivals(question, found, first):
        odds = reached + s.log_odds - first.log_odds
        extra = sum(length_price(question, i) for i in s.terms)
        rivals.append((odds, extra, needed_lead(kinds, s, terms)))
    return all(
        reached - odds > least and reached + length - odds - extra > least
        for odds, extra, least in rivals
    )


def needed_lead(kinds: set[str], rival: Subset | None, terms: Sequence[Term]) -> float:
    """Odds by which a formula of these kinds must lead a rival.

    One that reduces to it, because a bump as wide as the motion or a fading beyond all speeds is
    the force everywhere, only refines it: it must not be the likelier one.
    """
    if rival is None:
        return DECISIVE
    wide = {repr(terms[i].everywhere.kind) for i in rival.terms}
    return 0.0 if kinds <= wide | set(kinds_of(rival, terms)) else DECISIVE


def has_kind(candidate: Candidate, kind: str) -> bool:
    """Whether a model has an effect of a kind, or one that reduces to it."""
    return kind in kind_ids(candidate) or any(e.prefer == kind for e in candidate.effects)


def _examined(candidate: Candidate, means: _Means) -> ExaminedModel:
    fit, scales, rng = candidate.fit, means.scales, means.rng
    return ExaminedModel(
        candidate,
        scan(fit, means.effects, scales, rng=rng),
        missing_force(fit, scales, rng=rng),
        missing_drift(fit, scales, rng=rng),
    )


def _uncertain(answer: Answer) -> Answer:
    """The answer without names of formulas: where its model has one, only those effects are named
    that every likely model has.
    """
    selection, effects = answer.selection, answer.decision.effects
    if not any(map(is_formula, (*effects, *answer.after.density.oscillator.effects))):
        return answer
    least = max(map(selection.log_odds, selection.tried)) - DECISIVE
    likely = [c for c in selection.tried if selection.log_odds(c) > least]
    named = tuple(e for e in effects if not is_formula(e) and all(e.id in c.ids for c in likely))
    decision = replace(answer.decision, verdict="partly" if named else "unknown", effects=named)
    examined = answer.examined
    if examined is None:  # what a formula does is what the catalogue leaves
        rest = frozenset(e.id for e in selection.chosen.candidate.effects if not is_formula(e))
        examined = selection.examined_models.get(rest, selection.base)
    return replace(answer, decision=decision, examined=examined)


def _needed(decision: Decision, selection: Selection) -> Decision:
    """The decision with those of its effects that the likeliest of all models has."""
    likeliest = set(selection.tried[0].ids)
    effects = tuple(e for e in decision.effects if e.id in likeliest)
    if len(effects) == len(decision.effects):
        return decision
    return replace(decision, verdict="partly" if effects else "unknown", effects=effects)


def _decided(answer: Answer, candidate: Candidate) -> Decision:
    """The decision with the formula's effects named; whole where all others of its model are, and
    ambiguous where these were.
    """
    before = tuple(e for e in answer.decision.effects if e.id in candidate.ids)
    known = {e.id for e in before}
    own = tuple(e for e in candidate.effects if is_formula(e) and e.id not in known)
    others = {e.id for e in candidate.effects} - {e.id for e in own}
    if not others <= known:
        return Decision("partly", (*before, *own))
    kept = kind_ids(candidate) & {kind_id(e.id) for e in answer.decision.effects}
    if answer.decision.verdict == "ambiguous" and kept:  # what it had named, two effects still do
        return replace(answer.decision, effects=(*before, *own))
    return Decision("named", (*before, *own))
