"""Sets of effects that the equation of motion along the measured motion asks for.

All sets come from the normal equations of `equation_error`: a beam of the best ones is extended by
one effect at a time. A set counts by what its least squares leave of the stretches, with the price
of every unknown (Schwarz 1978), shapes among them, and of every effect.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.diagnosis.equation_error import (
    EffectColumns,
    Path,
    base_columns,
    is_a_force,
    measured_paths,
    term_at,
    terms_of,
)
from bayesimpact.diagnosis.extend import extend
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect, Scales

Array = NDArray[np.float64]

Chosen = tuple[int, ...]
Known = tuple[Effect, Mapping[str, float]]
"""An effect with its shapes, `<effect>.<parameter>` -> value."""

BEAM = 40  # sets of a size that are extended


@dataclass(frozen=True, eq=False)
class EffectSet:
    """Effects with the parameters that the equation of motion asks for.

    Attributes
    ----------
    terms : one for every effect
    values : parameter -> value: sizes and shapes of the effects, the base model's, y0 and v0
    log_odds : over the base model, as far as this problem tells
    """

    terms: tuple[EffectColumns, ...]
    values: Mapping[str, float]
    log_odds: float

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects."""
        return tuple(term.effect for term in self.terms)


def shapes_of(fit: Fit, effect: Effect) -> dict[str, float]:
    """The values that a fit has found of what is no size of one of its effects."""
    own = {f"{effect.id}.{p.name}" for p in effect.parameters if not p.is_size}
    values = zip(fit.names, map(float, fit.mode), strict=True)
    return {name: value for name, value in values if name.split("[")[0] in own}


def _completed(chosen: EffectSet, fit: Fit, paths: Sequence[Path]) -> EffectSet:
    """With the gap, of which only the change is known, and the measured first states."""
    values = dict(chosen.values)
    if "g" in values:
        values["g"] += fit.value("g")
    for recording, path in zip(fit.target.oscillator.campaign.recordings, paths, strict=True):
        values |= {f"y0[{recording.name}]": path.y[0], f"v0[{recording.name}]": path.v[0]}
    return replace(chosen, values=values)


class LikelySets:
    """Sets of effects for a fit of the base model, by the equation of motion.

    Holds the normal equations of base model and terms, all columns scaled to norm one. There are no
    terms, and so no sets, where a reading is no displacement. In `flight` only what acts there has
    terms. Every set holds what the campaign declares and the effects of `known`: their shapes are
    known, but not their sizes.
    """

    def __init__(
        self,
        fit: Fit,
        effects: Sequence[Effect],
        scales: Scales,
        *,
        flight: bool = False,
        known: Sequence[Known] = (),
    ) -> None:
        o = fit.target.oscillator
        self.fit, self.scales, self.paths = fit, scales, measured_paths(fit, flight=flight)
        columns, targets, self.names = base_columns(fit, self.paths)
        base, target = np.concatenate(columns), np.concatenate(targets)
        told = base[:, 0].any() and o.reads_displacements and all(map(is_a_force, o.acting))
        seen = effects if told else ()
        declared = self._known([(e, shapes_of(fit, e)) for e in o.acting]) if told else []
        self.known = self._known(known) if told else []
        for term in (*declared, *self.known):
            base = np.column_stack([base, np.concatenate(term.columns)])
            self.names += term.names
        self.terms = terms_of(fit, seen, scales, self.paths)
        self.cost = float(np.log(2 * len(effects)))
        self.rows = max(sum(int(p.rows.kept.sum()) - 1 for p in self.paths), 1)
        blocks = [np.concatenate(term.columns) for term in self.terms]
        self.first = np.cumsum([base.shape[1], *(b.shape[1] for b in blocks)])
        every = np.column_stack([base, *blocks])
        size = np.linalg.norm(every, axis=0)
        self.size = np.where(size > 0, size, 1.0)
        scaled = every / self.size
        self.matrix, self.right = scaled.T @ scaled, scaled.T @ target
        self.whole = float(target @ target)
        self.base = [i for i in range(base.shape[1]) if size[i] > 0]
        self.every, self.target = every, target

    def _known(self, effects: Sequence[Known]) -> list[EffectColumns]:
        """Terms of effects with given shapes; those that the campaign declares have them in any
        target.
        """
        found = []
        for effect, shapes in effects:
            added = () if effect in self.fit.target.oscillator.acting else (effect,)
            target = extend(self.fit, added, self.scales)
            term = term_at(self.fit, target, effect, self.scales, shapes, self.paths)
            found += [] if term is None else [term]
        return found

    def columns(self, chosen: Sequence[int]) -> list[int]:
        """Of the base model and of the terms `chosen`."""
        own = [i for t in chosen for i in range(self.first[t], self.first[t + 1])]
        return [*self.base, *own]

    def solve(self, chosen: Sequence[int]) -> tuple[Array, float]:
        """Scaled unknowns of a set, and the log of what it leaves per stretch, at least 0."""
        at = self.columns(chosen)
        part = self.matrix[np.ix_(at, at)] + 1e-12 * np.eye(len(at))
        x = np.linalg.solve(part, self.right[at])
        left = self.whole - float(x @ self.right[at])
        return np.asarray(x), float(np.log(max(left / self.rows, 1.0)))

    def log_odds(self, chosen: Sequence[int]) -> float:
        """Of a set over no unknown at all; minus infinity for a stiffness k1, or a size that cannot
        be, below zero.
        """
        x, left = self.solve(chosen)
        unknowns = x.size - len(self.base) + sum(len(self.terms[t].shapes) for t in chosen)
        signs = [s for t in chosen for s in self.terms[t].one_sided]
        if x[0] <= 0.0 or np.any(x[len(self.base) :][signs] <= 0.0):
            return -np.inf
        price = 0.5 * unknowns * float(np.log(self.rows)) + self.cost * len(chosen)
        return -0.5 * self.rows * left - price

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
            found.append(self._set(best, reached - none))
        return [_completed(one, self.fit, self.paths) for one in found]

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

    def gains(self, ids: Collection[str]) -> dict[str, float]:
        """By how much every other effect that has a term would make a set likelier, nats."""
        if not self.terms:
            return {}
        held = self.shaped(ids)
        before, found = self.log_odds(held), dict[str, float]()
        for t in self._beside(held):
            own = self.terms[t].effect.id
            gain = self.log_odds((*held, t)) - before
            found[own] = max(found.get(own, -np.inf), gain)
        return found

    def shaped(self, ids: Collection[str]) -> Chosen:
        """The terms of those of some effects that have one, each at its likeliest shape beside the
        others.
        """
        every = [term.effect.id for term in self.terms]
        return self.refined([every.index(i) for i in ids if i in every])

    def refined(self, chosen: Sequence[int]) -> Chosen:
        """A set with the shape of each effect where it is likeliest beside the others, also between
        the points from which sets are chosen.
        """
        found = list(chosen)
        for k in (*range(len(found)), *range(len(found))):
            effect, rest = self.terms[found[k]].effect, (*found[:k], *found[k + 1 :])
            own = [t for t, term in enumerate(self.terms) if term.effect is effect]
            found[k] = max(own, key=lambda t: self.log_odds((*rest, t)))
        return tuple(found)

    def _beside(self, chosen: Sequence[int]) -> list[int]:
        """Terms that a set may take in."""
        held = [term.effect for term in (*self.known, *(self.terms[i] for i in chosen))]
        ids = {e.id for e in held}
        return [
            t
            for t, term in enumerate(self.terms)
            if term.on_grid
            and term.effect.id not in ids
            and all(term.effect.stands_beside(e) for e in held)
        ]

    def _set(self, chosen: Sequence[int], odds: float) -> EffectSet:
        x = self.solve(chosen)[0] / self.size[self.columns(chosen)]
        return self._filled([self.terms[t] for t in chosen], x, odds)

    def with_term(self, chosen: Chosen, term: EffectColumns, odds: float) -> EffectSet:
        """A set with one more term of its own, all sizes anew; `odds` as of sets."""
        columns = np.column_stack(
            [self.every[:, self.columns(chosen)], np.concatenate(term.columns)]
        )
        size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
        x = np.linalg.lstsq(columns / size, self.target, rcond=None)[0] / size
        own = [*(self.terms[t] for t in chosen), term]
        return _completed(self._filled(own, x, odds - self.log_odds(())), self.fit, self.paths)

    def _filled(self, own: Sequence[EffectColumns], x: Array, odds: float) -> EffectSet:
        """Terms with the values of all unknowns, and the `known` ones."""
        names = [*(self.names[i] for i in self.base), *(n for t in own for n in t.names)]
        values = dict(zip(names, map(float, x), strict=True))
        terms = (*self.known, *own)
        return EffectSet(terms, values | {n: v for t in terms for n, v in t.shapes.items()}, odds)
