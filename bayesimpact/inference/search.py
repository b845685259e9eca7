"""Global search: adaptive differential evolution with the Metropolis criterion.

The algorithm by which the paper identifies the rig (Eqs 8-12, flow chart Fig. 8), in its strongest
well-defined form, and for any objective.

One generation, for all individuals x_i at once:

1. *Factors.* F_i ~ Cauchy(M_F, 0.1) cut to (0, 1], CR_i ~ normal(M_CR, 0.1) clipped to [0, 1], with
   (M_F, M_CR) drawn from a memory of what succeeded lately (success history: Tanabe & Fukunaga
   2013, SHADE).
2. *Mutation* current-to-pbest/1: v_i = x_i + F_i (x_pbest - x_i) + F_i (x_r1 - x_r2), x_pbest one
   of the best tenth, x_r2 from the population or from the archive of beaten parents (Zhang &
   Sanderson 2009, JADE). A component that left its bounds is folded back into them, as in a mirror:
   nothing piles up at an edge.
3. *Binomial crossover* of v_i and x_i with rate CR_i (Storn & Price 1997).
4. *Selection* by the criterion of Metropolis et al. (1953): a trial that is no worse replaces its
   parent, a worse one does so with probability exp(-(f_trial - f_parent) / T). The best individual
   is exempt, only something better replaces it, so the best point ever seen is never lost.
5. *Learning.* Weighted Lehmer means of the F and CR of the trials that *improved* on their parents
   enter the memory; the population shrinks linearly with the evaluations spent (Tanabe & Fukunaga
   2014, L-SHADE).

*Cooling.* T falls geometrically from the standard deviation of f over the first population to 1
over the first 70 % of the budget, and is 0 (greedy selection) in the rest: at T = 1 a population
would keep a spread of order sqrt(d / 2) for ever. T = 1 is one unit of f, so the natural objective
is a negative log posterior, or (N / 2) log(sum of squared residuals), in nats. A raw sum of squares
spans decades: no temperature suits it.

This is an optimiser and **not a sampler**. Proposals that depend on the ranking, on the archive and
on past success have no reversed counterpart, so there is no detailed balance at any temperature,
and the final population is no sample of exp(-f).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from bayesimpact.errors import InputError

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Objective = Callable[[Array], npt.ArrayLike]

# Tanabe & Fukunaga (2014), section IV: settings tuned on the CEC 2014 functions.
MEMORY = 6
GREEDINESS = 0.11
ARCHIVE = 2.6
FEWEST = 6
COOLING = 0.7


@dataclass(frozen=True)
class Generation:
    """State after one generation; what the callback gets.

    Attributes
    ----------
    evaluations : of the objective so far
    best, median : of f over the population
    spread : standard deviation of f over the population, inf while a value is inadmissible
    temperature : of the Metropolis criterion in this generation, unit of f
    uphill : fraction of the trials that were worse than their parents and accepted
    mean_f, mean_cr : means of the factors F and rates CR drawn in this generation
    """

    evaluations: int
    best: float
    median: float
    spread: float
    temperature: float
    uphill: float
    mean_f: float
    mean_cr: float


@dataclass(frozen=True, eq=False)
class History:
    """The fields of `Generation` as read-only arrays (G,), one entry per generation."""

    evaluations: npt.NDArray[np.int64]
    best: Array
    median: Array
    spread: Array
    temperature: Array
    uphill: Array
    mean_f: Array
    mean_cr: Array


@dataclass(frozen=True, eq=False)
class SearchResult:
    """Outcome of a search; arrays are read-only.

    Attributes
    ----------
    best : (d,) best point ever evaluated
    value : f there; inf when nothing admissible was found
    evaluations, generations : spent; the first population counts as evaluations only
    stopped : "converged" (sd of f over the population below the tolerance) or "budget"
    history : per generation
    population : (n, d) at the end
    values : (n,) f of the population
    """

    best: Array
    value: float
    evaluations: int
    generations: int
    stopped: Literal["converged", "budget"]
    history: History
    population: Array
    values: Array


@dataclass(frozen=True, eq=False)
class _Memory:
    """What succeeded lately: (MEMORY,) values of F and of CR, and the slot written next.

    A CR of NaN is the terminal value of L-SHADE: this slot gives CR = 0 from now on.
    """

    f: Array
    cr: Array
    slot: int = 0


@dataclass(frozen=True, eq=False)
class _State:
    """Between two generations: points (n, d), their values (n,), beaten parents (a, d), memory."""

    x: Array
    f: Array
    archive: Array
    memory: _Memory


def metropolis_differential_evolution(
    objective: Objective,
    lower: npt.ArrayLike,
    upper: npt.ArrayLike,
    *,
    rng: np.random.Generator,
    population: int | None = None,
    evaluations: int | None = None,
    tolerance: float = 0.1,
    metropolis: bool = True,
    coldest: float = 1.0,
    start: npt.ArrayLike | None = None,
    callback: Callable[[Generation], None] | None = None,
) -> SearchResult:
    """Minimise `objective` within bounds; the module's docstring describes the algorithm.

    Parameters
    ----------
    objective : f(X (B, d)) -> (B,), lower is better; +inf or NaN marks an inadmissible point
    lower, upper : (d,) finite bounds, lower < upper
    rng : every random number comes from it; same state, same result
    population : size of the first population, 9 d (at least 24) when None; it shrinks to 6
    evaluations : budget, never exceeded; 3000 d when None. The cooling is laid over it
    tolerance : stop when the standard deviation of f over the population is below; absolute,
        unit of f
    metropolis : False for greedy selection (T = 0 throughout), which is plain L-SHADE
    coldest : last temperature of the cooling, unit of f: the difference that should not matter.
        1 is right for a negative log posterior
    start : (k, d) points within the bounds that take the first k places of the first population
    callback : called after every generation

    Raises
    ------
    InputError : an argument that cannot be used; an objective that returns another shape or -inf
    """
    lower, upper = _checked_bounds(lower, upper)
    size = max(9 * len(lower), 24) if population is None else population
    budget = 3000 * len(lower) if evaluations is None else evaluations
    _check_settings(size, budget, tolerance, coldest)
    state = _first_state(objective, rng, size, lower, upper, start)
    hottest = _first_temperature(state.f) if metropolis else 0.0
    spent = size
    track: list[Generation] = []
    while _spread(state.f) >= tolerance and spent + len(state.x) <= budget:
        temperature = _temperature(spent / budget, hottest, coldest)
        spent += len(state.x)
        state, uphill, drawn = _generation(state, objective, temperature, lower, upper, rng)
        state = _shrink(state, _size(spent / budget, size), rng)
        track.append(_summary(state.f, spent, temperature, uphill, drawn))
        if callback is not None:
            callback(track[-1])
    return _result(state, spent, track, tolerance)


def _generation(
    state: _State,
    objective: Objective,
    temperature: float,
    lower: Array,
    upper: Array,
    rng: np.random.Generator,
) -> tuple[_State, float, tuple[Array, Array]]:
    """Steps 1 to 5 once: the next state, the fraction accepted uphill, the F and CR drawn."""
    x, f = state.x, state.f
    factor, rate = _draw_factors(state.memory, len(x), rng)
    mutant = _fold(_mutate(x, f, state.archive, factor, rng), lower, upper)
    trial = _cross(x, mutant, rate, rng)
    f_trial = _evaluate(objective, trial)
    accepted = _accept(f, f_trial, temperature, rng)
    better = f_trial < f
    following = _State(
        x=np.where(accepted[:, None], trial, x),
        f=np.where(accepted, f_trial, f),
        archive=np.concatenate([state.archive, x[better]]),
        memory=_learn(state.memory, factor[better], rate[better], f[better] - f_trial[better]),
    )
    uphill = float(np.mean(accepted & (f_trial > f)))
    return following, uphill, (factor, rate)


def _first_state(
    objective: Objective,
    rng: np.random.Generator,
    size: int,
    lower: Array,
    upper: Array,
    start: npt.ArrayLike | None,
) -> _State:
    """A Latin hypercube of `size` points over the bounds (McKay et al. 1979), `start` put in."""
    d = len(lower)
    strata = rng.permuted(np.tile(np.arange(size), (d, 1)), axis=1).T
    x = lower + (strata + rng.random((size, d))) / size * (upper - lower)
    x = np.minimum(x, upper)
    if start is not None:
        given = _checked_start(start, size, lower, upper)
        x[: len(given)] = given
    memory = _Memory(np.full(MEMORY, 0.5), np.full(MEMORY, 0.5))
    return _State(x, _evaluate(objective, x), np.empty((0, d)), memory)


def _evaluate(objective: Objective, x: Array) -> Array:
    """f (B,) of the points (B, d), NaN read as +inf."""
    # A copy: neither does the objective get hold of our points, nor we of its buffer.
    f = np.array(objective(x.copy()), dtype=np.float64)
    if f.shape != (len(x),):
        raise InputError("objective", f"shape {f.shape} for {len(x)} points", f"({len(x)},)")
    f[np.isnan(f)] = np.inf
    if np.isneginf(f).any():
        raise InputError("objective", "-inf", "finite values, +inf or NaN where inadmissible")
    return f


def _first_temperature(f: Array) -> float:
    """Standard deviation of the admissible values of the first population; 0 below two of them."""
    admissible = f[np.isfinite(f)]
    return float(np.std(admissible)) if len(admissible) > 1 else 0.0


def _temperature(progress: float, hottest: float, coldest: float) -> float:
    """T after the fraction `progress` of the budget: geometric cooling, then 0."""
    if progress >= COOLING:
        return 0.0
    if hottest <= coldest:
        return hottest
    return float(hottest * (coldest / hottest) ** (progress / COOLING))


def _draw_factors(memory: _Memory, n: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """F (n,) and CR (n,), around slots of the memory drawn at random."""
    slot = rng.integers(MEMORY, size=n)
    location = memory.f[slot]
    # The Cauchy law given F > 0 by inversion; what lies above 1 becomes 1.
    below = 0.5 - np.arctan(location / 0.1) / np.pi
    quantile = below + (1 - below) * rng.random(n)
    factor = location + 0.1 * np.tan(np.pi * (quantile - 0.5))
    rate = np.clip(rng.normal(memory.cr[slot], 0.1), 0, 1)
    return np.clip(factor, 1e-3, 1), np.where(np.isnan(rate), 0.0, rate)


def _mutate(x: Array, f: Array, archive: Array, factor: Array, rng: np.random.Generator) -> Array:
    """current-to-pbest/1 with archive: (n, d) mutants, components possibly out of bounds."""
    n = len(x)
    own = np.arange(n)
    leaders = _best(f, max(2, round(GREEDINESS * n)))
    leader = leaders[rng.integers(len(leaders), size=n)]
    first = (own + rng.integers(1, n, size=n)) % n
    # Uniform over all places but `own` and `first`: draw from two fewer, step over both.
    second = rng.integers(n + len(archive) - 2, size=n)
    second += second >= np.minimum(own, first)
    second += second >= np.maximum(own, first)
    pool = np.concatenate([x, archive])
    return x + factor[:, None] * (x[leader] - x + x[first] - pool[second])


def _fold(x: Array, lower: Array, upper: Array) -> Array:
    """Points (n, d) with what lies out of bounds mirrored at them, as often as it takes."""
    width = upper - lower
    turn = np.mod((x - lower) / width, 2)
    mirrored = lower + width * np.where(turn > 1, 2 - turn, turn)
    outside = (x < lower) | (x > upper)
    return np.where(outside, np.clip(mirrored, lower, upper), x)


def _cross(x: Array, mutant: Array, rate: Array, rng: np.random.Generator) -> Array:
    """Binomial crossover: at least one component comes from the mutant."""
    n, d = x.shape
    chosen = rng.random((n, d)) < rate[:, None]
    chosen[np.arange(n), rng.integers(d, size=n)] = True
    return np.where(chosen, mutant, x)


def _accept(f: Array, f_trial: Array, temperature: float, rng: np.random.Generator) -> Mask:
    """Metropolis criterion (n,); the incumbent yields only to what is no worse."""
    accepted = f_trial <= f
    chance = rng.random(len(f))
    if temperature > 0:
        rise = np.where(accepted, 0.0, f_trial) - np.where(accepted, 0.0, f)
        uphill = chance < np.exp(-rise / temperature)
        uphill[np.argmin(f)] = False
        accepted |= uphill
    return accepted


def _learn(memory: _Memory, factor: Array, rate: Array, gain: Array) -> _Memory:
    """Memory after a generation, from the F, CR and gains f - f_trial of what improved."""
    if len(gain) == 0:
        return memory
    # From inadmissible to admissible is an infinite gain: it counts like the largest finite one.
    finite = gain[np.isfinite(gain)]
    weight = np.minimum(gain, finite.max() if len(finite) else 1.0)
    f, cr = memory.f.copy(), memory.cr.copy()
    f[memory.slot] = _lehmer_mean(factor, weight)
    ended = np.isnan(cr[memory.slot]) or rate.max() == 0
    cr[memory.slot] = np.nan if ended else _lehmer_mean(rate, weight)
    return _Memory(f, cr, (memory.slot + 1) % MEMORY)


def _lehmer_mean(values: Array, weights: Array) -> float:
    """Sum of w v^2 over sum of w v: leans to the larger values."""
    weights = weights / weights.max()
    return float(np.sum(weights * values**2) / np.sum(weights * values))


def _best(f: Array, count: int) -> npt.NDArray[np.intp]:
    """Indices (count,) of the lowest values, best first."""
    return np.argsort(f, kind="stable")[:count]


def _size(progress: float, first: int) -> int:
    """Size of the population after the fraction `progress` of the budget."""
    return max(FEWEST, round(first + (FEWEST - first) * progress))


def _shrink(state: _State, size: int, rng: np.random.Generator) -> _State:
    """The best `size` individuals, and the archive thinned at random to ARCHIVE times as many."""
    keep = _best(state.f, size) if size < len(state.f) else np.arange(len(state.f))
    limit = round(ARCHIVE * len(keep))
    archive = state.archive
    if len(archive) > limit:
        archive = archive[rng.permutation(len(archive))[:limit]]
    return _State(state.x[keep], state.f[keep], archive, state.memory)


def _spread(f: Array) -> float:
    """Standard deviation of f over the population; inf while one value is inadmissible."""
    return float(np.std(f)) if np.isfinite(f).all() else math.inf


def _summary(
    f: Array, spent: int, temperature: float, uphill: float, drawn: tuple[Array, Array]
) -> Generation:
    """The record of one generation."""
    return Generation(
        evaluations=spent,
        best=float(f.min()),
        median=float(np.median(f)),
        spread=_spread(f),
        temperature=temperature,
        uphill=uphill,
        mean_f=float(drawn[0].mean()),
        mean_cr=float(drawn[1].mean()),
    )


def _result(state: _State, spent: int, track: list[Generation], tolerance: float) -> SearchResult:
    """The record of the whole search."""
    winner = int(np.argmin(state.f))
    columns = {
        field.name: _frozen([getattr(generation, field.name) for generation in track])
        for field in fields(History)
    }
    return SearchResult(
        best=_frozen(state.x[winner]),
        value=float(state.f[winner]),
        evaluations=spent,
        generations=len(track),
        stopped="converged" if _spread(state.f) < tolerance else "budget",
        history=History(**columns),
        population=_frozen(state.x),
        values=_frozen(state.f),
    )


def _frozen(values: npt.ArrayLike) -> npt.NDArray[Any]:
    """A read-only copy."""
    array = np.array(values)
    array.setflags(write=False)
    return array


def _checked_bounds(lower: npt.ArrayLike, upper: npt.ArrayLike) -> tuple[Array, Array]:
    """Both bounds as (d,) arrays."""
    low, high = np.array(lower, dtype=np.float64), np.array(upper, dtype=np.float64)
    if low.ndim != 1 or low.shape != high.shape or len(low) == 0:
        raise InputError("bounds", f"shapes {low.shape} and {high.shape}", "two of shape (d,)")
    with np.errstate(over="ignore", invalid="ignore"):
        usable = (low < high) & np.isfinite(high - low)
    if not usable.all():
        at = int(np.argmin(usable))
        raise InputError(f"bounds[{at}]", f"{low[at]} to {high[at]}", "finite, lower < upper")
    return low, high


def _checked_start(start: npt.ArrayLike, size: int, lower: Array, upper: Array) -> Array:
    """Points (k, d) within the bounds, k at most `size`."""
    given = np.array(start, dtype=np.float64)
    if given.ndim != 2 or given.shape[1] != len(lower) or len(given) > size:
        raise InputError("start", f"shape {given.shape}", f"(k, {len(lower)}), k up to {size}")
    if not ((given >= lower) & (given <= upper)).all():
        raise InputError("start", "a point out of bounds", "points within the bounds")
    return given


def _check_settings(size: int, budget: int, tolerance: float, coldest: float) -> None:
    """Raise InputError for numbers that cannot be used."""
    if size < FEWEST:
        raise InputError("population", str(size), f"at least {FEWEST}")
    if budget < size:
        raise InputError("evaluations", str(budget), f"at least the population, {size}")
    if not 0 <= tolerance < math.inf:
        raise InputError("tolerance", str(tolerance), "a finite number, 0 or above")
    if not 0 < coldest < math.inf:
        raise InputError("coldest", str(coldest), "a finite number above 0")
