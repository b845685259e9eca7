"""Formulas with their odds, as a list for people."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.short_repr import short_repr
from bayesimpact.diagnosis.formulas.refits import Question, effect_for, kind_ids, kinds_of
from bayesimpact.diagnosis.refits.refit import Candidate
from bayesimpact.diagnosis.selection.outcome import Selection
from bayesimpact.diagnosis.thresholds import DECISIVE
from bayesimpact.formula.classes import FormulaClass
from bayesimpact.formula.evidence import Subset
from bayesimpact.formula.grammar import Term
from bayesimpact.formula.law import effect_id
from bayesimpact.formula.responses import largest_force
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect

Array = NDArray[np.float64]

LISTED = 20
ALIKE = 3


@dataclass(frozen=True, eq=False)
class Formula:
    """One formula with its odds.

    Attributes
    ----------
    terms, sizes : its terms, shapes as found, and their sizes as `Term.unit` says
    log_odds : against the base model, on the scale of `Selection.log_odds`
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

    __repr__ = short_repr


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
    fit : of the likeliest formula that was fitted in full
    """

    ranked: tuple[Formula, ...]
    reference: Fit
    named: bool
    seen_as: Array
    fit: Fit

    __repr__ = short_repr


def listed(
    question: Question,
    selection: Selection,
    heads: Sequence[FormulaClass],
    fitted: Mapping[Subset, Candidate],
) -> tuple[Formula, ...]:
    """The list, likeliest first; scored ones are set off as the fitted ones were, at least."""
    offset = min(selection.log_odds(c) - s.log_odds for s, c in fitted.items())
    terms = question.scores.terms
    classes = {s: h for h in heads for s in (h.best, *h.alike)}
    rows = []
    for subset, candidate in fitted.items():
        values = dict(zip(candidate.fit.names, candidate.fit.mode, strict=True))
        own = [terms[k] for k in subset.terms]
        sizes = tuple(float(values[f"{effect_id(t)}.size"]) for t in own)
        found = tuple(fitted_term(t, values) for t in own)
        head = classes.get(subset, FormulaClass(subset, subset.log_odds, ()))
        alike = _alike(question, head, subset)
        rows.append(_row(question, subset, (found, sizes), selection.log_odds(candidate), alike))
    for head in heads[: 2 * LISTED]:
        if head.best.log_odds > 0.0 and not {head.best, *head.alike} & fitted.keys():
            own = [terms[k] for k in head.best.terms]
            alike = _alike(question, head, head.best)
            odds = head.best.log_odds + offset
            row = _row(question, head.best, (tuple(own), head.best.sizes), odds, alike)
            rows.append(replace(row, refitted=False))
    rows.sort(key=lambda f: -f.log_odds)
    holding = [kind_ids(c) for c in fitted.values()]
    others = [c for c in selection.tried if not any(ids <= kind_ids(c) for ids in holding)]
    known = [
        selection.log_odds(c) for c in others
    ]  # what holds a formula does not speak against it
    total = float(np.logaddexp.reduce([*known, *(f.log_odds for f in rows)]))
    return tuple(replace(f, probability=float(np.exp(f.log_odds - total))) for f in rows[:LISTED])


def _row(
    question: Question,
    subset: Subset,
    found: tuple[tuple[Term, ...], tuple[float, ...]],
    log_odds: float,
    alike: tuple[str, ...],
) -> Formula:
    effects = tuple(
        effect_for(question, k, a) for k, a in zip(subset.terms, subset.sizes, strict=True)
    )
    peak = largest_force(question.scores.motions, *found)
    return Formula(*found, log_odds, 0.0, True, alike, effects, peak)


def _alike(question: Question, head: FormulaClass, own: Subset) -> tuple[str, ...]:
    """Formulas of a class within the decisive odds that differ in more than their shapes."""
    terms, angle = question.scores.terms, question.scales.angle
    known = {kinds_of(own, terms)}
    found: list[str] = []
    for subset in (head.best, *head.alike):
        kinds = kinds_of(subset, terms)
        if kinds not in known and subset.log_odds > own.log_odds - DECISIVE:
            known.add(kinds)
            found.append(formula_text([terms[i] for i in subset.terms], angle=angle))
    return tuple(found[:ALIKE])


def fitted_term(term: Term, values: dict[str, float]) -> Term:
    """A term with the shape that a refit found."""
    own: dict[str, Any] = {n: float(values[f"{effect_id(term)}.{n}"]) for n in term.shapes}
    return replace(term, **own)


def formula_text(terms: Sequence[Term], *, angle: bool = False) -> str:
    """A sum of terms with letters for their sizes."""
    letters = "ABC"
    return " + ".join(f"{letters[i]} {t.text(angle=angle)}" for i, t in enumerate(terms))
