"""A harmonic force that the equation of motion asks for beside sets of effects.

With a stop, a force that is slower than the motion has few periods in a recording, and what a
simulation leaves of a large misfit is no line. Along the measured motion (`likely_sets`) it is a
sine and a cosine of one frequency in every recording, whatever the motion does meanwhile: two
columns each, at every frequency of a grid.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bayesimpact.diagnosis.equation_error import Path, without_rest
from bayesimpact.diagnosis.likely_sets import LikelySets
from bayesimpact.diagnosis.likely_terms import LIKELY, Design, design
from bayesimpact.diagnosis.periodic import FLIGHT_REACH, LINE_PERIODS
from bayesimpact.diagnosis.term_sets import Chosen, EffectColumns, EffectSet
from bayesimpact.diagnosis.thresholds import EXCESS
from bayesimpact.model.effects.effect import Effect
from bayesimpact.model.parameters import instance_name

Array = NDArray[np.float64]

SPACING = 0.5  # of a grid of frequencies, in reciprocals of the longest recording
ENTRIES = 20_000_000  # of all sines and cosines at stretches that are held: 160 MB
FINER = (0.2, 0.04)  # of the spacing: around the best frequency, five steps to either side


@dataclass(frozen=True, eq=False)
class _Line:
    """A harmonic force beside a set of effects.

    frequency : Hz
    log_odds : of both over no unknown at all, as those of sets
    left : of the square of all stretches
    """

    frequency: float
    chosen: Chosen
    log_odds: float
    left: float


def sets_with_a_line(
    problem: LikelySets, effect: Effect, most: int, own: Collection[str] = ()
) -> list[EffectSet]:
    """For none, one, ... and `most` - 1 effects the likeliest set of these and the harmonic force
    `effect`, as far as it leaves `EXCESS` times less than every set of up to `most` effects.

    Beside the likeliest sets of every number, effects by the ids `own` are one to begin with.
    """
    grid = _frequencies(problem)
    if not problem.terms or not grid.size:
        return []
    sets = [(), problem.shaped(own), *(c for level in problem.levels(most) for c in level[:LIKELY])]
    sets = [problem.refined(chosen) for chosen in sets]
    least = min(design(problem, chosen).left for chosen in sets)
    waves = [_waves(path, grid) for path in problem.paths]
    found = []
    for size in range(most):
        beside = [_best(problem, c, grid, waves) for c in sets if len(c) == size]
        best = max(beside, key=lambda one: one.log_odds, default=None)
        if best is not None and np.isfinite(best.log_odds):
            best = _refined(problem, best, float(grid[1] - grid[0]))
            if EXCESS * max(best.left, problem.rows) < least:
                found.append(_with_line(problem, best, effect))
    return found


def _frequencies(problem: LikelySets) -> Array:
    """A grid, Hz: from a few periods in the longest recording on, as far as a force moves a free
    mass, or as memory allows.
    """
    duration = max((float(path.t[-1] - path.t[0]) for path in problem.paths), default=0.0)
    if duration <= 0.0:
        return np.zeros(0)
    lowest, highest = LINE_PERIODS / duration, FLIGHT_REACH * problem.scales.natural_frequency
    held = 2 * sum(path.rows.target.size for path in problem.paths)
    count = min(int((highest - lowest) * duration / SPACING), ENTRIES // held)
    return np.asarray(lowest + SPACING / duration * np.arange(max(count, 0)), dtype=np.float64)


def _waves(path: Path, frequencies: Array) -> Array:
    """Whitened integrals of minus a sine and minus a cosine of one newton: (stretches, F, 2)."""
    rows = path.rows
    weights = (rows.phi, rows.slope, rows.bend)[rows.order]
    angular, dt = 2 * np.pi * frequencies, float(path.t[1] - path.t[0])
    gain = np.exp(1j * angular[:, None] * dt * np.arange(weights.size)) @ weights
    begun = path.t[:: rows.hop][: rows.target.size]
    turns = np.exp(1j * angular * begun[:, None]) * gain
    both = -np.stack([turns.imag, turns.real], axis=-1) * rows.kept[:, None, None]
    return without_rest(path, both.reshape(begun.size, -1)).reshape(both.shape)


def _best(problem: LikelySets, chosen: Chosen, frequencies: Array, waves: Sequence[Array]) -> _Line:
    """The likeliest of some frequencies, with their `waves` in every recording, beside a set."""
    held = design(problem, chosen)
    left = held.left - _explained(held, waves)
    unknowns = 2 * len(waves) + 1
    cost = 0.5 * unknowns * float(np.log(problem.rows)) + problem.cost
    before, after = (np.log(np.maximum(x / problem.rows, 1.0)) for x in (held.left, left))
    odds = problem.log_odds(chosen) + 0.5 * problem.rows * (before - after) - cost
    k = int(np.argmax(odds))
    return _Line(float(frequencies[k]), chosen, float(odds[k]), float(left[k]))


def _explained(held: Design, waves: Sequence[Array]) -> Array:
    """What a sine and a cosine in every recording explain beside a set, per frequency (F,)."""
    ends = np.cumsum([0, *(one.shape[0] for one in waves)])
    parts = [slice(a, b) for a, b in pairwise(ends)]
    pairs = list(zip(waves, parts, strict=True))
    score = np.concatenate([np.einsum("nfi,n->fi", w, held.rest[at]) for w, at in pairs], axis=1)
    shared = np.concatenate(
        [np.einsum("nfi,nb->fbi", w, held.basis[at], optimize=True) for w, at in pairs], axis=2
    )
    information = -np.einsum("fbi,fbj->fij", shared, shared, optimize=True)
    for r, one in enumerate(waves):
        at = slice(2 * r, 2 * r + 2)
        information[:, at, at] += np.einsum("nfi,nfj->fij", one, one, optimize=True)
    size = np.sqrt(np.maximum(np.einsum("fii->fi", information), 1e-300))
    scaled = information / (size[:, :, None] * size[:, None, :]) + 1e-9 * np.eye(size.shape[1])
    numbers = np.linalg.solve(scaled, (score / size)[..., None])[..., 0]
    return np.asarray(np.einsum("fi,fi->f", numbers, score / size))


def _refined(problem: LikelySets, best: _Line, spacing: float) -> _Line:
    """With all shapes and the frequency where they are likeliest, also between their grids."""
    for step in FINER:
        around = best.frequency + step * spacing * np.arange(-5.0, 6.0)
        around = np.asarray(around[around > 0.0], dtype=np.float64)
        waves = [_waves(path, around) for path in problem.paths]
        best = max(best, _best(problem, best.chosen, around, waves), key=lambda one: one.log_odds)
    return best


def _with_line(problem: LikelySets, best: _Line, effect: Effect) -> EffectSet:
    """The set with the force: one amplitude, root mean square over the recordings, and in every one
    a phase, as the least squares have them.
    """
    recordings = [r.name for r in problem.fit.target.oscillator.campaign.recordings]
    waves = [_waves(path, np.array([best.frequency]))[:, 0] for path in problem.paths]
    columns = []
    for r, one in enumerate(waves):
        own = np.zeros((one.shape[0], 2 * len(waves)))
        own[:, 2 * r : 2 * r + 2] = one
        columns.append(own)
    names = tuple(f"{part}[{name}]" for name in recordings for part in ("sine", "cosine"))
    shapes = {instance_name(effect, effect.parameter("frequency"), None): best.frequency}
    term = EffectColumns(effect, shapes, names, tuple(columns), (False,) * len(names))
    found = problem.with_term(best.chosen, term, best.log_odds)
    values = dict(found.values)
    parts = np.array([[values.pop(f"{part}[{n}]") for part in ("sine", "cosine")]
                      for n in recordings])  # fmt: skip
    size = float(np.sqrt(np.mean(np.sum(parts**2, axis=1))))
    values[instance_name(effect, effect.parameter("amplitude"), None)] = size
    for name, (sine, cosine) in zip(recordings, parts, strict=True):
        angle = float(np.arctan2(cosine, sine) % (2 * np.pi))
        values[instance_name(effect, effect.parameter("phase"), name)] = angle
    return EffectSet(found.effects, values, found.log_odds)
