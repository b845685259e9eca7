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

from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.candidates.term_sets import EffectColumns, EffectSet, TermSets
from bayesimpact.diagnosis.refits.extend import (
    difference_steps,
    extend,
    owner,
    replaced_slot,
    transfer,
)
from bayesimpact.diagnosis.refits.refit import step_sizes
from bayesimpact.diagnosis.score_test.directions import (
    is_periodic,
    shape_points,
    size_parameters,
    size_steps,
)
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.initial.multiple_shooting import MultipleShooting, multiple_shooting
from bayesimpact.model.effects.effect import Effect, EffectParameter, Scales
from bayesimpact.model.parameters import is_added

Array = NDArray[np.float64]

INVISIBLE = 1e-6  # of the noise, at that step: rounding of the simulation, not physics


class PeriodSets(TermSets):
    """Sets of effects beside those of a fit, each by what periods ahead leave.

    There are no terms, and so no sets, where recordings tell no period. Terms of the `grammar` are
    in none of them, but may stand beside one (`period_terms`). Other `recordings` of the same
    motions may stand in for the fit's.
    """

    def __init__(
        self,
        fit: Fit,
        effects: Sequence[Effect],
        scales: Scales,
        grammar: Sequence[Effect] = (),
        recordings: Sequence[Recording] | None = None,
    ) -> None:
        self.fit, self.scales, cost = fit, scales, float(np.log(2 * len(effects)))
        fit = fit if recordings is None else fit.with_recordings(recordings)
        o = fit.density.oscillator
        ahead = multiple_shooting(fit.density.likelihood, fit.mode)
        self.starts = ahead.starts if ahead is not None else ()
        if ahead is None:
            super().__init__((), (), np.zeros((1, 0)), np.zeros(1), 1, cost)
            return
        sizes = step_sizes(o.layout.names, o.acting, scales, ())
        parts = ahead.linearise(fit.mode, difference_steps(fit, fit.density, sizes))
        moving = np.setdiff1d(np.arange(fit.mode.size), o.layout.roles("noise"))
        columns = [part.whole(fit.mode.size) for part in parts]
        level = ahead.noise.level
        super().__init__(
            [
                *_terms(fit, ahead, effects, scales),
                *(replace(t, on_grid=False) for t in _terms(fit, ahead, grammar, scales)),
            ],
            [o.layout.names[i] for i in moving],
            np.concatenate(columns)[:, moving] / level,
            np.concatenate([p.residual for p in parts]) / level,
            int(ahead.sizes.sum()),
            cost,
        )
        self.terms = [replace(term, columns=()) for term in self.terms]  # the samples are many

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
        effects = (*self.fit.density.oscillator.effects, *(t.effect for t in terms))
        shapes = {name: value for t in terms for name, value in t.shapes.items()}
        oscillator = extend(self.fit, effects, self.scales).oscillator
        layout = oscillator.layout
        start = transfer(self.fit, layout, effects, self.scales, shapes)
        values = {}
        for name, value in zip(layout.names, map(float, start), strict=True):
            values[name] = value + changes.get(name, 0.0)
            if is_added(name):  # what all of them share is known as the base parameter's
                slot = replaced_slot(*owner(oscillator.acting, name))
                values[name] += 0.0 if slot is None else changes.get(slot, 0.0)
        return EffectSet(effects, values, odds)


def _terms(
    fit: Fit, ahead: MultipleShooting, effects: Sequence[Effect], scales: Scales
) -> list[EffectColumns]:
    """What every effect that a fit lacks does to periods ahead, at every point of its shape grid;
    none of a periodic one, whose frequency has no grid.
    """
    acting = fit.density.oscillator.acting
    missed = ahead.residuals(fit.mode[None])
    found = []
    for effect in effects:
        lacking = effect.id not in {e.id for e in acting}
        beside = lacking and all(map(effect.stands_beside, acting))
        if is_periodic(effect) or not beside or not effect.admissible(scales):
            continue
        own = (*fit.density.oscillator.effects, effect)
        density = extend(fit, own, scales)
        for shapes in shape_points(effect, scales):
            theta = transfer(fit, density.oscillator.layout, own, scales, shapes)
            points, steps = size_steps(density, effect, theta, scales)
            left = replace(ahead, oscillator=density.oscillator).residuals(points)
            changes = [
                np.column_stack([before[0] - rest[0], (rest[0] - rest[1:]).T]) / ahead.noise.level
                for before, rest in zip(missed, left, strict=True)
            ]
            sizes = size_parameters(density, effect)
            found += _seen(effect, shapes, sizes, changes, np.array([1.0, *steps]))
    return found


def _seen(
    effect: Effect,
    shapes: Mapping[str, float],
    sizes: Sequence[tuple[str, EffectParameter]],
    changes: Sequence[Array],
    steps: Array,
) -> list[EffectColumns]:
    """The term of an effect from what it changes at its null and by `steps` of its sizes (1 + k,),
    per recording (n, 1 + k); none where nothing is seen of it, or it is not finite.
    """
    names = [effect.id, *(name for name, _ in sizes)]
    one_sided = [True, *(p.lower == p.null and not replaced_slot(effect, p) for _, p in sizes)]
    kept = [i for i in range(len(names)) if any(np.abs(c[:, i]).max() > INVISIBLE for c in changes)]
    if not kept or not all(np.isfinite(c).all() for c in changes):
        return []
    columns = tuple(c[:, kept] / steps[kept] for c in changes)
    seen, signs = tuple(names[i] for i in kept), tuple(one_sided[i] for i in kept)
    return [EffectColumns(effect, shapes, seen, columns, signs)]
