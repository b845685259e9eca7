"""Correlated noise made white: every sample less what those before it predict of it.

The noise is a sum of AR(1) processes, white noise one of them. What the samples so far say of the
processes is a normal distribution that one step of Kalman's filter (Kalman 1960, J. Basic Eng.
82:35) carries on, over gaps too: exact, and for one process the usual difference of neighbours.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.jit.compiled import compiled

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Parts = tuple[tuple[float, float], ...]
"""Of every process: correlation of neighbouring samples, and share of the noise's variance."""

KEPT = 64  # recordings of so many lengths without a gap


def innovations(x: Array, parts: Parts, used: Mask | None) -> Array:
    """Innovations of signals x (..., n) over their standard deviation, (..., n).

    They have the variance of the noise. 0 where `used` (n,) is False.
    """
    if used is None and len(parts) == 1:
        return _of_neighbours(x, parts[0][0])
    rows = np.ascontiguousarray(x.reshape(-1, x.shape[-1]))
    sd, gains = _steps(x.shape[-1], parts, used)
    correlations = np.array([correlation for correlation, _ in parts])
    return np.asarray(_innovations(rows, correlations, sd, gains).reshape(x.shape))


def _of_neighbours(x: Array, correlation: float) -> Array:
    """Of one process, every sample of which is predicted by the one before it."""
    white = np.empty_like(x)
    white[..., 0] = x[..., 0]
    later = white[..., 1:]
    np.multiply(x[..., :-1], -correlation, out=later)
    later += x[..., 1:]
    later /= np.sqrt(1.0 - correlation**2)
    return white


def log_determinant(n: int, parts: Parts, used: Mask | None) -> float:
    """Of the operator that makes `innovations` of the samples used."""
    sd, _ = _steps(n, parts, used)
    return -float(np.sum(np.log(sd[np.isfinite(sd)])))


def _steps(n: int, parts: Parts, used: Mask | None) -> tuple[Array, Array]:
    if used is None:
        return _whole(n, parts)
    sd, gains = _filter(np.ascontiguousarray(used), *np.array(parts).T)
    return np.asarray(sd), np.asarray(gains)


@lru_cache(maxsize=KEPT)
def _whole(n: int, parts: Parts) -> tuple[Array, Array]:
    sd, gains = _filter(np.ones(n, dtype=np.bool_), *np.array(parts).T)
    sd.setflags(write=False)
    gains.setflags(write=False)
    return sd, gains


@compiled()
def _filter(used, correlations, shares):  # type: ignore[no-untyped-def]
    """Standard deviation of every innovation, infinite where there is none, and by how much of it
    every process is to be corrected, (n, K).
    """
    sd, gains = np.empty(used.size), np.zeros((used.size, shares.size))
    covariance = np.diag(shares)
    renewed = shares * (1.0 - correlations**2)
    for i in range(used.size):
        if used[i]:
            along = covariance.sum(axis=1)
            variance = along.sum()
            sd[i] = np.sqrt(variance)
            gains[i] = along / variance
            for j in range(shares.size):
                for k in range(shares.size):
                    covariance[j, k] -= along[j] * gains[i, k]
        else:
            sd[i] = np.inf
        for j in range(shares.size):
            for k in range(shares.size):
                covariance[j, k] *= correlations[j] * correlations[k]
            covariance[j, j] += renewed[j]
    return sd, gains


@compiled()
def _innovations(x, correlations, sd, gains):  # type: ignore[no-untyped-def]
    found, count = np.zeros_like(x), correlations.size
    for row in range(x.shape[0]):
        expected = np.zeros(count)
        for i in range(x.shape[1]):
            new = x[row, i]
            for k in range(count):
                new -= expected[k]
            if sd[i] == np.inf:
                new = 0.0
            found[row, i] = new / sd[i]
            for k in range(count):
                expected[k] = correlations[k] * (expected[k] + gains[i, k] * new)
    return found
