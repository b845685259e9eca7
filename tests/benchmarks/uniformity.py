"""Are numbers uniform on (0, 1)? The simultaneous band of their distribution function.

Saeilynoja, Buerkner and Vehtari (2022), Statistics and Computing 32:32: at every point of a grid
the count of numbers below is binomial; the band takes the same tail probability at every point,
chosen by simulation such that all of it holds at once with the wanted probability.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import stats

Array = NDArray[np.float64]

SIMULATIONS = 4000


def grid(count: int) -> Array:
    """Points at which `count` numbers are looked at: as many, 99 at most, evenly spaced."""
    points = min(count, 99)
    return np.arange(1, points + 1) / (points + 1)


def smallest_tail(values: Array) -> Array:
    """Smallest two-sided tail probability over the grid for numbers (..., n) -> (...)."""
    n = values.shape[-1]
    ordered = np.sort(values, axis=-1)
    points = grid(n)
    flat = ordered.reshape(-1, n)
    counts = np.stack([np.searchsorted(row, points, side="right") for row in flat])
    below = stats.binom.cdf(counts, n, points)
    above = stats.binom.sf(counts - 1, n, points)
    tails = np.minimum(1.0, 2 * np.minimum(below, above)).min(axis=-1)
    return np.asarray(tails.reshape(values.shape[:-1]))


def critical_tail(count: int, level: float, rng: np.random.Generator) -> float:
    """Tail probability that `count` uniform numbers stay above, everywhere, in a share `level`."""
    return float(np.quantile(smallest_tail(rng.random((SIMULATIONS, count))), 1 - level))


def band(count: int, tail: float) -> tuple[Array, Array, Array]:
    """Grid (K,) and the lowest and highest shares below each point that lie inside the band."""
    points = grid(count)
    low = stats.binom.ppf(tail / 2, count, points) / count
    high = stats.binom.isf(tail / 2, count, points) / count
    return points, np.asarray(low), np.asarray(high)
