"""Noise that is larger where the reading is larger, or changes faster.

Time stamps that jitter, or an exposure of some length, turn speed into noise; speckle, pixels seen
at an angle and gains that flutter turn size into noise. Its variance at a sample is

    level^2 (1 + (a x)^2 + (b x')^2),

with x the reading from where it settles and x' its rate (Carroll and Ruppert 1988, Transformation
and Weighting in Regression, chapter 2). What short polynomials leave of windows of the recordings,
as in `noise.estimate`, tells a and b before any model of the oscillator is believed. What grows
like that but has a colour of its own is no noise: a second mode, the ringing of a stop.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space, toeplitz
from scipy.optimize import minimize
from scipy.stats import chi2

from bayesimpact.data.hum import find_hum
from bayesimpact.data.recording import Recording
from bayesimpact.inference.noise.remainders import DEGREE, KEPT, LARGEST, SMALLEST
from bayesimpact.inference.noise.sd import smoothed
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.inference.noise.windows import centred, period_of, smooth_parts, windows

Array = NDArray[np.float64]

FAST = 4.0  # times the motion's frequency
WINDOWS_PER_PERIOD = 12.0  # short: nothing of the motion is left at its highest speed either
LEAST_WINDOWS = 40
GROWS = 20.0  # nats over noise that is alike everywhere, as for noise that is coloured (`COLOURED`)
BESIDE = 4.0  # nats that a second term must add
DISTURBED = 0.02  # of the windows
LAGS = 5  # samples, up to which noise that grows must be as correlated as noise that does not
SHARE = 0.1  # of the reading that its noise may be
JITTER = 1.0  # of the sampling interval: stamps that jitter by more would change places
RANGE = 16.0  # nats below the largest variance: 0.03 % of its root
ENDS = 0.5  # of the largest variance: what seems to grow further grows by another law
ALIKE = 0.1  # of such a correlation, beside its error: a line changes one of them by about one
ERRORS = 3.0  # standard errors


@dataclass(frozen=True, eq=False)
class Energies:
    """Windows of recordings: what polynomials leave, and how far and how fast the reading moves.

    Attributes
    ----------
    left : (W, L) remainders in time
    energy : (W,) in units in which they are white
    freedom : numbers in a window
    size, rate : (W,) mean squares of the reading and of its rate
    basis : (L, freedom) of what polynomials leave
    largest : (2,) terms of the growth, at most
    """

    left: Array
    energy: Array
    freedom: int
    size: Array
    rate: Array
    basis: Array
    largest: Array


def with_growth(noise: Noise, recordings: Sequence[Recording]) -> Noise:
    """The noise with its growth, where the recordings show one; else the same noise."""
    found = _energies(noise, recordings)
    if found is None or not _may_grow(found):
        return noise
    gained, terms = _grown(found)
    ends = bool(np.all(terms < ENDS * found.largest))  # else another law may go on growing
    if gained < GROWS or not (ends and _has_no_colour(found, terms, noise.correlation)):
        return noise
    left = found.energy / _relative_variance(found, terms)
    left = left[left <= _limit(found, left)]
    level = float(np.sqrt(np.mean(left) / found.freedom))
    error = float(np.sqrt(0.5 / (left.size * found.freedom)))
    size, rate = (float(root) for root in np.sqrt(terms))
    return replace(noise, level=level, level_error=error, growth=(size, rate))


def _energies(noise: Noise, recordings: Sequence[Recording]) -> Energies | None:
    """None where windows are too short to follow a rate, or too few, or hold a hum."""
    shortest = min(period_of(r) for r in recordings)
    length = min(int(shortest / WINDOWS_PER_PERIOD), LARGEST)
    if length < SMALLEST or any(_has_fast_hum(r) for r in recordings):
        return None
    basis = null_space(np.vander(np.linspace(-1, 1, length), DEGREE + 1).T)
    covariance = basis.T @ toeplitz(noise.correlation ** np.arange(length)) @ basis
    side, parts = any(r.case for r in recordings), []
    for r in recordings:
        where = windows(length, smooth_parts(r, side=side, turns=True))
        size, rate = smoothed(r)
        parts.append((centred(r.samples)[where] @ basis, size[where], rate[where]))
    values, size, rate = (np.concatenate(part) for part in zip(*parts, strict=True))
    if values.shape[0] < LEAST_WINDOWS:
        return None
    seen = np.sum(basis**2, axis=1) / values.shape[1]  # by what is left of every sample's noise
    energy = np.einsum("wi,ij,wj->w", values, np.linalg.inv(covariance), values)
    squares = size**2 @ seen, rate**2 @ seen
    level = np.sqrt(np.median(energy) / values.shape[1])
    jitter = JITTER * min(r.interval for r in recordings)
    largest = (np.array([SHARE, jitter]) / level) ** 2
    return Energies(values @ basis.T, energy, values.shape[1], *squares, basis, largest)


def _may_grow(found: Energies) -> bool:
    """Whether the quarter of the windows with the largest readings, or rates, has more noise than
    the one with the smallest, beyond errors of both: a look before a search.
    """
    energy = np.minimum(found.energy, np.quantile(found.energy, 1.0 - DISTURBED))
    quarter = energy.size // 4
    error = ERRORS * np.sqrt(4.0 / (quarter * found.freedom))
    parts = (energy[np.argsort(by)] for by in (found.size, found.rate))
    return any(p[-quarter:].mean() > (1.0 + error) * p[:quarter].mean() for p in parts)


def _relative_variance(found: Energies, terms: Array) -> Array:
    """Variance of the noise in every window over the level's, (W,)."""
    return np.asarray(1.0 + terms[0] * found.size + terms[1] * found.rate)


def _limit(found: Energies, left: Array) -> float:
    """Of energies in units of their own noise: windows that something else disturbs lie above, a
    few of all: a growth that many contradict is none.
    """
    typical = np.median(left) / chi2.median(found.freedom)
    return float(max(typical * chi2.ppf(KEPT, found.freedom), np.quantile(left, 1.0 - DISTURBED)))


def _log_likelihood(found: Energies, terms: Array) -> float:
    """Of a growth at its best level; disturbed windows count as if they were at the limit."""
    variance = _relative_variance(found, terms)
    left = found.energy / variance
    level = np.mean(np.minimum(left, _limit(found, left))) / found.freedom
    return float(-0.5 * found.freedom * np.sum(np.log(variance) + np.log(level)))


def _grown(found: Energies) -> tuple[float, Array]:
    """The likeliest growth: what it gains over none, nats, and its terms (2,)."""
    least = _log_likelihood(found, np.zeros(2))
    size, rate = (_fitted(found, np.zeros(2), [i]) for i in (0, 1))
    best = max(size, rate, key=lambda one: one[0])
    both = _fitted(found, best[1], [0, 1])
    if both[0] > best[0] + BESIDE:
        best = both
    return best[0] - least, best[1]


def _fitted(found: Energies, known: Array, free: list[int]) -> tuple[float, Array]:
    """The likeliest growth with the terms `free`: log likelihood, terms (2,)."""
    largest = np.log(found.largest[free])

    def terms(logs: Array) -> Array:
        full = known.copy()
        full[free] = np.exp(logs)
        return full

    starts = [largest - share * RANGE for share in (0.1, 0.3, 0.5)]
    with np.errstate(divide="ignore"):
        starts = [np.where(known[free] > 0, np.log(known[free]), start) for start in starts]
    ends = [
        minimize(
            lambda logs: -_log_likelihood(found, terms(logs)), start,
            method="Nelder-Mead", bounds=[(most - RANGE, most) for most in largest],
        )
        for start in starts
    ]  # fmt: skip
    best = min(ends, key=lambda end: float(end.fun))
    return -float(best.fun), np.asarray(terms(best.x))


def _has_no_colour(found: Energies, terms: Array, correlation: float) -> bool:
    """Whether what the quarter of the windows with most noise leaves beyond the one with least is
    as correlated as white noise, or as the noise elsewhere, would be between.
    """
    variance = _relative_variance(found, terms)
    scaled = found.energy / variance
    kept = scaled <= _limit(found, scaled)
    length = found.basis.shape[0]
    project = found.basis @ found.basis.T

    def left(where: NDArray[np.bool_]) -> Array:
        return np.asarray(found.left[where].T @ found.left[where] / where.sum())

    most, least = (variance >= np.quantile(variance, 0.75)), variance <= np.quantile(variance, 0.25)
    most, least = most & kept, least & kept
    if not (most.any() and least.any()):
        return False
    high, low = left(most), left(least)
    beyond = float(np.trace(high - low) / np.trace(high))
    if beyond <= 0.0:
        return False
    limits = [
        _correlations(project @ toeplitz(rho ** np.arange(length)) @ project)
        for rho in (0.0, correlation)
    ]
    error = ALIKE + ERRORS * np.sqrt(2.0 / (most.sum() * found.freedom)) / beyond
    seen = _correlations(high - low)
    above, below = seen < np.max(limits, axis=0) + error, seen > np.min(limits, axis=0) - error
    return bool(np.all(above & below))


def _correlations(covariance: Array) -> Array:
    """At the first lags, (LAGS,), of a covariance (L, L)."""
    sums = [np.trace(covariance, offset=k) for k in range(LAGS + 1)]
    return np.asarray(np.array(sums[1:]) / sums[0])


def _has_fast_hum(recording: Recording) -> bool:
    """Whether a recording shows a hum that windows do not follow as they follow the motion."""
    hum = find_hum(recording.samples, recording.interval)
    return hum is not None and hum.frequency * recording.interval * period_of(recording) > FAST
