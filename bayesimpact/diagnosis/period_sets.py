"""Sets of effects that periods ahead ask for, from the states that are read (multiple shooting).

The equation of motion along the measured motion (`likely_sets`) sees no state that a simulation
alone knows (a mode, the mass of an obstacle), and little of impacts that few samples show. Over one
period a simulation is in step with its recording however large the misfit is: there its derivatives
say what every effect would explain, sets of them from one linear problem about a model.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.diagnosis.directions import is_periodic, shape_points, size_parameters
from bayesimpact.diagnosis.extend import (
    difference_steps,
    extend,
    owner,
    replaced_slot,
    transfer,
)
from bayesimpact.diagnosis.refit import step_sizes
from bayesimpact.diagnosis.term_sets import EffectColumns, EffectSet, TermSets
from bayesimpact.inference.fit import Fit, Target
from bayesimpact.inference.multiple_shooting import MultipleShooting, multiple_shooting
from bayesimpact.model.effects.effect import Effect, Scales
from bayesimpact.model.parameters import is_added

Array = NDArray[np.float64]

STEP = 1e-3  # of an effect's plausible size
INVISIBLE = 1e-6  # of the noise: rounding of the simulation, not physics


class PeriodSets(TermSets):
    """Sets of effects beside those of a fit, each by what periods ahead leave.

    There are no terms, and so no sets, where recordings are no displacements.
    """

    def __init__(self, fit: Fit, effects: Sequence[Effect], scales: Scales) -> None:
        self.fit, self.scales, cost = fit, scales, float(np.log(2 * len(effects)))
        o = fit.target.oscillator
        ahead = multiple_shooting(fit.target.likelihood, fit.mode)
        if ahead is None:
            super().__init__((), (), np.zeros((1, 0)), np.zeros(1), 1, cost)
            return
        sizes = step_sizes(o.layout.names, o.acting, scales, ())
        parts = ahead.linearise(fit.mode, difference_steps(fit, fit.target, sizes))
        moving = np.setdiff1d(np.arange(fit.mode.size), o.layout.roles("noise"))
        columns = [np.zeros((p.residual.size, fit.mode.size)) for p in parts]
        for whole, part in zip(columns, parts, strict=True):
            whole[:, part.columns] = part.jacobian
        level = ahead.noise.level
        super().__init__(
            _terms(fit, ahead, effects, scales),
            [o.layout.names[i] for i in moving],
            np.concatenate(columns)[:, moving] / level,
            np.concatenate([p.residual for p in parts]) / level,
            int(ahead.sizes.sum()),
            cost,
        )

    def is_possible(self, x: Array) -> bool:
        """Whether the stiffness k1 stays positive."""
        k = self.names.index("k1") if "k1" in self.names else -1
        if k not in self.base:
            return True
        change = x[self.base.index(k)] / self.size[k]
        return bool(self.fit.value("k1") + change > 0.0)

    def set_of(self, chosen: Sequence[int], odds: float) -> EffectSet:
        """The effects of the fit and of some terms, with the values of all unknowns."""
        x = self.solve(chosen)[0] / self.size[self.columns(chosen)]
        terms = [self.terms[t] for t in chosen]
        names = [*(self.names[i] for i in self.base), *(n for t in terms for n in t.names)]
        changes = dict(zip(names, map(float, x), strict=True))
        effects = (*self.fit.target.oscillator.effects, *(t.effect for t in terms))
        shapes = {name: value for t in terms for name, value in t.shapes.items()}
        layout = extend(self.fit, effects, self.scales).oscillator.layout
        start = transfer(self.fit, layout, effects, self.scales, shapes)
        values = {}
        for name, value in zip(layout.names, map(float, start), strict=True):
            values[name] = value + changes.get(name, 0.0)
            if is_added(name):  # what all of them share is known as the base parameter's
                slot = replaced_slot(*owner(effects, name))
                values[name] += 0.0 if slot is None else changes.get(slot, 0.0)
        return EffectSet(effects, values, odds)


def _terms(
    fit: Fit, ahead: MultipleShooting, effects: Sequence[Effect], scales: Scales
) -> list[EffectColumns]:
    """What every effect that a fit lacks does to periods ahead, at every point of its shape grid;
    none of a periodic one, whose frequency has no grid.
    """
    acting = fit.target.oscillator.acting
    missed = ahead.residuals(fit.mode[None])
    found = []
    for effect in effects:
        lacking = effect.id not in {e.id for e in acting}
        beside = lacking and all(map(effect.stands_beside, acting))
        if is_periodic(effect) or not beside or not effect.admissible(scales):
            continue
        own = (*fit.target.oscillator.effects, effect)
        target = extend(fit, own, scales)
        for shapes in shape_points(effect, scales):
            theta = transfer(fit, target.oscillator.layout, own, scales, shapes)
            names, points, steps = _steps(target, effect, theta, scales)
            left = replace(ahead, oscillator=target.oscillator).residuals(points)
            columns = tuple(
                np.column_stack([before[0] - own[0], (own[0] - own[1:]).T / steps])
                / ahead.noise.level
                for before, own in zip(missed, left, strict=True)
            )
            found += _seen(effect, shapes, names, columns)
    return found


def _steps(
    target: Target, effect: Effect, theta: Array, scales: Scales
) -> tuple[list[str], Array, Array]:
    """Names of an effect's sizes (k,), points (1 + k, d), of which each but the first, theta, has
    one of them larger, and by how much.
    """
    sizes = size_parameters(target, effect)
    steps = np.array([STEP * parameter.scale(scales) for _, parameter in sizes])
    points = np.repeat(theta[None], 1 + len(sizes), axis=0)
    for i, (name, _) in enumerate(sizes):
        points[1 + i, target.oscillator.layout.index(name)] += steps[i]
    return [name for name, _ in sizes], points, steps


def _seen(
    effect: Effect, shapes: Mapping[str, float], names: Sequence[str], columns: Sequence[Array]
) -> list[EffectColumns]:
    """The term of an effect, of those columns that are anything; none where one is not finite."""
    every = (effect.id, *names)
    signs = [
        p.lower == p.null and replaced_slot(effect, p) is None
        for p in effect.parameters
        if p.is_size
    ]
    one_sided = (True, *(signs[0] for _ in names))
    kept = [i for i in range(len(every)) if any(np.abs(c[:, i]).max() > INVISIBLE for c in columns)]
    if not kept or not all(np.isfinite(c).all() for c in columns):
        return []
    shown = tuple(c[:, kept] for c in columns)
    seen = tuple(every[i] for i in kept)
    return [EffectColumns(effect, shapes, seen, shown, tuple(one_sided[i] for i in kept))]
