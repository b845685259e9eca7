"""Global search: adaptive differential evolution with the Metropolis criterion.

The algorithm by which the paper identifies the rig (Eqs 8-12, flow chart Fig. 8), in its strongest
well-defined form, and for any objective. One generation, for all individuals x_i at once
(`evolution` holds the operators):

1. *Factors.* F_i ~ Cauchy(M_F, 0.1) cut to (0, 1], CR_i ~ normal(M_CR, 0.1) clipped to [0, 1], with
   (M_F, M_CR) drawn from a memory of what succeeded lately (success history: Tanabe & Fukunaga
   2013, SHADE).
2. *Mutation* current-to-pbest/1: v_i = x_i + F_i (x_pbest - x_i) + F_i (x_r1 - x_r2), x_pbest one
   of the best ninth, x_r2 from the population or from the archive of beaten parents (Zhang &
   Sanderson 2009, JADE). A component that left its bounds is folded back into them, as in a mirror:
   nothing piles up at an edge.
3. *Binomial crossover* of v_i and x_i with rate CR_i (Storn & Price 1997).
4. *Selection* by the criterion of Metropolis et al. (1953): a trial that is no worse replaces its
   parent, a worse one does so with probability exp(-(f_trial - f_parent) / T). The best individual
   is exempt, only something as good replaces it, so the best value ever seen is never lost.
5. *Learning.* Weighted Lehmer means of the F and CR of the trials that *improved* on their parents
   enter the memory; the population shrinks linearly with the evaluations spent (Tanabe & Fukunaga
   2014, L-SHADE).

*Cooling.* T falls geometrically from the standard deviation of f over the first population to 1
over the first 70 % of the budget, and is 0 (greedy selection) in the rest: at T = 1 a population
would keep an sd of order sqrt(d / 2) for ever. Nor is T ever above the present standard deviation
of f, for then everything is accepted and the cold part of the schedule comes too late. T = 1 is one
unit of f, so the natural objective is a negative log posterior, or (N / 2) log(sum of squared
residuals), in nats. A raw sum of squares spans decades: no temperature suits it.

*Exploring.* Where nearly everything is accepted, the pull to x_pbest only contracts the population
(its variance changes by about 1 - 2 F + 3 F^2 a generation, below 1 for F < 2/3; see Zaharie 2002
for such sums), and it collapses on what was best early on. So the pull is left out in the first
20 % of the budget: x_i + F_i (x_r1 - x_r2) lets the population wander over the side minima that T
can cross. (Brest et al. 2017, jSO, weaken the pull over the same part.)

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

from bayesimpact.data.short_repr import short_repr
from bayesimpact.errors import InputError
from bayesimpact.inference.evolution import (
    Box,
    Objective,
    SearchState,
    Step,
    first_state,
    generation,
    shrink,
)

Array = npt.NDArray[np.float64]

FEWEST = 6  # size of the last population
COOLING = 0.7  # share of the budget over which T falls
EXPLORING = 0.2  # share of the budget without the pull to the best


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

    __repr__ = short_repr


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

    __repr__ = short_repr


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
    callback: Callable[[Generation], None] | None = None,
) -> SearchResult:
    """Minimise `objective` within bounds; the module's docstring describes the algorithm.

    Parameters
    ----------
    objective : f(X (B, d)) -> (B,), lower is better; +inf or NaN marks an inadmissible point
    lower, upper : (d,) finite bounds, lower < upper
    rng : every random number comes from it; same state, same result
    population : size of the first population, which shrinks to 6; when None 9 d, or less to leave
        a small budget 200 generations, but at least 24
    evaluations : budget, never exceeded; 3000 d when None. The cooling is laid over it
    tolerance : stop when the standard deviation of f over the population is below; absolute,
        unit of f
    metropolis : False for greedy selection (T = 0, no exploring), which is plain L-SHADE
    coldest : last temperature of the cooling, unit of f: the difference that should not matter.
        1 is right for a negative log posterior
    callback : called after every generation

    Raises
    ------
    InputError : an argument that cannot be used; an objective that returns another shape or -inf
    """
    box = _checked_box(lower, upper)
    dimension = len(box.lower)
    budget = 3000 * dimension if evaluations is None else evaluations
    size = max(24, min(9 * dimension, budget // 110)) if population is None else population
    _check_settings(size, budget, tolerance, coldest)
    state = first_state(objective, box.latin_hypercube(size, rng))
    hottest = _first_temperature(state.f, coldest) if metropolis else 0.0
    spent = size
    track: list[Generation] = []
    while _standard_deviation(state.f) >= tolerance and spent + len(state.x) <= budget:
        progress = spent / budget
        temperature = min(_cooled(progress, hottest, coldest), _standard_deviation(state.f))
        pull = 0.0 if metropolis and progress < EXPLORING else 1.0
        spent += len(state.x)
        state, step = generation(state, objective, box, temperature, pull, rng)
        state = shrink(state, _size(spent / budget, size), rng)
        track.append(_summary(state.f, spent, temperature, step))
        if callback is not None:
            callback(track[-1])
    return _result(state, spent, track, tolerance)


def _first_temperature(f: Array, coldest: float) -> float:
    """Standard deviation of the first population's admissible values; `coldest` without two."""
    admissible = f[np.isfinite(f)]
    return _deviation(admissible) if len(admissible) > 1 else coldest


def _cooled(progress: float, hottest: float, coldest: float) -> float:
    """T after the fraction `progress` of the budget: geometric cooling, then 0."""
    if progress >= COOLING:
        return 0.0
    if hottest <= coldest:
        return hottest
    return float(hottest * (coldest / hottest) ** (progress / COOLING))


def _size(progress: float, first: int) -> int:
    """Size of the population after the fraction `progress` of the budget."""
    return max(FEWEST, round(first + (FEWEST - first) * progress))


def _standard_deviation(f: Array) -> float:
    """Standard deviation of f over the population; inf while one value is inadmissible."""
    return _deviation(f) if np.isfinite(f).all() else math.inf


def _deviation(f: Array) -> float:
    """Standard deviation of finite values, scaled so that penalties such as 1e300 pass."""
    scale = float(np.abs(f).max())
    return float(scale * np.std(f / scale)) if scale > 0 else 0.0


def _summary(f: Array, spent: int, temperature: float, step: Step) -> Generation:
    """The record of one generation."""
    return Generation(
        evaluations=spent,
        best=float(f.min()),
        median=float(np.median(f)),
        spread=_standard_deviation(f),
        temperature=temperature,
        uphill=float(step.uphill.mean()),
        mean_f=float(step.factor.mean()),
        mean_cr=float(step.rate.mean()),
    )


def _result(
    state: SearchState, spent: int, track: list[Generation], tolerance: float
) -> SearchResult:
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
        stopped="converged" if _standard_deviation(state.f) < tolerance else "budget",
        history=History(**columns),
        population=_frozen(state.x),
        values=_frozen(state.f),
    )


def _frozen(values: npt.ArrayLike) -> npt.NDArray[Any]:
    """A read-only copy."""
    array = np.array(values)
    array.setflags(write=False)
    return array


def _checked_box(lower: npt.ArrayLike, upper: npt.ArrayLike) -> Box:
    """Both bounds as one record."""
    low, high = np.array(lower, dtype=np.float64), np.array(upper, dtype=np.float64)
    if low.ndim != 1 or low.shape != high.shape or len(low) == 0:
        raise InputError("bounds", f"shapes {low.shape} and {high.shape}", "two of shape (d,)")
    with np.errstate(over="ignore", invalid="ignore"):
        usable = (low < high) & np.isfinite(high - low)
    if not usable.all():
        at = int(np.argmin(usable))
        raise InputError(f"bounds[{at}]", f"{low[at]} to {high[at]}", "finite, lower < upper")
    return Box(low, high)


def _check_settings(size: int, budget: int, tolerance: float, coldest: float) -> None:
    """Raise InputError for numbers that cannot be used."""
    if not isinstance(size, int | np.integer) or size < FEWEST:
        raise InputError("population", str(size), f"a whole number, {FEWEST} or above")
    if not isinstance(budget, int | np.integer) or budget < size:
        raise InputError("evaluations", str(budget), f"a whole number, {size} or above")
    if not 0 <= tolerance < math.inf:
        raise InputError("tolerance", str(tolerance), "a finite number, 0 or above")
    if not 0 < coldest < math.inf:
        raise InputError("coldest", str(coldest), "a finite number above 0")
