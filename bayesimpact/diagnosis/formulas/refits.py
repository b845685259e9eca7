"""Which formulas are refitted in full, and how."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bayesimpact.diagnosis.budget import Budget
from bayesimpact.diagnosis.formulas.scores import (
    FormulaScores,
    formula_scores,
    formulas_met,
    kind_prices,
)
from bayesimpact.diagnosis.measurement.repetition import residual_repetition
from bayesimpact.diagnosis.refits.evidence import model_evidence
from bayesimpact.diagnosis.refits.extend import difference_steps, extend, transfer
from bayesimpact.diagnosis.refits.refit import (
    ITERATIONS,
    TOLERANCE,
    Candidate,
    Enough,
    best_start,
    step_sizes,
    without,
)
from bayesimpact.diagnosis.refits.sizes import loss_without
from bayesimpact.diagnosis.residual_force.learned import LEARNED
from bayesimpact.diagnosis.selection.outcome import Selection, leaves_something
from bayesimpact.diagnosis.thresholds import DECISIVE
from bayesimpact.formula.classes import FormulaClass, formula_classes, term_classes
from bayesimpact.formula.evidence import Subset, single_log_odds, subsets
from bayesimpact.formula.grammar import Term
from bayesimpact.formula.law import effect_id, effect_of, is_formula, kind_id, starts_of
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.mode import find_mode
from bayesimpact.model.effects.effect import Effect, Scales

Array = NDArray[np.float64]

REFITTED = 6  # formulas of different kinds
MOST_SHAPES = 3  # of one formula: with more of them an ascent takes half a minute, and rarely rests
SURE = 20.0  # times the decisive odds by which a linear loss is surely no less: set by hand
BEHIND = 60.0  # nats by which a score may underrate a formula that a refit would put first


@dataclass(frozen=True, eq=False)
class Question:
    """What refits need to know.

    Attributes
    ----------
    reference : the fit that the terms were scored on
    cost : nats per effect
    ranked : formulas by their scores, likeliest first
    """

    reference: Fit
    cost: float
    scores: FormulaScores
    scales: Scales
    ranked: Sequence[Subset]

    @cached_property
    def met(self) -> Subset | None:
        """The formula that the reference has; None without one, or where it does nothing that the
        other parameters do not.
        """
        found, terms = formulas_met(self.reference), self.scores.terms
        if not found or not all(t in terms for t in found):
            return None
        sizes = {terms.index(t): size for t, size in found.items()}
        at = tuple(sorted(sizes))
        alone = float(np.sum(single_log_odds(self.scores.problem)[list(at)]))
        return self.scored.get(at, Subset(at, tuple(sizes[i] for i in at), alone))

    @cached_property
    def heads(self) -> Sequence[FormulaClass]:
        """The formulas, in classes that the recordings do not tell apart."""
        problem, terms = self.scores.problem, self.scores.terms
        return formula_classes(self.ranked, terms, term_classes(problem.information, problem.price))

    @cached_property
    def scored(self) -> dict[tuple[int, ...], Subset]:
        """Formulas by their terms."""
        return {s.terms: s for s in self.ranked}

    @cached_property
    def kind_prices(self) -> Array:
        """Price of every term with its shape free, (K,)."""
        return kind_prices(self.scores.terms, self.scores.problem.price)

    @property
    def others(self) -> tuple[Effect, ...]:
        """Effects of the model beside the force that formulas stand for: learned, or a formula."""
        effects = self.reference.density.oscillator.effects
        return tuple(e for e in effects if not (e.id == LEARNED or is_formula(e)))


def asked_about(reference: Fit, cost: float, scales: Scales) -> Question | None:
    """What a fit says of all formulas; None where it says nothing in favour of any."""
    scores = formula_scores(reference, scales, repetition=residual_repetition(reference))
    if not scores.terms:
        return None
    question = Question(reference, cost, scores, scales, subsets(scores.problem))
    return question if any(h.best.log_odds > 0.0 for h in question.heads) else None


def refit_candidates(ranked: Sequence[Subset], terms: Sequence[Term]) -> list[Subset]:
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
        if kinds in known or sum(len(terms[i].shapes) for i in subset.terms) > MOST_SHAPES:
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


def kind_ids(candidate: Candidate) -> set[str]:
    """Ids of a model's effects, formulas without the shapes at which they were found."""
    return set(map(kind_id, candidate.ids))


def refitted(question: Question, subset: Subset) -> Candidate | None:
    """A formula fitted in full, from where the scores expect it; None where it cannot stand beside
    the model's effects.
    """
    scores, reference = question.scores, question.reference
    terms = [scores.terms[i] for i in subset.terms]
    own = tuple(effect_for(question, i, a) for i, a in zip(subset.terms, subset.sizes, strict=True))
    if len({e.id for e in (*own, *question.others)}) < len(own) + len(question.others):
        return None
    if not all(e.stands_beside(o) for e in own for o in (*question.others, *own) if e is not o):
        return None
    effects = (*question.others, *own)
    density = extend(reference, effects, question.scales)
    names = density.oscillator.layout.names
    shapes = {name: value for t in terms for name, value in starts_of(t).items()}
    unshifted = transfer(reference, density.oscillator.layout, effects, question.scales, shapes)
    predicted = unshifted.copy()
    at, sizes = list(subset.terms), np.array(subset.sizes)
    shift = scores.shift - scores.absorbed[:, at] @ sizes
    for name, by in zip(scores.names, shift, strict=True):
        predicted[names.index(name)] += by
    steps = step_sizes(names, density.oscillator.acting, question.scales, ())
    sd = 1.0 / np.sqrt(np.diag(scores.problem.information)[at])
    for term, size, error in zip(terms, sizes, sd, strict=True):
        predicted[names.index(f"{effect_id(term)}.size")] = size
        steps[f"{effect_id(term)}.size"] = float(error)
    step = difference_steps(reference, density, steps)
    start = best_start(density, unshifted, predicted, step)
    fit = find_mode(density, start, steps=step, tolerance=TOLERANCE, max_iterations=ITERATIONS)
    return Candidate(effects, fit, model_evidence(fit))


def without_idle(
    question: Question, selection: Selection, fitted: Mapping[Subset, Candidate], budget: Budget
) -> dict[Subset, tuple[Subset, Candidate]]:
    """Every fitted formula without the terms and effects that its model needs no more, as far as
    time allows.

    What was fitted before may only have imitated the force that a formula is, and terms of a
    formula what the scores, which are linear, did not see of another. All formulas that may come
    within the decisive odds of the likeliest model of the search `selection` are treated alike.
    """
    first = selection.log_odds(selection.tried[0])
    idle = max(len(c.effects) for c in fitted.values())
    least = first - DECISIVE - question.cost * idle
    found = {}
    for subset, candidate in fitted.items():
        own = subset
        while selection.log_odds(candidate) >= least and budget.may_go_on():
            smaller = _without_one(question, selection, own, candidate)
            if smaller is None:
                break
            own, candidate = smaller
        found[subset] = own, candidate
    return found


def _without_one(
    question: Question, selection: Selection, subset: Subset, candidate: Candidate
) -> tuple[Subset, Candidate] | None:
    """The likeliest model with a term or an effect less; None where that is decisively worse, or
    leaves more than noise and the candidate does not.
    """
    own = {effect_id(question.scores.terms[k]): i for i, k in enumerate(subset.terms)}
    enough = Enough(selection.goal(selection.log_odds(candidate) - DECISIVE))
    smaller = []
    for effect in candidate.effects:
        rest = subset
        if loss_without(candidate.fit, effect) > SURE * DECISIVE * selection.repetition:
            continue
        if effect.id in own:
            if len(own) == 1:
                continue
            rest = _shortened(question, subset, own[effect.id])
        smaller.append((rest, without(candidate, effect, question.scales, enough=enough)))
    best = max(smaller, key=lambda one: selection.log_odds(one[1]), default=None)
    if best is None or selection.log_odds(candidate) - selection.log_odds(best[1]) >= DECISIVE:
        return None
    complete = leaves_something(best[1].fit) and not leaves_something(candidate.fit)
    return None if complete else best


def _shortened(question: Question, subset: Subset, i: int) -> Subset:
    """A formula without its term i, as it was scored, or as likely as the whole formula less the
    price of that term: the scores of other formulas are compared with it.
    """
    terms = subset.terms[:i] + subset.terms[i + 1 :]
    sizes = subset.sizes[:i] + subset.sizes[i + 1 :]
    odds = subset.log_odds + float(question.scores.problem.price[subset.terms[i]])
    rest = Subset(terms, sizes, odds)
    return max(rest, question.scored.get(terms, rest), key=lambda s: s.log_odds)


def effect_for(question: Question, i: int, size: float) -> Effect:
    """The effect of term i; a dissipative one whose size came out negative may have either sign."""
    scores, scales = question.scores, question.scales
    term = scores.terms[i]
    reach = max(float(np.abs(y).max()) for y in scores.fit.displacements)
    signed = term.energy != "dissipates" or size < 0
    effect = effect_of(
        term, float(scores.size[i]), reach, scales.speed, signed=signed, angle=scales.angle
    )
    return replace(effect, price=length_price(question, i))


def length_price(question: Question, i: int) -> float:
    """What the length of term i costs beyond the price of an effect, nats."""
    return max(float(question.kind_prices[i]) - question.cost, 0.0)
