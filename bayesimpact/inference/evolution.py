"""One generation of differential evolution with the Metropolis criterion, for a whole population.

Each function is one operator, vectorised over the individuals; `search` puts them in their loop and
describes the algorithm and its sources. Shapes: n individuals of d components.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bayesimpact.errors import InputError

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Objective = Callable[[Array], npt.ArrayLike]

# Tanabe & Fukunaga (2014): slots of the memory, share of the leaders, archive per individual.
MEMORY = 6
LEADERS = 0.11
ARCHIVE = 2.6


@dataclass(frozen=True, eq=False)
class Box:
    """Bounds (d,), lower < upper."""

    lower: Array
    upper: Array

    def latin_hypercube(self, size: int, rng: np.random.Generator) -> Array:
        """(size, d) points, one in each of `size` slices of every axis (McKay et al. 1979)."""
        d = len(self.lower)
        slices = rng.permuted(np.tile(np.arange(size), (d, 1)), axis=1).T
        share = (slices + rng.random((size, d))) / size
        return np.minimum(self.lower + share * (self.upper - self.lower), self.upper)

    def reflect(self, x: Array) -> Array:
        """Points (n, d) with what lies outside mirrored at the bounds, as often as it takes."""
        width = self.upper - self.lower
        turn = np.mod((x - self.lower) / width, 2)
        mirrored = self.lower + width * np.where(turn > 1, 2 - turn, turn)
        outside = (x < self.lower) | (x > self.upper)
        return np.where(outside, np.clip(mirrored, self.lower, self.upper), x)


@dataclass(frozen=True, eq=False)
class Memory:
    """What succeeded lately: (MEMORY,) values of F and of CR, and the slot written next.

    A CR of NaN is the terminal value of L-SHADE: this slot gives CR = 0 from now on.
    """

    f: Array
    cr: Array
    slot: int = 0


@dataclass(frozen=True, eq=False)
class SearchState:
    """Between two generations: points (n, d), their values (n,), beaten parents (a, d), memory."""

    x: Array
    f: Array
    archive: Array
    memory: Memory


@dataclass(frozen=True, eq=False)
class Step:
    """What one generation did: F (n,), CR (n,), and which worse trials were accepted (n,)."""

    factor: Array
    rate: Array
    uphill: Mask


def first_state(objective: Objective, x: Array) -> SearchState:
    """State of the first population (n, d)."""
    memory = Memory(np.full(MEMORY, 0.5), np.full(MEMORY, 0.5))
    return SearchState(x, evaluate(objective, x), np.empty((0, x.shape[1])), memory)


def generation(
    state: SearchState,
    objective: Objective,
    box: Box,
    temperature: float,
    pull: float,
    rng: np.random.Generator,
) -> tuple[SearchState, Step]:
    """One generation at a temperature; `pull` scales the attraction to the leaders."""
    x, f = state.x, state.f
    factor, rate = draw_factors(state.memory, len(x), rng)
    mutant = box.reflect(mutate(x, f, state.archive, factor, pull, rng))
    trial = cross(x, mutant, rate, rng)
    f_trial = evaluate(objective, trial)
    accepted = accept(f, f_trial, temperature, rng)
    better = f_trial < f
    following = SearchState(
        x=np.where(accepted[:, None], trial, x),
        f=np.where(accepted, f_trial, f),
        archive=np.concatenate([state.archive, x[better]]),
        memory=learn(state.memory, factor[better], rate[better], f[better] - f_trial[better]),
    )
    return following, Step(factor, rate, accepted & (f_trial > f))


def evaluate(objective: Objective, x: Array) -> Array:
    """f (n,) of the points (n, d), NaN read as +inf."""
    # A copy: neither does the objective get hold of our points, nor we of its buffer.
    f = np.array(objective(x.copy()), dtype=np.float64)
    if f.shape != (len(x),):
        raise InputError("objective", f"shape {f.shape} for {len(x)} points", f"({len(x)},)")
    f[np.isnan(f)] = np.inf
    if np.isneginf(f).any():
        raise InputError("objective", "-inf", "finite values, +inf or NaN where inadmissible")
    return f


def draw_factors(memory: Memory, n: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """F (n,) and CR (n,), around slots of the memory drawn at random."""
    slot = rng.integers(MEMORY, size=n)
    location = memory.f[slot]
    # The Cauchy law given F > 0 by inversion; what lies above 1 becomes 1.
    below = 0.5 - np.arctan(location / 0.1) / np.pi
    quantile = below + (1 - below) * rng.random(n)
    factor = location + 0.1 * np.tan(np.pi * (quantile - 0.5))
    rate = np.clip(rng.normal(memory.cr[slot], 0.1), 0, 1)
    # F near 0 would repeat the parent.
    return np.clip(factor, 1e-3, 1), np.where(np.isnan(rate), 0.0, rate)


def mutate(
    x: Array, f: Array, archive: Array, factor: Array, pull: float, rng: np.random.Generator
) -> Array:
    """current-to-pbest/1 with archive: (n, d) mutants, components possibly out of bounds.

    `pull` 1 is the published operator; 0 leaves the leaders out of it.
    """
    n = len(x)
    own = np.arange(n)
    leaders = best(f, max(2, round(LEADERS * n)))
    leader = leaders[rng.integers(len(leaders), size=n)]
    first = (own + rng.integers(1, n, size=n)) % n
    # Uniform over all places but `own` and `first`: draw from two fewer, step over both.
    second = rng.integers(n + len(archive) - 2, size=n)
    second += second >= np.minimum(own, first)
    second += second >= np.maximum(own, first)
    pool = np.concatenate([x, archive])
    step = pull * (x[leader] - x) + (x[first] - pool[second])
    return np.asarray(x + factor[:, None] * step)


def cross(x: Array, mutant: Array, rate: Array, rng: np.random.Generator) -> Array:
    """Binomial crossover: at least one component comes from the mutant."""
    n, d = x.shape
    chosen = rng.random((n, d)) < rate[:, None]
    chosen[np.arange(n), rng.integers(d, size=n)] = True
    return np.where(chosen, mutant, x)


def accept(f: Array, f_trial: Array, temperature: float, rng: np.random.Generator) -> Mask:
    """Metropolis criterion (n,); the incumbent yields only to what is no worse."""
    accepted = f_trial <= f
    chance = rng.random(len(f))
    if temperature > 0:
        rise = np.where(accepted, 0.0, f_trial) - np.where(accepted, 0.0, f)
        uphill = chance < np.exp(-rise / temperature)
        uphill[np.argmin(f)] = False
        accepted |= uphill
    return accepted


def learn(memory: Memory, factor: Array, rate: Array, gain: Array) -> Memory:
    """Memory after a generation, from the F, CR and gains f - f_trial of what improved."""
    if len(gain) == 0:
        return memory
    # From inadmissible to admissible is an infinite gain: it counts like the largest finite one.
    finite = gain[np.isfinite(gain)]
    weight = np.minimum(gain, finite.max() if len(finite) else 1.0)
    f, cr = memory.f.copy(), memory.cr.copy()
    f[memory.slot] = lehmer_mean(factor, weight)
    ended = np.isnan(cr[memory.slot]) or rate.max() == 0
    cr[memory.slot] = np.nan if ended else lehmer_mean(rate, weight)
    return Memory(f, cr, (memory.slot + 1) % MEMORY)


def lehmer_mean(values: Array, weights: Array) -> float:
    """Sum of w v^2 over sum of w v: leans to the larger values."""
    weights = weights / weights.max()
    return float(np.sum(weights * values**2) / np.sum(weights * values))


def best(f: Array, count: int) -> npt.NDArray[np.intp]:
    """Indices (count,) of the lowest values, best first."""
    return np.argsort(f, kind="stable")[:count]


def shrink(state: SearchState, size: int, rng: np.random.Generator) -> SearchState:
    """The best `size` individuals, and the archive thinned at random to ARCHIVE times as many."""
    keep = best(state.f, size) if size < len(state.f) else np.arange(len(state.f))
    limit = round(ARCHIVE * len(keep))
    archive = state.archive
    if len(archive) > limit:
        archive = archive[rng.permutation(len(archive))[:limit]]
    return SearchState(state.x[keep], state.f[keep], archive, state.memory)
