"""Sets of effects that the equation of motion along the measured motion asks for.

Every force along it is a column of one least-squares problem, see `equation_error`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.candidates.equation_error import (
    Path,
    base_columns,
    is_a_force,
    measured_paths,
    term_at,
    terms_of,
)
from bayesimpact.diagnosis.candidates.term_sets import Chosen, EffectColumns, EffectSet, TermSets
from bayesimpact.diagnosis.refits.extend import extend
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect, Scales
from bayesimpact.model.oscillator import Oscillator

Array = NDArray[np.float64]

Known = tuple[Effect, Mapping[str, float]]
"""An effect with its shapes, `<effect>.<parameter>` -> value."""


def shapes_of(fit: Fit, effect: Effect) -> dict[str, float]:
    """The values that a fit has found of what is no size of one of its effects."""
    own = {f"{effect.id}.{p.name}" for p in effect.parameters if p not in effect.scored}
    values = zip(fit.names, map(float, fit.mode), strict=True)
    return {name: value for name, value in values if name.split("[")[0] in own}


def _tells(oscillator: Oscillator) -> bool:
    """Whether every recording is a displacement, or can be integrated to one."""
    free = not oscillator.campaign.stop and oscillator.inputs is None
    return oscillator.reads_displacements or free


class LikelySets(TermSets):
    """Sets of effects for a fit of the base model, by the equation of motion.

    There are no terms, and so no sets, where readings can be made no displacement. In `flight` only
    what acts there has terms. Every set holds what the campaign declares and the effects of
    `known`: their shapes are known, but not their sizes. Other `recordings` of the same motions may
    stand in for the fit's.
    """

    def __init__(
        self,
        fit: Fit,
        effects: Sequence[Effect],
        scales: Scales,
        *,
        flight: bool = False,
        known: Sequence[Known] = (),
        recordings: Sequence[Recording] | None = None,
    ) -> None:
        o, cost = fit.density.oscillator, float(np.log(2 * len(effects)))
        self.fit, self.scales, self.paths = fit, scales, list[Path]()
        self.every, self.target = np.zeros((1, 0)), np.zeros(1)
        if not (_tells(o) and all(map(is_a_force, o.acting))):
            super().__init__((), (), self.every, self.target, 1, cost)
            return
        along = fit if recordings is None else fit.with_recordings(recordings)
        self.paths = measured_paths(along, flight=flight)
        columns, targets, names = base_columns(along, self.paths)
        base, density = np.concatenate(columns), np.concatenate(targets)
        told = bool(base[:, 0].any())
        declared = self._known([(e, shapes_of(fit, e)) for e in o.acting]) if told else []
        self.known = self._known(known) if told else []
        for term in (*declared, *self.known):
            base = np.column_stack([base, np.concatenate(term.columns)])
            names += term.names
        rows = max(sum(int(p.rows.kept.sum()) - 1 for p in self.paths), 1)
        terms = terms_of(fit, effects if told else (), scales, self.paths)
        super().__init__(terms, names, base, density, rows, cost)
        blocks = [np.concatenate(term.columns) for term in terms]
        self.every, self.target = np.column_stack([base, *blocks]), density

    def _known(self, effects: Sequence[Known]) -> list[EffectColumns]:
        """Terms of effects with given shapes; those that the campaign declares have them in any
        target.
        """
        found = []
        for effect, shapes in effects:
            added = () if effect in self.fit.density.oscillator.acting else (effect,)
            density = extend(self.fit, added, self.scales)
            term = term_at(self.fit, density, effect, self.scales, shapes, self.paths)
            found += [] if term is None else [term]
        return found

    def is_possible(self, x: Array) -> bool:
        """Whether the stiffness k1, the first unknown, is positive."""
        return bool(x[0] > 0.0)

    def set_of(self, chosen: Sequence[int], odds: float) -> EffectSet:
        """The effects of some terms with the values of all unknowns."""
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
        return self._filled(own, x, odds - self.log_odds(()))

    def _filled(self, own: Sequence[EffectColumns], x: Array, odds: float) -> EffectSet:
        """Effects of terms, with the `known` ones, and the values of all unknowns: the gap, of
        which only the change is one, and the measured first states too.
        """
        names = [*(self.names[i] for i in self.base), *(n for t in own for n in t.names)]
        values = dict(zip(names, map(float, x), strict=True))
        values |= {n: v for t in (*self.known, *own) for n, v in t.shapes.items()}
        if "g" in values:
            values["g"] += self.fit.value("g")
        recordings = self.fit.density.oscillator.campaign.recordings
        for recording, path in zip(recordings, self.paths, strict=True):
            values |= {f"y0[{recording.name}]": path.y[0], f"v0[{recording.name}]": path.v[0]}
        return EffectSet(tuple(t.effect for t in (*self.known, *own)), values, odds)
