"""From a learned force to a formula.

Where a diagnosis ends with a learned force, every sum of up to three terms of the grammar is scored
in the linearised problem (`formula_scores`, `bayesimpact.formula.evidence`); the best few are
refitted in full, as effects like any. One is named when

- it leaves nothing, by the tests that the catalogue's models pass (`State.is_white`), and
- it leads every other hypothesis by the decisive odds: the models of the search, the learned force,
  and all other formulas that do not contain it, fitted or, where none of their kind was, scored;
  with the price of their lengths and without it, as effects are compared.

Else the formulas are listed with their odds, and the verdict stays; but an effect that the
likeliest of all models lacks, formulas among them, is not named: it imitated what a formula is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesimpact.diagnosis.budget import Budget
from bayesimpact.diagnosis.decision import Decision
from bayesimpact.diagnosis.evidence import model_evidence
from bayesimpact.diagnosis.force import missing_drift, missing_force
from bayesimpact.diagnosis.formula_list import Formulas, listed
from bayesimpact.diagnosis.formula_refits import (
    Question,
    kinds_of,
    length_price,
)
from bayesimpact.diagnosis.formula_rounds import (
    Refits,
    fitted_formulas,
    is_told,
    scored_rivals,
)
from bayesimpact.diagnosis.formula_scores import formula_scores
from bayesimpact.diagnosis.learned import LEARNED
from bayesimpact.diagnosis.naming import Naming, State, leaves_something
from bayesimpact.diagnosis.refit import Candidate, residual_repetition
from bayesimpact.diagnosis.scan import scan
from bayesimpact.diagnosis.thresholds import DECISIVE
from bayesimpact.formula.classes import formula_classes, term_classes
from bayesimpact.formula.evidence import Subset, subsets
from bayesimpact.formula.grammar import Term
from bayesimpact.formula.law import is_formula
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect, Scales


@dataclass(frozen=True, eq=False)
class Answer:
    """What a diagnosis says: see `loop.Diagnosis`."""

    naming: Naming
    decision: Decision
    after: Fit
    state: State | None
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
    if answer.decision.verdict not in ("unknown", "partly") or not answer.naming.finished:
        return answer
    if not budget.may_go_on():
        return replace(answer, naming=replace(answer.naming, finished=False))
    progress("scoring formulas")
    repetition = residual_repetition(answer.after)
    scores = formula_scores(answer.after, scales, repetition=repetition)
    if not scores.terms:
        return answer
    ranked = subsets(scores.problem)
    classes = term_classes(scores.problem.information, scores.problem.price)
    heads = formula_classes(ranked, scores.terms, classes)
    if not any(h.best.log_odds > 0.0 for h in heads):
        return answer
    question = Question(answer.after, answer.naming.prior_cost, scores, scales, ranked)
    found = fitted_formulas(question, answer.naming, progress, budget)
    fitted, naming, late = found.fitted, found.naming, found.late
    answer = replace(answer, naming=replace(answer.naming, finished=not late))
    if not fitted:
        return answer
    heads = [h for h in heads if not is_told(h, found, scores.terms)]
    first = max(fitted, key=lambda s: naming.log_odds(fitted[s]))
    rows = listed(question, naming, heads, fitted)
    named = not late and _may_be_named(question, found, first)
    state = None
    if named:
        progress("scoring what the formula lacks")
        state = _examined(fitted[first], effects, scales, rng)
        named = state.is_white
    seen = scores.seen[:, list(first.terms)] @ np.array(first.sizes)
    found_formulas = Formulas(rows, answer.after, named, seen, fitted[first].fit)
    if not named or state is None:
        decision = _needed(answer.decision, naming)
        return replace(answer, decision=decision, formulas=found_formulas)
    ids = frozenset(fitted[first].ids)
    naming = replace(naming, chosen=state, states={**naming.states, ids: state})
    return Answer(naming, _decided(answer, fitted[first]), fitted[first].fit, None, found_formulas)


def _may_be_named(question: Question, found: Refits, first: Subset) -> bool:
    """Whether a formula leads all other hypotheses by the decisive odds and explains the rest.

    With the price of their lengths, which says what is simpler, and with that of effects alone: no
    name rests on being shorter to write.
    """
    naming, fitted = found.naming, found.fitted
    candidate, scores = fitted[first], question.scores
    if not candidate.fit.converged or leaves_something(candidate.fit):
        return False
    own, terms = set(candidate.ids), scores.terms
    reference = question.reference
    subset_of = {id(c): s for s, c in fitted.items()}
    kinds = set(kinds_of(first, terms))
    rivals: list[tuple[float, float, float]] = []  # odds, what length costs of them, lead needed
    for c in naming.tried:
        if not own <= set(c.ids):
            s = subset_of.get(id(c))
            extra = length_price(question, s) if s else 0.0
            rivals.append((naming.log_odds(c), extra, needed_lead(kinds, s, terms)))
    if any(e.id == LEARNED for e in reference.target.oscillator.effects):
        evidence = model_evidence(reference)
        learned = Candidate(reference.target.oscillator.effects, reference, evidence)
        rivals.append((naming.log_odds(learned), 0.0, DECISIVE))
    reached, length = naming.log_odds(candidate), length_price(question, first)
    for s in scored_rivals(question, found, first):
        odds = reached + s.log_odds - first.log_odds
        rivals.append((odds, length_price(question, s), needed_lead(kinds, s, terms)))
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


def _examined(
    candidate: Candidate, effects: Sequence[Effect], scales: Scales, rng: np.random.Generator
) -> State:
    fit = candidate.fit
    return State(
        candidate,
        scan(fit, effects, scales, rng=rng),
        missing_force(fit, scales, rng=rng),
        missing_drift(fit, scales, rng=rng),
    )


def _needed(decision: Decision, naming: Naming) -> Decision:
    """The decision with those of its effects that the likeliest of all models has."""
    likeliest = set(naming.tried[0].ids)
    effects = tuple(e for e in decision.effects if e.id in likeliest)
    if len(effects) == len(decision.effects):
        return decision
    return replace(decision, verdict="partly" if effects else "unknown", effects=effects)


def _decided(answer: Answer, candidate: Candidate) -> Decision:
    """The decision with the formula's effects named; whole where all others of its model are."""
    before = tuple(e for e in answer.decision.effects if e.id in candidate.ids)
    known = {e.id for e in before}
    own = tuple(e for e in candidate.effects if is_formula(e) and e.id not in known)
    others = {e.id for e in candidate.effects} - {e.id for e in own}
    return Decision("named" if others <= known else "partly", (*before, *own))
