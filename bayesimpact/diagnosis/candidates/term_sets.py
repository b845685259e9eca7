"""Sets of terms that a linear least-squares problem asks for.

All sets come from its normal equations: a beam of the best ones is extended by one term at a time.
A set counts by what its least squares leave, with the price of every unknown (Schwarz 1978), shapes
among them, and of every effect.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesimpact.formula.law import is_formula
from bayesimpact.model.effects.effect import Effect

Array = NDArray[np.float64]

Chosen = tuple[int, ...]

BEAM = 40  # sets of a size that are extended


@dataclass(frozen=True, eq=False)
class EffectSet:
    """Effects with the parameters that a problem asks for.

    Attributes
    ----------
    effects : all of them
    values : parameter -> value: sizes and shapes of the effects, the base model's, first states
    log_odds : over the model that the problem is posed about, as far as this problem tells
    """

    effects: tuple[Effect, ...]
    values: Mapping[str, float]
    log_odds: float


@dataclass(frozen=True, eq=False)
class EffectColumns:
    """One effect at one point of its shape grid.

    Attributes
    ----------
    names : of its size parameters; its id for what it adds where they are at their null
    columns : per recording (stretches or samples, k), whitened, per unit of them
    one_sided : which of them cannot be negative, (k,)
    on_grid : whether the shape is one of the scores' grid; sets are chosen from those, for on a
        finer one a law with a free power comes nearer to the errors of another law than that
        itself. No term of the grammar is: those stand beside sets
    """

    effect: Effect
    shapes: Mapping[str, float]
    names: tuple[str, ...]
    columns: tuple[Array, ...]
    one_sided: tuple[bool, ...]
    on_grid: bool = True


class TermSets:
    """Sets of terms by their least squares: the normal equations of what every set has and of the
    terms, all columns scaled to norm one.

    terms : what a set may hold
    names, columns : of the unknowns of every set (N, b), at stretches or samples
    target : (N,) what is to be explained
    rows : independent numbers of it
    cost : nats of an effect, for multiplicity
    """

    known: Sequence[EffectColumns] = ()

    def __init__(
        self,
        terms: Sequence[EffectColumns],
        names: Sequence[str],
        columns: Array,
        target: Array,
        rows: int,
        cost: float,
    ) -> None:
        self.terms, self.names, self.rows, self.cost = terms, names, rows, cost
        blocks = [np.concatenate(term.columns) for term in terms]
        self.first = np.cumsum([columns.shape[1], *(b.shape[1] for b in blocks)])
        every = np.column_stack([columns, *blocks])
        size = np.linalg.norm(every, axis=0)
        self.size = np.where(size > 0, size, 1.0)
        self.matrix = every.T @ every / np.outer(self.size, self.size)
        self.right, self.whole = every.T @ target / self.size, float(target @ target)
        self.base = [i for i in range(columns.shape[1]) if size[i] > 0]

    def columns(self, chosen: Sequence[int]) -> list[int]:
        """Of the base model and of the terms `chosen`."""
        return [*self.base, *(i for t in chosen for i in self._places(t))]

    def solve(self, chosen: Sequence[int]) -> tuple[Array, float]:
        """Scaled unknowns of a set, and the log of what it leaves per row, at least 0."""
        at = self.columns(chosen)
        part = self.matrix[np.ix_(at, at)] + 1e-12 * np.eye(len(at))
        x = np.linalg.solve(part, self.right[at])
        left = self.whole - float(x @ self.right[at])
        return np.asarray(x), float(np.log(max(left / self.rows, 1.0)))

    def is_possible(self, x: Array) -> bool:
        """Whether a set may have such scaled unknowns, those of one-sided terms apart."""
        return True

    def log_odds(self, chosen: Sequence[int]) -> float:
        """Of a set over no unknown at all; minus infinity for what cannot be, such as a size below
        zero.
        """
        x, left = self.solve(chosen)
        signs = [s for t in chosen for s in self.terms[t].one_sided]
        if not self.is_possible(x) or np.any(x[len(self.base) :][signs] <= 0.0):
            return -np.inf
        return -0.5 * self.rows * left - self.price(chosen)

    def price(self, chosen: Sequence[int]) -> float:
        """Of the unknowns of a set's terms, shapes among them, and of its effects, nats."""
        terms = [self.terms[t] for t in chosen]
        unknowns = sum(len(term.names) + len(term.shapes) for term in terms)
        price = 0.5 * unknowns * float(np.log(self.rows))
        return price + sum(self.cost + term.effect.price for term in terms)

    def best(self, most: int) -> list[EffectSet]:
        """The likeliest sets of one, two, ... effects; each is likelier than all smaller ones."""
        found, none = list[EffectSet](), self.log_odds(()) if self.terms else 0.0
        reached = none
        for ranked in self.levels(most):
            best = self.refined(ranked[0])
            odds = self.log_odds(best)
            if odds <= reached:
                break
            reached = odds
            found.append(self.set_of(best, reached - none))
        return found

    def set_of(self, chosen: Sequence[int], odds: float) -> EffectSet:
        """The effects of some terms with the values of all unknowns."""
        raise NotImplementedError

    def levels(self, most: int) -> Iterator[list[Chosen]]:
        """Sets of one, two, ... up to `most` effects, of each number `BEAM` of the likeliest at
        most, in that order; every one extends one of the last number.
        """
        beam: list[Chosen] = [()]
        for _ in range(most if self.terms else 0):
            level: dict[frozenset[str], tuple[float, Chosen]] = {}
            for chosen in beam:
                for t in self._beside(chosen):
                    ids = frozenset(self.terms[i].effect.id for i in (*chosen, t))
                    odds = self.log_odds((*chosen, t))
                    if odds > level.get(ids, (-np.inf, ()))[0]:
                        level[ids] = odds, (*chosen, t)
            beam = [c for _, c in sorted(level.values(), key=lambda one: -one[0])[:BEAM]]
            if not beam:
                return
            yield beam

    def gains(self, ids: Collection[str] = (), *, with_terms: bool = False) -> dict[str, float]:
        """By how much every other effect that has a term would make a set likelier, nats; with
        terms of the grammar, or without.
        """
        if not self.terms:
            return {}
        present = self.shaped(ids)
        before, found = self.log_odds(present), dict[str, float]()
        for t in self._beside(present, with_terms):
            own = self.terms[t].effect.id
            gain = self.log_odds((*present, t)) - before
            found[own] = max(found.get(own, -np.inf), gain)
        return found

    def likeness(self, ids: Collection[str], effect: str) -> dict[str, float]:
        """Of what an effect explains beside a set, the share that every other one explains as well
        with sizes that it may have, at its best shape; {} where no term stands for the effect.
        """
        chosen = self.shaped([*ids, effect])
        own = [t for t in chosen if self.terms[t].effect.id == effect]
        if not own:
            return {}
        present = [t for t in chosen if t not in own]
        sizes = self.solve((*present, *own))[0][len(self.columns(present)) :]
        place = self._places(own[0])
        found = dict[str, float]()
        for t in self._beside(present):
            other, key = self._places(t), self.terms[t].effect.id
            if key == effect:
                continue
            at = [*place, *other]
            left = self._beside_columns(self.columns(present), at)
            asked, cross = left[: len(place), : len(place)], left[len(place) :, : len(place)]
            right, whole = cross @ sizes, float(sizes @ asked @ sizes)
            square = left[len(place) :, len(place) :] + 1e-12 * np.eye(len(other))
            needed = np.linalg.solve(square, right)
            if np.any(needed[list(self.terms[t].one_sided)] <= 0.0):
                continue
            share = float(right @ needed) / max(whole, 1e-300)
            found[key] = max(found.get(key, 0.0), share)
        return found

    def _places(self, t: int) -> list[int]:
        """Columns of a term."""
        return list(range(self.first[t], self.first[t + 1]))

    def _beside_columns(self, present: Sequence[int], at: Sequence[int]) -> Array:
        """Products of columns, less what those `present` explain of them."""
        part = self.matrix[np.ix_(present, present)] + 1e-12 * np.eye(len(present))
        known = self.matrix[np.ix_(present, at)]
        return np.asarray(self.matrix[np.ix_(at, at)] - known.T @ np.linalg.solve(part, known))

    def shaped(self, ids: Collection[str]) -> Chosen:
        """The terms of those of some effects that have one, each at its likeliest shape beside the
        others.
        """
        every = [term.effect.id for term in self.terms]
        return self.refined([every.index(i) for i in ids if i in every])

    def refined(self, chosen: Sequence[int]) -> Chosen:
        """A set with the shape of each effect where it is likeliest beside the others, also between
        the points from which sets are chosen, in the order of `terms`.
        """
        found = list(chosen)
        for k in (*range(len(found)), *range(len(found))):
            effect, rest = self.terms[found[k]].effect, (*found[:k], *found[k + 1 :])
            own = [t for t, term in enumerate(self.terms) if term.effect is effect]
            found[k] = max(own, key=lambda t: self.log_odds((*rest, t)))
        return tuple(sorted(found))  # in one order, whichever way the search came by

    def _beside(self, chosen: Sequence[int], with_terms: bool = False) -> list[int]:
        """Terms that a set may take in, of the grammar as well or not."""
        present = [term.effect for term in (*self.known, *(self.terms[i] for i in chosen))]
        ids = {e.id for e in present}
        return [
            t
            for t, term in enumerate(self.terms)
            if (term.on_grid or (with_terms and is_formula(term.effect)))
            and term.effect.id not in ids
            and all(term.effect.stands_beside(e) for e in present)
        ]
