"""A force of no effect that the equation of motion along the measured motion asks for.

Where the catalogue leaves most of a large misfit, every term of the grammar is put beside every
likely set of effects in the same least-squares problem (`likely_sets`), one column each and no
simulation. Effects that imitate such a force one after the other cost a search minutes, and what
they leave hides the rest.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.diagnosis.candidates.equation_error import Path, without_rest
from bayesimpact.diagnosis.candidates.likely_sets import LikelySets
from bayesimpact.diagnosis.candidates.term_sets import Chosen, EffectColumns, EffectSet
from bayesimpact.diagnosis.formulas.scores import REFINED, kind_prices, plausible_sizes, prices
from bayesimpact.diagnosis.thresholds import EXCESS
from bayesimpact.formula.grammar import Term
from bayesimpact.formula.law import effect_of, is_friction, starts_of
from bayesimpact.formula.library import library, local_starts, neighbours
from bayesimpact.formula.listed import listed_as
from bayesimpact.formula.responses import Along, forces_along
from bayesimpact.model.effects.effect import Effect, Scales

Array = NDArray[np.float64]
Prices = Mapping[tuple[object, ...], float]
"""Nats by the kind of a term."""

SEEN = 1e-4  # of a column's square that the others must leave, for its size to mean something
LIKELY = 7  # sets of every number of effects beside which terms are put: set by hand
BLOCK = 64  # terms at once, so that memory stays bounded


@dataclass(frozen=True, eq=False)
class _Beside:
    """A term beside a set of effects.

    log_odds : of both over no unknown at all, as those of sets
    left : of the square of all stretches
    """

    term: Term
    chosen: Chosen
    log_odds: float
    left: float


def sets_with_a_term(
    problem: LikelySets, most: int, own: Collection[str] = (), excess: float = EXCESS
) -> list[EffectSet]:
    """For none, one, ... and `most` - 1 effects the likeliest set of these and a term of the
    grammar, as far as it leaves `excess` times less than every set of up to `most` effects.

    Beside the likeliest sets of every number, effects by the ids `own` are one to begin with.
    """
    if not problem.terms:
        return []
    sets = [(), problem.shaped(own), *(c for level in problem.levels(most) for c in level[:LIKELY])]
    least = min(design(problem, problem.refined(chosen)).left for chosen in sets)
    reach = reach_of(problem.paths)
    listed = {t.effect.id for t in (*problem.terms, *problem.known)}
    terms = unlisted((*library(problem.scales, *reach), *local_starts(*reach)), listed)
    price = prices_by_kind(terms)
    columns = _columns(problem, terms)
    found = []
    for size in range(most):
        beside = [_best(problem, c, terms, columns, price) for c in sets if len(c) == size]
        best = max(beside, key=lambda one: one.log_odds, default=None)
        if best is not None and np.isfinite(best.log_odds):
            best = _refined(problem, best, price)
            if excess * max(best.left, problem.rows) < least:
                found.append(_with_term(problem, best, price))
    return found


def reach_of(paths: Sequence[Path]) -> tuple[float, float]:
    """Smallest and largest displacement of all paths, m."""
    low = min(float(path.y.min()) for path in paths)
    return low, max(float(path.y.max()) for path in paths)


def unlisted(terms: Sequence[Term], listed: Collection[str]) -> tuple[Term, ...]:
    """Terms that are none of the effects by the ids `listed`, nor a law with events of its own."""
    return tuple(t for t in terms if not is_friction(t) and listed_as(t) not in listed)


def prices_by_kind(terms: Sequence[Term]) -> Prices:
    """What a term of every kind costs, its shape free, nats."""
    return dict(zip((t.kind for t in terms), kind_prices(terms, prices(terms)), strict=True))


def _refined(problem: LikelySets, best: _Beside, price: Prices) -> _Beside:
    """With all shapes where they are likeliest, also between the points of their grids."""
    low, high = reach_of(problem.paths)
    for step in REFINED:
        chosen = problem.refined(best.chosen)
        near = neighbours(best.term, step, max(-low, high)) if best.term.shapes else []
        around = (best.term, *near)
        columns = _columns(problem, around)
        found = [_best(problem, c, around, columns, price) for c in {best.chosen, chosen}]
        best = max(best, *found, key=lambda one: one.log_odds)
    return best


@dataclass(frozen=True, eq=False)
class Design:
    """The columns of a set, orthonormal, and what they leave of the target and its square."""

    basis: Array
    rest: Array
    left: float


def design(problem: LikelySets, chosen: Chosen) -> Design:
    """Of the base model and the terms of a set."""
    columns = problem.every[:, problem.columns(chosen)]
    basis = np.linalg.qr(columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300))[0]
    rest = problem.target - basis @ (basis.T @ problem.target)
    return Design(basis, rest, float(rest @ rest))


def _best(
    problem: LikelySets, chosen: Chosen, terms: Sequence[Term], columns: Array, price: Prices
) -> _Beside:
    """The likeliest of some terms, with their `columns` (stretches, K), beside a set."""
    present = design(problem, chosen)
    beside = columns - present.basis @ (present.basis.T @ columns)
    square = np.einsum("nk,nk->k", beside, beside)
    whole = np.einsum("nk,nk->k", columns, columns)
    size = beside.T @ present.rest / np.maximum(square, 1e-300)
    told = (square > SEEN * whole) & (whole > 0.0)
    told &= (size > 0.0) | [t.energy != "dissipates" for t in terms]
    left = np.where(told, present.left - size * size * square, present.left)
    unknowns = np.array([1 + len(t.shapes) for t in terms])
    cost = 0.5 * unknowns * np.log(problem.rows) + [price[t.kind] for t in terms]
    before, after = (np.log(np.maximum(x / problem.rows, 1.0)) for x in (present.left, left))
    odds = problem.log_odds(chosen) + 0.5 * problem.rows * (before - after) - cost
    k = int(np.argmax(odds))
    return _Beside(terms[k], chosen, float(odds[k]), float(left[k]))


def _columns(problem: LikelySets, terms: Sequence[Term]) -> Array:
    """Whitened integrals of every term's force of unit size, (stretches, K); 0 where not finite."""
    parts = []
    for path in problem.paths:
        blocks = []
        for first in range(0, len(terms), BLOCK):
            forces = forces_along(_along(path), terms[first : first + BLOCK])
            blocks.append(without_rest(path, path.rows.integrals(forces).T))
        parts.append(np.concatenate(blocks, axis=1))
    columns = np.concatenate(parts)
    return np.where(np.isfinite(columns).all(axis=0), columns, 0.0)


def _along(path: Path) -> Along:
    return path.y, path.v, path.d, path.t


def _with_term(problem: LikelySets, best: _Beside, price: Prices) -> EffectSet:
    """The set with the term as an effect of its own, all sizes as the least squares have them."""
    beyond = max(price[best.term.kind] - problem.cost, 0.0)
    (effect,) = as_effects(problem.paths, problem.scales, [best.term], [beyond])
    columns = [
        without_rest(path, path.rows.integrals(forces_along(_along(path), [best.term])).T)
        for path in problem.paths
    ]
    name = f"{effect.id}.size"
    own = EffectColumns(effect, starts_of(best.term), (name,), tuple(columns), (False,))
    return problem.with_term(best.chosen, own, best.log_odds)


def as_effects(
    paths: Sequence[Path], scales: Scales, terms: Sequence[Term], prices: Sequence[float]
) -> list[Effect]:
    """Terms as effects, with what each costs beyond any effect, nats."""
    largest = np.zeros(len(terms))
    for path in paths:
        for first in range(0, len(terms), BLOCK):
            block = slice(first, first + BLOCK)
            forces = np.abs(forces_along(_along(path), terms[block]))
            largest[block] = np.maximum(largest[block], forces.max(axis=1))
    reach = max(float(np.abs(path.y).max()) for path in paths)
    found = []
    sizes = plausible_sizes(terms, largest, scales)
    for term, size, price in zip(terms, map(float, sizes), prices, strict=True):
        signed = term.energy != "dissipates"
        effect = effect_of(term, size, reach, scales.speed, signed=signed, angle=scales.angle)
        found.append(replace(effect, price=price))
    return found
