"""A harmonic force that the equation of motion asks for beside sets of effects.

With a stop, a force that is slower than the motion has few periods in a recording, and what a
simulation leaves of a large misfit is no line. Along the measured motion (`likely_sets`) it is a
sine and a cosine of one frequency in every recording, whatever the motion does meanwhile: two
columns each, at every frequency of a grid.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import islice, pairwise

import numpy as np
from numpy.typing import NDArray

from bayesimpact.diagnosis.candidates.equation_error import Path, without_rest
from bayesimpact.diagnosis.candidates.likely_sets import LikelySets
from bayesimpact.diagnosis.candidates.likely_terms import LIKELY, SEEN, Design, design
from bayesimpact.diagnosis.candidates.term_sets import Chosen, EffectColumns, EffectSet
from bayesimpact.diagnosis.score_test.frequency_scan import FLIGHT_REACH, LINE_PERIODS
from bayesimpact.diagnosis.thresholds import EXCESS
from bayesimpact.model.effects.effect import Effect
from bayesimpact.model.parameters import instance_name

Array = NDArray[np.float64]

SPACING = 0.5  # of a grid of frequencies, in reciprocals of the longest recording
AT_ONCE = 64  # frequencies, so that memory stays bounded
PEAKS = 5  # frequencies of every number of effects that are refined
FINER = (0.2, 0.04)  # of the spacing: around each of them, five steps to either side
ROWS = 3  # stretches for every unknown, at least


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
    spacing, grid = _frequencies(problem)
    unknowns = len(problem.base) + 2 * len(problem.paths) + 1
    if not grid.size or problem.rows < ROWS * unknowns:
        return []
    levels = (c for level in problem.levels(most) for c in level[:LIKELY])
    sets = [problem.refined(c) for c in dict.fromkeys([(), problem.shaped(own), *levels])]
    least = min(design(problem, chosen).left for chosen in sets)
    smaller = [chosen for chosen in sets if len(chosen) < most]
    explained = _explained(problem, smaller, grid)
    found = []
    for size in range(most):
        at = [(c, row) for c, row in zip(smaller, explained, strict=True) if len(c) == size]
        tried = (_refined(problem, line, spacing) for line in _peaks(problem, at, grid))
        likely = sorted(tried, key=lambda one: -one.log_odds)
        best = (line for line in likely if EXCESS * max(line.left, problem.rows) < least)
        possible = (_with_line(problem, line, effect) for line in best)
        found += [one for one in islice(filter(None, possible), 1)]
    return found


def _frequencies(problem: LikelySets) -> tuple[float, Array]:
    """Spacing and a grid, Hz: from a few periods in the longest recording on, as far as a force
    moves a free mass.
    """
    duration = max((float(path.t[-1] - path.t[0]) for path in problem.paths), default=0.0)
    if duration <= 0.0:
        return 0.0, np.zeros(0)
    lowest, highest = LINE_PERIODS / duration, FLIGHT_REACH * problem.scales.natural_frequency
    spacing = SPACING / duration
    return spacing, np.arange(lowest, highest, spacing)


def _peaks(
    problem: LikelySets, explained: Sequence[tuple[Chosen, Array]], grid: Array
) -> list[_Line]:
    """The likeliest local maxima over a grid of frequencies, beside any of some sets."""
    lines = list[_Line]()
    for chosen, row in explained:
        padded = np.pad(row, 1, constant_values=-np.inf)
        peaks = np.flatnonzero((row >= padded[:-2]) & (row >= padded[2:]))
        strongest = peaks[np.argsort(row[peaks])[-PEAKS:]]
        lines += [_line(problem, chosen, float(grid[k]), float(row[k])) for k in strongest]
    return sorted(lines, key=lambda one: -one.log_odds)[:PEAKS]


def _line(problem: LikelySets, chosen: Chosen, frequency: float, explained: float) -> _Line:
    left = max(design(problem, chosen).left - explained, 0.0)
    unknowns = 2 * len(problem.paths) + 1
    price = problem.price(chosen) + problem.cost + 0.5 * unknowns * float(np.log(problem.rows))
    odds = -0.5 * problem.rows * float(np.log(max(left / problem.rows, 1.0))) - price
    return _Line(frequency, chosen, odds, left)


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


def _explained(problem: LikelySets, sets: Sequence[Chosen], frequencies: Array) -> Array:
    """What a sine and a cosine in every recording explain beside each of some sets, (S, F)."""
    designs = [design(problem, chosen) for chosen in sets]
    found = np.empty((len(sets), frequencies.size))
    for first in range(0, frequencies.size, AT_ONCE):
        block = slice(first, first + AT_ONCE)
        waves = [_waves(path, frequencies[block]) for path in problem.paths]
        for row, present in zip(found, designs, strict=True):
            row[block] = _explained_beside(present, waves)
    return found


def _explained_beside(present: Design, waves: Sequence[Array]) -> Array:
    """The same beside one set, of `waves` of some frequencies (F,); nothing by what the set's
    columns explain of these.
    """
    ends = np.cumsum([0, *(one.shape[0] for one in waves)])
    pairs = [(w, slice(a, b)) for w, (a, b) in zip(waves, pairwise(ends), strict=True)]
    score = np.concatenate([np.einsum("nfi,n->fi", w, present.rest[at]) for w, at in pairs], axis=1)
    shared = np.concatenate(
        [np.einsum("nfi,nb->fbi", w, present.basis[at], optimize=True) for w, at in pairs], axis=2
    )
    information = -np.einsum("fbi,fbj->fij", shared, shared, optimize=True)
    whole = np.empty(score.shape)
    for r, one in enumerate(waves):
        at = slice(2 * r, 2 * r + 2)
        own = np.einsum("nfi,nfj->fij", one, one, optimize=True)
        information[:, at, at] += own
        whole[:, at] = np.einsum("fii->fi", own)
    left = np.einsum("fii->fi", information)
    told = (left > SEEN * whole) & (whole > 0.0)
    size = np.sqrt(np.where(told, left, np.inf))
    scaled = information / (size[:, :, None] * size[:, None, :])
    scaled += (1e-9 + ~told)[:, :, None] * np.eye(size.shape[1])
    numbers = np.linalg.solve(scaled, (score / size)[..., None])[..., 0]
    return np.asarray(np.einsum("fi,fi->f", numbers, score / size))


def _refined(problem: LikelySets, best: _Line, spacing: float) -> _Line:
    """With the frequency where it is likeliest, also between those of the grid."""
    for step in FINER:
        around = best.frequency + step * spacing * np.arange(-5.0, 6.0)
        around = np.asarray(around[around > 0.0], dtype=np.float64)
        (row,) = _explained(problem, [best.chosen], around)
        k = int(np.argmax(row))
        near = _line(problem, best.chosen, float(around[k]), float(row[k]))
        best = max(best, near, key=lambda one: one.log_odds)
    return best


def _with_line(problem: LikelySets, best: _Line, effect: Effect) -> EffectSet | None:
    """The set with the force, as the least squares have it: one amplitude, root mean square over
    the recordings by what each tells, and in every one a phase. None where all of it together
    cannot be: a size below zero, or no stiffness.
    """
    recordings = [r.name for r in problem.fit.density.oscillator.campaign.recordings]
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
    values, terms = dict(found.values), [problem.terms[t] for t in best.chosen]
    sizes = [(n, s) for t in terms for n, s in zip(t.names, t.one_sided, strict=True)]
    if not values["k1"] > 0.0 or any(s and values[n] <= 0.0 for n, s in sizes):
        return None
    parts = np.array([[values.pop(f"{part}[{n}]") for part in ("sine", "cosine")]
                      for n in recordings])  # fmt: skip
    told = np.array([float(np.sum(one**2)) for one in waves])
    told[told < SEEN * told.max()] = 0.0  # rounding: no stretch, or one that its rest explains
    parts[told == 0.0] = 0.0
    size = float(np.sqrt(told @ np.sum(parts**2, axis=1) / told.sum()))
    values[instance_name(effect, effect.parameter("amplitude"), None)] = size
    for name, (sine, cosine) in zip(recordings, parts, strict=True):
        angle = float(np.arctan2(cosine, sine) % (2 * np.pi))
        values[instance_name(effect, effect.parameter("phase"), name)] = angle
    return EffectSet(found.effects, values, found.log_odds)
