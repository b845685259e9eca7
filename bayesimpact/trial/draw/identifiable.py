"""Could anybody tell that an effect is there, beside everything else that is?

At the truth, every parameter of the full model is moved a little and the rig plays again: base
parameters, initial states, rest readings, sizes and shapes of all effects. What of an effect's
share of the readings no other parameter can imitate, to first order, has a norm; over the noise it
is the number of standard errors by which the effect is away from nothing (Wald's test with all
other parameters free). No model and no fit of the package is used, only the rig.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.trial.draw.designs import DrawnRig
from bayesimpact.trial.draw.sensitivity import clean_readings
from bayesimpact.trial.draw.strong_effects import Chosen
from bayesimpact.trial.rig.recordings import Effects, Parameters

Array = NDArray[np.float64]
Columns = list[Array]

STEP = 1e-4  # relative change of a parameter: far above the integrator's error, far below a cycle
OWN_BASE = {"contact_damping_per_case": "c2", "gap_per_recording": "g"}
"""Effects that take the place of a base parameter, which is then the mean of theirs."""


@dataclass(frozen=True)
class _Moved:
    """How the readings change with one effect: by size (times the size itself), and by all else."""

    whole: Array
    size_columns: Columns
    shape_columns: Columns


def stand_outs(
    design: DrawnRig, found: Sequence[Chosen], rivals: Mapping[str, Parameters] | None = None
) -> tuple[float, ...]:
    """Norm, in m (or rad), of what only this effect explains of the readings, one per effect.

    Parameters
    ----------
    found : all effects of the truth
    rivals : effects, small, that may imitate the forces from outside the catalogue as well
    """
    effects = {c.effect: c.form.build(c.size) for c in found}
    still = clean_readings(design, effects)
    play = _Player(design, effects, still)
    moved = [_moved(play, c, effects) for c in found]
    shared = _base_columns(play, found)
    extra = [play.changed(design, {**effects, name: p}) for name, p in (rivals or {}).items()]
    result = []
    for i, one in enumerate(moved):
        others = [m for j, m in enumerate(moved) if j != i]
        columns = [*shared, *one.shape_columns]
        columns += [c for m in others for c in (*m.size_columns, *m.shape_columns)]
        if found[i].outside:
            columns += extra
        result.append(left_of(one.whole, columns))
    return tuple(result)


def left_of(response: Array, columns: Columns) -> float:
    """Norm of what no combination of `columns` can make of `response`, (N,)."""
    matrix = np.stack([c / np.linalg.norm(c) for c in columns if np.any(c)], axis=1)
    basis, values, _ = np.linalg.svd(matrix, full_matrices=False)
    basis = basis[:, values > 1e-9 * values[0]]
    for _ in range(2):  # the second pass removes the rounding of the first
        response = response - basis @ (basis.T @ response)
    return float(np.linalg.norm(response))


@dataclass(frozen=True, eq=False)
class _Player:
    """Plays the rig again with something changed."""

    design: DrawnRig
    effects: Effects
    still: tuple[Array, ...]

    def changed(self, design: DrawnRig, effects: Effects) -> Array:
        """Change of all readings, (N,)."""
        return np.concatenate(self.parts(design, effects))

    def parts(self, design: DrawnRig, effects: Effects) -> list[Array]:
        """The same per recording."""
        readings = clean_readings(design, effects)
        return [a - b for a, b in zip(readings, self.still, strict=True)]

    def blocks(self, parts: Sequence[Array], keys: Sequence[str]) -> Columns:
        """One column per key, for recordings that share a key move together."""
        return [
            np.concatenate([p if k == key else 0 * p for p, k in zip(parts, keys, strict=True)])
            for key in dict.fromkeys(keys)
        ]


def _base_columns(play: _Player, found: Sequence[Chosen]) -> Columns:
    design, rig = play.design, play.design.rig
    names = [r.name for r in design.releases]
    cases = [r.case for r in design.releases]
    replaced = [OWN_BASE[c.effect] for c in found if c.effect in OWN_BASE]
    columns = []
    for name in ("c1", "k1", *(("c2", "g") if rig.k2 else ())):
        if name not in replaced:  # the columns of the effect in its place add up to it
            value = getattr(rig, name) * (1 + STEP)
            columns.append(play.changed(_with(design, **{name: value}), play.effects))
    if rig.k2:
        stiffer = {case: k * (1 + STEP) for case, k in rig.k2.items()}
        columns += play.blocks(play.parts(_with(design, k2=stiffer), play.effects), cases)
    for name, step in (("y0", STEP * design.amplitude), ("v0", STEP * design.speed)):
        releases = tuple(replace(r, **{name: getattr(r, name) + step}) for r in design.releases)
        moved = play.parts(replace(design, releases=releases), play.effects)
        columns += play.blocks(moved, names)
    return columns + play.blocks([np.ones(s.size) for s in play.still], names)


def _with(design: DrawnRig, **changes: object) -> DrawnRig:
    return replace(design, rig=replace(design.rig, **changes))  # type: ignore[arg-type]


def _moved(play: _Player, one: Chosen, effects: Effects) -> _Moved:
    """Columns of one effect; one that is on or off counts by its whole change."""
    numbers = effects[one.effect]
    design = play.design
    if one.form.start == 0:
        without = {k: v for k, v in effects.items() if k != one.effect}
        whole = play.changed(design, without)
        return _Moved(whole, [whole], [])
    null = one.form.build(0.0)
    whole = np.zeros(sum(s.size for s in play.still))
    sizes: Columns = []
    shapes: Columns = []
    for name, value in numbers.items():
        if isinstance(value, Mapping):
            keys = [r.case if r.case in value else r.name for r in design.releases]
            step = STEP * max(abs(v) for v in value.values())
            raised: float | dict[str, float] = {k: v + step for k, v in value.items()}
            away = {k: v - null[name][k] for k, v in value.items()}  # type: ignore[index]
        else:
            keys = ["" for _ in design.releases]
            step = STEP * abs(value)
            raised, away = value + step, {"": value - null[name]}  # type: ignore[operator]
        if step == 0:
            continue
        parts = play.parts(design, {**effects, one.effect: {**numbers, name: raised}})
        columns = play.blocks([p / step for p in parts], keys)
        if not any(away.values()):
            shapes += columns
            continue
        sizes += columns
        for key, column in zip(dict.fromkeys(keys), columns, strict=True):
            whole += away[key] * column
        if one.effect in OWN_BASE:  # the base parameter: all of them together
            shapes.append(np.sum(columns, axis=0))
    return _Moved(whole, sizes, shapes)
