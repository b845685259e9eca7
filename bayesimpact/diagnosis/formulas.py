"""From a learned force to a formula.

Where a diagnosis ends with a learned force, every sum of up to three terms of the grammar is scored
in the linearised problem (`formula_scores`, `bayesimpact.formula.evidence`); the best few are
refitted in full, as effects like any. One is named when

- it leaves nothing, by the tests that the catalogue's models pass (`State.is_white`), and
- it leads every other hypothesis by the decisive odds: the models of the search, the learned force,
  and all other formulas that do not contain it, fitted or scored.

Its price is that of its description and not less than that of an effect. Else the verdict stays,
and the formulas are listed with their odds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.diagnosis.decision import Decision
from bayesimpact.diagnosis.evidence import model_evidence
from bayesimpact.diagnosis.extend import difference_steps, extend, transfer
from bayesimpact.diagnosis.force import missing_drift, missing_force
from bayesimpact.diagnosis.formula_scores import FormulaScores, formula_scores
from bayesimpact.diagnosis.learned import LEARNED
from bayesimpact.diagnosis.naming import Naming, State, leaves_something
from bayesimpact.diagnosis.refit import (
    ITERATIONS,
    TOLERANCE,
    Candidate,
    best_start,
    residual_repetition,
    step_sizes,
)
from bayesimpact.diagnosis.scan import scan
from bayesimpact.diagnosis.thresholds import DECISIVE
from bayesimpact.formula.classes import FormulaClass, formula_classes, term_classes
from bayesimpact.formula.evidence import Subset, subsets
from bayesimpact.formula.grammar import Term
from bayesimpact.formula.law import effect_id, effect_of, is_formula, starts_of
from bayesimpact.formula.responses import largest_force
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.mode import find_mode
from bayesimpact.model.effects.effect import Effect, Scales

Array = NDArray[np.float64]

REFITTED = 6  # formulas of different kinds
BEHIND = 60.0  # nats by which a score may underrate a formula that a refit would put first
LISTED = 20
ALIKE = 3


@dataclass(frozen=True, eq=False)
class Formula:
    """One formula with its odds.

    Attributes
    ----------
    terms, sizes : its terms, shapes as found, and their sizes as `Term.unit` says
    log_odds : against the base model, on the scale of `Naming.log_odds`
    probability : among all hypotheses of the diagnosis
    refitted : fitted in full, or scored only
    alike : other formulas that the recordings do not tell from it, likeliest first, `ALIKE` at most
    effects : one per term, to be fitted or written to a file
    peak : largest force of all terms together along the motion, N
    """

    terms: tuple[Term, ...]
    sizes: tuple[float, ...]
    log_odds: float
    probability: float
    refitted: bool
    alike: tuple[str, ...]
    effects: tuple[Effect, ...]
    peak: float


@dataclass(frozen=True, eq=False)
class Formulas:
    """Formulas for a learned force, likeliest first.

    Attributes
    ----------
    ranked : `LISTED` at most
    reference : the fit that they were scored on
    named : whether the first one is named
    seen_as : coefficients (2 knots,) that the learned force would have if the first formula were
        true; empty where there is no learned force of the displacement
    """

    ranked: tuple[Formula, ...]
    reference: Fit
    named: bool
    seen_as: Array


@dataclass(frozen=True, eq=False)
class Answer:
    """What a diagnosis says: see `loop.Diagnosis`."""

    naming: Naming
    decision: Decision
    after: Fit
    state: State | None
    formulas: Formulas | None = None


@dataclass(frozen=True, eq=False)
class _Search:
    """What refits need to know."""

    answer: Answer
    scores: FormulaScores
    scales: Scales

    @cached_property
    def kind_prices(self) -> Array:
        """Price of every term with its shape free: that of all terms of its kind together, (K,)."""
        kinds = [t.kind for t in self.scores.terms]
        share = np.exp(-self.scores.problem.price)
        total: dict[object, float] = {}
        for kind, part in zip(kinds, share, strict=True):
            total[kind] = total.get(kind, 0.0) + float(part)
        return -np.log([total[kind] for kind in kinds])

    @property
    def others(self) -> tuple[Effect, ...]:
        """Effects of the model beside the learned force."""
        return tuple(e for e in self.answer.after.target.oscillator.effects if e.id != LEARNED)


def with_formulas(
    answer: Answer,
    effects: Sequence[Effect],
    scales: Scales,
    *,
    rng: np.random.Generator,
    progress: Callable[[str], None],
) -> Answer:
    """The answer with formulas for what is unknown, and with one of them named where the odds say
    so; as it is where nothing is unknown.
    """
    if answer.decision.verdict not in ("unknown", "partly"):
        return answer
    progress("scoring formulas")
    repetition = residual_repetition(answer.after)
    scores = formula_scores(answer.after, scales, repetition=repetition)
    if not scores.terms:
        return answer
    ranked = subsets(scores.problem)
    classes = term_classes(scores.problem.information, scores.problem.price)
    heads = formula_classes(ranked, scores.terms, classes)
    heads = [h for h in heads if h.best.log_odds > 0.0]
    if not heads:
        return answer
    search = _Search(answer, scores, scales)
    fitted: dict[Subset, Candidate] = {}
    for subset in worth_a_refit(ranked, scores.terms):
        text = formula_text([scores.terms[k] for k in subset.terms])
        progress(f"fitting the formula {text}")
        found = refitted(search, subset)
        if found is not None:
            fitted[subset] = found
    if not fitted:
        return answer
    naming = joined(answer.naming, list(fitted.values()))
    first = max(fitted, key=lambda s: naming.log_odds(fitted[s]))
    listed = _listed(search, naming, heads, fitted)
    named = _may_be_named(search, naming, ranked, fitted, first)
    state = None
    if named:
        progress("scoring what the formula lacks")
        state = _examined(fitted[first], effects, scales, rng)
        named = state.is_white
    seen = _seen_as(search, first)
    found_formulas = Formulas(listed, answer.after, named, seen)
    if not named or state is None:
        return replace(answer, formulas=found_formulas)
    ids = frozenset(fitted[first].ids)
    naming = replace(naming, chosen=state, states={**naming.states, ids: state})
    return Answer(naming, _decided(answer, fitted[first]), fitted[first].fit, None, found_formulas)


def worth_a_refit(ranked: Sequence[Subset], terms: Sequence[Term]) -> list[Subset]:
    """The likeliest formulas that differ in more than the numbers of their shapes, best first.

    Those that contain a likelier one with fewer terms show only that no more is needed: one of them
    is enough. Shapes stand on grids here, so a rival may be better than it looks.
    """
    found: list[Subset] = []
    known: set[tuple[str, ...]] = set()
    larger = 0
    for subset in ranked:
        kinds = kinds_of(subset, terms)
        if subset.log_odds < ranked[0].log_odds - BEHIND or len(found) == REFITTED:
            break
        if kinds in known:
            continue
        contains = any(set(kinds_of(s, terms)) <= set(kinds) for s in found)
        if not contains or not larger:
            larger += contains
            known.add(kinds)
            found.append(subset)
    return found


def kinds_of(subset: Subset, terms: Sequence[Term]) -> tuple[str, ...]:
    """Kinds of a formula's terms, sorted."""
    return tuple(sorted(repr(terms[i].kind) for i in subset.terms))


def refitted(search: _Search, subset: Subset) -> Candidate | None:
    """A formula fitted in full, from where the scores expect it; None where it cannot stand beside
    the model's effects. Its price beyond that of effects is taken off its evidence.
    """
    scores, reference = search.scores, search.answer.after
    terms = [scores.terms[i] for i in subset.terms]
    own = tuple(_effect(search, i, a) for i, a in zip(subset.terms, subset.sizes, strict=True))
    if len({e.id for e in own}) < len(own):
        return None
    if not all(e.stands_beside(o) for e in own for o in (*search.others, *own) if e is not o):
        return None
    effects = (*search.others, *own)
    target = extend(reference, effects, search.scales)
    names = target.oscillator.layout.names
    shapes = {name: value for t in terms for name, value in starts_of(t).items()}
    unshifted = transfer(reference, target.oscillator.layout, effects, search.scales, shapes)
    predicted = unshifted.copy()
    at, sizes = list(subset.terms), np.array(subset.sizes)
    shift = scores.shift - scores.absorbed[:, at] @ sizes
    for name, by in zip(scores.names, shift, strict=True):
        predicted[names.index(name)] += by
    steps = step_sizes(names, effects, search.scales, ())
    sd = 1.0 / np.sqrt(np.diag(scores.problem.information)[at])
    for term, size, error in zip(terms, sizes, sd, strict=True):
        predicted[names.index(f"{effect_id(term)}.size")] = size
        steps[f"{effect_id(term)}.size"] = float(error)
    step = difference_steps(reference, target, steps)
    start = best_start(target, unshifted, predicted, step)
    fit = find_mode(target, start, steps=step, tolerance=TOLERANCE, max_iterations=ITERATIONS)
    return Candidate(effects, fit, model_evidence(fit) - _extra(search, subset))


def _effect(search: _Search, i: int, size: float) -> Effect:
    """The effect of term i; a dissipative one whose size came out negative may have either sign."""
    scores, scales = search.scores, search.scales
    term = scores.terms[i]
    reach = max(float(np.abs(y).max()) for y in scores.fit.displacements)
    signed = term.energy != "dissipates" or size < 0
    return effect_of(term, float(scores.size[i]), reach, scales.speed, signed=signed)


def _price(search: _Search, i: int) -> float:
    """Of a term whose shape is free: all terms of its kind together."""
    return float(search.kind_prices[i])


def joined(naming: Naming, candidates: Sequence[Candidate]) -> Naming:
    """The search with further models; samples are counted by the best residual of all."""
    tried = (*naming.tried, *candidates)
    best = min(tried, key=lambda c: c.fit.reduced_chi2)
    found = replace(naming, repetition=residual_repetition(best.fit))
    return replace(found, tried=tuple(sorted(tried, key=found.log_odds, reverse=True)))


def _may_be_named(
    search: _Search,
    naming: Naming,
    ranked: Sequence[Subset],
    fitted: dict[Subset, Candidate],
    first: Subset,
) -> bool:
    """Whether a formula leads all other hypotheses by the decisive odds and explains the rest.

    With the price of their lengths, which says what is simpler, and with that of effects alone: no
    name rests on being shorter to write.
    """
    candidate, scores = fitted[first], search.scores
    if not candidate.fit.converged or leaves_something(candidate.fit):
        return False
    own = set(candidate.ids)
    reference = search.answer.after
    others = [c for c in naming.tried if not own <= set(c.ids)]
    if any(e.id == LEARNED for e in reference.target.oscillator.effects):
        evidence = model_evidence(reference)
        others.append(Candidate(reference.target.oscillator.effects, reference, evidence))
    extra = {id(c): _extra(search, s) for s, c in fitted.items()}
    rivals = [(naming.log_odds(c), extra.get(id(c), 0.0)) for c in others]
    kinds = set(kinds_of(first, scores.terms))
    reached, length = naming.log_odds(candidate), _extra(search, first)
    scored = [s for s in ranked if not kinds <= set(kinds_of(s, scores.terms))]
    rivals += [(reached + s.log_odds - first.log_odds, _extra(search, s)) for s in scored]
    leads = [min(reached - odds, reached + length - odds - more) for odds, more in rivals]
    return min(leads, default=np.inf) > DECISIVE


def _extra(search: _Search, subset: Subset) -> float:
    """What a formula's length costs beyond the price of as many effects, nats."""
    cost = search.answer.naming.prior_cost
    return max(sum(_price(search, i) - cost for i in subset.terms), 0.0)


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


def _decided(answer: Answer, candidate: Candidate) -> Decision:
    """The decision with the formula's effects named; whole where all others of its model are."""
    before = answer.decision.effects
    known = {e.id for e in before}
    own = tuple(e for e in candidate.effects if is_formula(e) and e.id not in known)
    others = {e.id for e in candidate.effects} - {e.id for e in own}
    return Decision("named" if others <= known else "partly", (*before, *own))


def _listed(
    search: _Search,
    naming: Naming,
    heads: Sequence[FormulaClass],
    fitted: dict[Subset, Candidate],
) -> tuple[Formula, ...]:
    """The list, likeliest first; scored ones are set off as the fitted ones were, at least."""
    offset = min(naming.log_odds(c) - s.log_odds for s, c in fitted.items())
    terms = search.scores.terms
    classes = {s: h for h in heads for s in (h.best, *h.alike)}
    rows = []
    for subset, candidate in fitted.items():
        values = dict(zip(candidate.fit.names, candidate.fit.mode, strict=True))
        own = [terms[k] for k in subset.terms]
        sizes = tuple(float(values[f"{effect_id(t)}.size"]) for t in own)
        found = tuple(fitted_term(t, values) for t in own)
        alike = _alike(classes[subset], subset, terms)
        rows.append(_row(search, subset, (found, sizes), naming.log_odds(candidate), alike))
    for head in heads[: 2 * LISTED]:
        if not {head.best, *head.alike} & fitted.keys():
            own = [terms[k] for k in head.best.terms]
            alike = _alike(head, head.best, terms)
            odds = head.best.log_odds + offset
            row = _row(search, head.best, (tuple(own), head.best.sizes), odds, alike)
            rows.append(replace(row, refitted=False))
    rows.sort(key=lambda f: -f.log_odds)
    known = [naming.log_odds(c) for c in naming.tried if c not in fitted.values()]
    total = float(np.logaddexp.reduce([*known, *(f.log_odds for f in rows)]))
    return tuple(replace(f, probability=float(np.exp(f.log_odds - total))) for f in rows[:LISTED])


def _row(
    search: _Search,
    subset: Subset,
    found: tuple[tuple[Term, ...], tuple[float, ...]],
    log_odds: float,
    alike: tuple[str, ...],
) -> Formula:
    effects = tuple(_effect(search, k, a) for k, a in zip(subset.terms, subset.sizes, strict=True))
    peak = largest_force(search.scores.motions, *found)
    return Formula(*found, log_odds, 0.0, True, alike, effects, peak)


def _alike(head: FormulaClass, own: Subset, terms: Sequence[Term]) -> tuple[str, ...]:
    """Formulas of a class within the decisive odds that differ in more than their shapes."""
    known = {kinds_of(own, terms)}
    found: list[str] = []
    for subset in (head.best, *head.alike):
        kinds = kinds_of(subset, terms)
        if kinds not in known and subset.log_odds > own.log_odds - DECISIVE:
            known.add(kinds)
            found.append(formula_text([terms[i] for i in subset.terms]))
    return tuple(found[:ALIKE])


def fitted_term(term: Term, values: dict[str, float]) -> Term:
    """A term with the shape that a refit found."""
    own: dict[str, Any] = {n: float(values[f"{effect_id(term)}.{n}"]) for n in term.shapes}
    return replace(term, **own)


def formula_text(terms: Sequence[Term], *, angle: bool = False) -> str:
    """A sum of terms with letters for their sizes."""
    letters = "ABC"
    return " + ".join(f"{letters[i]} {t.text(angle=angle)}" for i, t in enumerate(terms))


def _seen_as(search: _Search, subset: Subset) -> Array:
    """Coefficients that the learned force would have if a formula were true."""
    return np.asarray(search.scores.seen[:, list(subset.terms)] @ np.array(subset.sizes))
