"""The formulas that are fitted in full: rounds of those that score best, without what is idle.

Scores are linear, and where the misfit is large they put longer formulas first. What these need is
seen once they are fitted; the next round fits those whose scores still speak against the likeliest.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from bayesimpact.diagnosis.budget import Budget
from bayesimpact.diagnosis.formulas.listing import formula_text
from bayesimpact.diagnosis.formulas.refits import (
    Question,
    kind_ids,
    kinds_of,
    refit_candidates,
    refitted,
    without_idle,
)
from bayesimpact.diagnosis.measurement.repetition import residual_repetition
from bayesimpact.diagnosis.refits.refit import Candidate
from bayesimpact.diagnosis.selection.outcome import Selection
from bayesimpact.diagnosis.thresholds import DECISIVE
from bayesimpact.formula.classes import FormulaClass
from bayesimpact.formula.evidence import Subset
from bayesimpact.formula.grammar import Term

ROUNDS = 3  # of refits, set by hand: the first ones show how far the scores of the others may err


@dataclass(frozen=True, eq=False)
class Refits:
    """Formulas that were fitted in full.

    Attributes
    ----------
    begun : as they were begun
    fitted : what is left of them without idle terms and effects, of every kind the likeliest
    selection : the search with these models
    late : whether time left any out
    """

    begun: frozenset[Subset]
    fitted: Mapping[Subset, Candidate]
    selection: Selection
    late: bool


def fitted_formulas(
    question: Question, selection: Selection, progress: Callable[[str], None], budget: Budget
) -> Refits:
    """Formulas fitted in full, as far as time allows: what the search has met and those that score
    best, then those whose scores still speak against the likeliest, `ROUNDS` times at most.
    """
    terms = question.scores.terms
    begun: set[Subset] = set()
    ends: dict[Subset, tuple[Subset, Candidate]] = {}
    found = Refits(frozenset(), {}, selection, False)
    todo = refit_candidates(question.ranked, terms)
    if question.met is not None:
        kinds = kinds_of(question.met, terms)
        todo = [question.met, *(s for s in todo if kinds_of(s, terms) != kinds)]
    for _ in range(ROUNDS):
        fitted, late = _fitted(question, todo, progress, budget)
        begun |= fitted.keys()
        ends |= {s: (s, c) for s, c in fitted.items()}
        whole = joined(selection, [c for _, c in ends.values()])
        if fitted and not late:
            progress("leaving out what formulas make idle")
            ends |= without_idle(question, whole, fitted, budget)
            late = not budget.may_go_on()  # and so some may be compared as they were begun
        best = _different(ends.values(), whole, terms)
        found = Refits(frozenset(begun), best, joined(selection, list(best.values())), late)
        todo = [] if late or not fitted else _still_open(question, found)
        if not todo:
            break
    return found


def _still_open(question: Question, found: Refits) -> list[Subset]:
    """Formulas to fit whose scores come within the decisive odds of the likeliest that is fitted,
    though they do not hold it.
    """
    terms = question.scores.terms
    first = max(found.fitted, key=lambda s: found.selection.log_odds(found.fitted[s]))
    rivals = scored_rivals(question, found, first)
    near = [s for s in rivals if s.log_odds > first.log_odds - DECISIVE]
    return refit_candidates(near, terms)


def scored_rivals(question: Question, found: Refits, first: Subset) -> list[Subset]:
    """Formulas that do not hold a fitted one, as far as none of their kind was fitted."""
    terms = question.scores.terms
    kinds = set(kinds_of(first, terms))
    known = {kinds_of(s, terms) for s in (*found.begun, *found.fitted)}
    others = ((s, kinds_of(s, terms)) for s in question.ranked)
    return [s for s, own in others if not kinds <= set(own) and own not in known]


def _fitted(
    question: Question,
    chosen: Sequence[Subset],
    progress: Callable[[str], None],
    budget: Budget,
) -> tuple[dict[Subset, Candidate], bool]:
    """Formulas fitted in full as far as time allows, and whether that left any out."""
    fitted: dict[Subset, Candidate] = {}
    for subset in chosen:
        if not budget.may_go_on():
            return fitted, True
        terms = [question.scores.terms[k] for k in subset.terms]
        text = formula_text(terms, angle=question.scales.angle)
        progress(f"fitting the formula {text}")
        found = refitted(question, subset)
        if found is not None:
            fitted[subset] = found
    return fitted, False


def is_told(head: FormulaClass, found: Refits, terms: Sequence[Term]) -> bool:
    """Whether a class of formulas is told by what is left of one of them."""
    reduced = found.begun - found.fitted.keys()
    own = {kinds_of(s, terms) for s in found.fitted.keys() - found.begun}
    return bool(reduced & {head.best, *head.alike}) or kinds_of(head.best, terms) in own


def _different(
    found: Iterable[tuple[Subset, Candidate]], selection: Selection, terms: Sequence[Term]
) -> dict[Subset, Candidate]:
    """The likeliest fit of formulas of one kind, as likely by its scores as the best of them."""
    kinds: dict[tuple[str, ...], list[tuple[Subset, Candidate]]] = {}
    for one in found:
        kinds.setdefault(kinds_of(one[0], terms), []).append(one)
    best = {}
    for same in kinds.values():
        subset, candidate = max(same, key=lambda one: selection.log_odds(one[1]))
        best[replace(subset, log_odds=max(s.log_odds for s, _ in same))] = candidate
    return best


def joined(selection: Selection, candidates: Sequence[Candidate]) -> Selection:
    """The search with further models, of those of one kind the likeliest; samples are counted by
    the best residual of all, for one of them may leave nothing.
    """
    tried = (*selection.tried, *candidates)
    best = min(tried, key=lambda c: c.fit.reduced_chi2)
    found = replace(selection, repetition=residual_repetition(best.fit), beside=None)
    likeliest: dict[frozenset[str], Candidate] = {}
    for candidate in sorted(tried, key=found.log_odds, reverse=True):
        likeliest.setdefault(frozenset(kind_ids(candidate)), candidate)
    return replace(found, tried=tuple(likeliest.values()))
