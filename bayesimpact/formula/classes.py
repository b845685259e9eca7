"""Formulas that the recordings cannot tell apart, merged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesimpact.formula.evidence import Subset
from bayesimpact.formula.grammar import Term

Array = NDArray[np.float64]

ALIKE = 0.98  # cosine between the whitened responses of two terms that count as one


@dataclass(frozen=True)
class FormulaClass:
    """A formula and others that are as good as the same.

    Attributes
    ----------
    best : the likeliest of them
    log_odds : of all of them together
    alike : the others, likeliest first
    """

    best: Subset
    log_odds: float
    alike: tuple[Subset, ...]


def term_classes(information: Array, price: Array) -> NDArray[np.int64]:
    """Class of every term, (K,): the number of the simplest term that it nearly equals."""
    unit = np.sqrt(np.maximum(np.diag(information), 1e-300))
    cosine = np.abs(information / np.outer(unit, unit))
    found = np.full(unit.size, -1, dtype=np.int64)
    for i in np.argsort(price, kind="stable"):
        if found[i] < 0:
            found[(cosine[i] > ALIKE) & (found < 0)] = i
            found[i] = i
    return found


def formula_classes(
    ranked: Sequence[Subset], terms: Sequence[Term], classes: NDArray[np.int64]
) -> list[FormulaClass]:
    """Subsets, best first, merged: by the classes of their terms, or by terms of one kind that
    differ in the numbers of their shapes alone.
    """
    heads: dict[tuple[object, ...], int] = {}
    members: list[list[Subset]] = []
    for subset in ranked:
        keys = (
            ("class", *sorted(int(classes[i]) for i in subset.terms)),
            ("kind", *sorted(repr(terms[i].kind) for i in subset.terms)),
        )
        known = [heads[key] for key in keys if key in heads]
        head = known[0] if known else len(members)
        if not known:
            members.append([])
        members[head].append(subset)
        for key in keys:
            heads.setdefault(key, head)
    return [
        FormulaClass(m[0], float(np.logaddexp.reduce([s.log_odds for s in m])), tuple(m[1:]))
        for m in members
    ]
