"""Smoothed recordings: which filter they passed, and what noise it left.

A Savitzky-Golay filter leaves its signature in the noise: nulls at frequencies that depend on
window and order only. Above the frequencies of the motion the periodogram is noise, so filters are
compared by the Whittle likelihood of its ordinates (Whittle 1953), against every spectrum without
side lobes. The level is estimated where the information is, in the passband, from half cycles on
the free side: a half cycle is a sinusoid whatever the obstacle.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, optimize, signal, stats

from bayesimpact.data.campaign import Smoothing
from bayesimpact.data.gaps import runs
from bayesimpact.data.recording import Recording
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.measurement import covariance, magnitude_response
from bayesimpact.response.half_cycles import spectral_period

Array = NDArray[np.float64]
isotonic_regression: Any = optimize.isotonic_regression
_minimize: Any = optimize.minimize  # stubs of SciPy differ between releases
_minimize_scalar: Any = optimize.minimize_scalar
_periodogram_of: Any = signal.periodogram

WINDOWS = range(5, 62, 2)
ORDERS = (0, 2, 4, 6)
ABOVE = 10.0  # times the lowest frequency of the motion: noise only
DECISIVE = 20.0  # nats that a filter needs over any spectrum without side lobes
LEAST_SHAPE = 5.0  # nats over white noise, for a filter to be compared with anything else
LEAST_ORDINATES = 40
LINE_REACH = 17  # ordinates over which the noise has one level
LINE = 7.0  # nats beyond the largest of as many ordinates of noise
LEAST_FIT = 1e-4  # p-value of the scatter about the filter's spectrum
FLOORS = (-30.0, 10.0)  # log of a white floor over the passband: none, and nothing else
STRONG = 0.3  # of the largest variance: combinations of a half cycle that the filter let pass
LONGEST = 1024  # samples of a half cycle that are used, for eigenvectors in a second
MOTION = 3  # unknowns of a half cycle at a given frequency and decay

Spectra = list[tuple[Array, Array, float]]  # frequencies Hz, ordinates, sampling interval s


@dataclass(frozen=True)
class Fingerprint:
    """The filter that the noise spectrum proves.

    Attributes
    ----------
    smoothing : window and order
    log_ratio : log likelihood over the best spectrum that falls or rises throughout
    nulls : the filter's first nulls, Hz
    """

    smoothing: Smoothing
    log_ratio: float
    nulls: tuple[float, ...]


def find_smoothing(recordings: Sequence[Recording]) -> Fingerprint | None:
    """The Savitzky-Golay filter that the recordings passed, or None when the spectrum proves none.

    Each filter is judged from just below its first null on: no motion can pass for a passband. The
    likeliest one for white noise must then stand, for white or AR(1) noise, against every spectrum
    that falls or rises throughout.
    """
    stretches = [part for r in recordings for part in _stretches(r)]
    spectra = [without_lines(*_periodogram(r)) for r in stretches]
    shortest = min(r.samples.size for r in stretches)
    best, most = None, -np.inf
    for window in WINDOWS:
        for order in ORDERS:
            if order >= window - 1 or window > 0.2 * shortest:
                continue
            smoothing = Smoothing("savgol", window, order)
            found = nulls(smoothing, recordings[0].interval)
            stopband = _above(spectra, 0.8 * found[0]) if found else []
            if sum(p.size for _, p, _ in stopband) < LEAST_ORDINATES:
                continue
            filtered = _filtered(stopband, smoothing)
            if filtered - _white(stopband) < LEAST_SHAPE:
                continue
            unfiltered = _monotone(stopband)
            ratio = filtered - unfiltered
            if ratio > most:
                best, most = (smoothing, found, stopband, unfiltered), ratio
    return None if best is None else _proved(*best)


def _proved(
    smoothing: Smoothing, found: tuple[float, ...], stopband: Spectra, unfiltered: float
) -> Fingerprint | None:
    """The fingerprint of a filter when the spectrum above its first null is what it leaves."""
    shape = _coloured_shape(stopband, smoothing)
    ratio = _log_likelihood(_power(stopband), shape) - unfiltered
    scatters = stats.kstest(_power(stopband) / shape, "expon").pvalue > LEAST_FIT
    return Fingerprint(smoothing, ratio, found) if ratio > DECISIVE and scatters else None


def without_lines(frequency: Array, power: Array, interval: float) -> tuple[Array, Array, float]:
    """A periodogram without the ordinates of a hum: far above all that noise would give there."""
    level = ndimage.median_filter(power, LINE_REACH, mode="nearest") / np.log(2.0)
    noise = power < (np.log(max(power.size, 1)) + LINE) * level
    return frequency[noise], power[noise], interval


def _above(spectra: Spectra, frequency: float) -> Spectra:
    return [(f[f > frequency], p[f > frequency], dt) for f, p, dt in spectra]


@lru_cache(maxsize=4 * len(WINDOWS) * len(ORDERS))
def nulls(smoothing: Smoothing, interval: float, count: int = 3) -> tuple[float, ...]:
    """First frequencies at which the filter lets nothing pass, Hz."""
    frequency = np.linspace(0, 0.5 / interval, 4000)
    response = magnitude_response(smoothing, interval, frequency)
    inner = (response[1:-1] < response[:-2]) & (response[1:-1] <= response[2:])
    inner &= response[1:-1] < 0.5  # not what rounding leaves in the flat passband
    return tuple(float(f) for f in frequency[1:-1][inner][:count])


def smoothed_noise(recordings: Sequence[Recording], smoothing: Smoothing) -> Noise | None:
    """Raw noise level behind a known filter, from half cycles on the free side; None where the
    filter leaves too little of these to tell it.

    Frequency and decay of the half cycles are those that leave the least.
    """
    found = [(r, s) for r in recordings if (s := _half_cycles(r)) is not None]
    halves = [_passband(s, smoothing, r.interval) for r, s in found]
    halves = [one for one in halves if one.numbers.shape[1] > MOTION]
    if not halves:
        return None

    def energy(x: Array) -> float:
        return sum(_left(one, x)[0] for one in halves)

    # windows end where the motion crosses its median, on the free side: the whole cycle is longer
    first = 0.9 * np.pi / max(one.duration for one in halves)
    start = first * np.array([[1.0, 0.0], [0.9, 0.0], [1.0, 0.01]])
    options = {"initial_simplex": start, "xatol": 1e-7 * first, "fatol": np.inf, "maxiter": 400}
    best = _minimize(energy, start[0], method="Nelder-Mead", options=options).x
    parts = [_left(one, best) for one in halves]
    freedom = sum(f for _, f in parts)
    level = float(np.sqrt(sum(e for e, _ in parts) / freedom))
    return Noise(0.0, smoothing, level, float(np.sqrt(0.5 / freedom)), 0.0, "half cycles")


@dataclass(frozen=True, eq=False)
class _HalfCycles:
    """Half cycles of a recording as white numbers in a filter's passband.

    Attributes
    ----------
    duration : of a half cycle, s
    numbers : (W, m), of variance that of the raw noise
    times : (n,) of a half cycle's samples from its middle, s
    white : (n, m), samples to numbers
    """

    duration: float
    numbers: Array
    times: Array
    white: Array


def _half_cycles(recording: Recording) -> tuple[float, Array, Array] | None:
    """Duration, s, windows (W, n) about the lower turning points, and times (n,) from there, s."""
    centred = recording.samples - np.median(recording.samples)
    below = centred < 0
    turns = np.flatnonzero(np.diff(below.astype(int)))
    spans = [j - i for i, j in itertools.pairwise(turns) if below[i + 1]]
    if not spans:
        return None
    half_period = float(np.median([s for s in spans if s > 0.5 * max(spans)]))
    length = min(int(half_period), LONGEST)
    starts = _free_halves(recording, length)
    if length < 8 or not starts:
        return None
    steps = np.arange(length, dtype=np.float64) - 0.5 * (length - 1)
    times = np.asarray(steps * recording.interval, dtype=np.float64)
    rows = np.array([recording.samples[s : s + length] for s in starts])
    return (half_period - 1.0) * recording.interval, rows, times


def _passband(
    halves: tuple[float, Array, Array], smoothing: Smoothing, interval: float
) -> _HalfCycles:
    """What the filter lets pass of half cycles, its power divided out."""
    duration, rows, times = halves
    values, vectors = np.linalg.eigh(covariance(smoothing, interval, times.size))
    strong = values > STRONG * values[-1]
    white = vectors[:, strong] / np.sqrt(values[strong])
    return _HalfCycles(duration, (rows - rows.mean(axis=1, keepdims=True)) @ white, times, white)


def _left(halves: _HalfCycles, x: Array) -> tuple[float, int]:
    """Energy and degrees of freedom that decaying sinusoids leave of half cycles.

    x: angular frequency, rad/s, and decay rate, 1/s.
    """
    times = halves.times
    decay = np.exp(-x[1] * times)
    motion = [np.ones(times.size), decay * np.cos(x[0] * times), decay * np.sin(x[0] * times)]
    basis = np.linalg.qr(halves.white.T @ np.column_stack(motion))[0]
    energy = np.sum((halves.numbers - (halves.numbers @ basis) @ basis.T) ** 2, axis=1)
    freedom = halves.numbers.shape[1] - MOTION
    scale = np.median(energy) / stats.chi2.median(freedom)
    kept = energy <= scale * stats.chi2.ppf(0.999, freedom)
    return float(energy[kept].sum()), int(kept.sum()) * freedom


def _free_halves(recording: Recording, length: int) -> list[int]:
    """Starts of windows centred on the turning points of the free (lower) side."""
    samples, used = recording.samples, recording.used
    centred = samples - np.median(samples)
    deep = -centred > 0.2 * np.max(np.abs(centred))
    edges = np.flatnonzero(np.diff(deep.astype(int)))
    starts = []
    for low, high in itertools.pairwise(edges):
        if deep[low + 1]:
            start = low + 1 + int(np.argmin(centred[low + 1 : high + 1])) - length // 2
            whole = used is None or bool(used[max(start, 0) : start + length].all())
            if start >= 0 and start + length <= samples.size and whole:
                starts.append(int(start))
    return starts


def _stretches(recording: Recording) -> list[Recording]:
    """Parts between samples that are set aside, the longest and those half as long at least."""
    if recording.used is None:
        return [recording]
    parts = runs(recording.used)
    longest = max(end - first for first, end in parts)
    return [recording.part(a, b) for a, b in parts if b - a >= 0.5 * longest]


def _periodogram(recording: Recording) -> tuple[Array, Array, float]:
    """Frequencies above the motion, periodogram ordinates there, sampling interval."""
    interval = recording.interval
    frequency, power = _periodogram_of(
        recording.samples, 1 / interval, window="hann", detrend="linear"
    )
    lowest = ABOVE / (spectral_period(recording.samples, recording.order) * interval)
    # neighbours of a Hann window overlap: every second ordinate is nearly independent
    chosen = np.flatnonzero((frequency > lowest) & (frequency < 0.49 / interval))[::2]
    return frequency[chosen], power[chosen], interval


def _log_likelihood(power: Array, expected: Array) -> float:
    return -float(np.sum(np.log(expected) + power / expected))


def _monotone(spectra: Spectra) -> float:
    """Largest log likelihood of any spectrum that only falls, or only rises, with frequency.

    Independent exponential ordinates: the isotonic regression of their means (Robertson, Wright and
    Dykstra 1988, Order Restricted Statistical Inference, theorem 1.5.2). A power law, a lag, AR(1)
    noise and a white floor are all of this kind; side lobes are not.
    """
    frequency = np.concatenate([f for f, _, _ in spectra])
    power = _power(spectra)[np.argsort(frequency, kind="stable")]
    return max(
        _log_likelihood(power, isotonic_regression(power, increasing=rises).x)
        for rises in (False, True)
    )


def _white(spectra: Spectra) -> float:
    power = _power(spectra)
    return _log_likelihood(power, np.full(power.size, power.mean()))


def _power(spectra: Spectra) -> Array:
    return np.concatenate([p for _, p, _ in spectra])


def _coloured_shape(spectra: Spectra, smoothing: Smoothing) -> Array:
    """Expected ordinates of filtered AR(1) noise on a white floor, at their most likely."""
    power, angle = _power(spectra), np.concatenate([2 * np.pi * f * dt for f, _, dt in spectra])
    filtered = _passed(spectra, smoothing)

    def expected(x: Array) -> Array:
        rho = np.tanh(x[2])
        shape = filtered * (1 - rho) ** 2 / (1 - 2 * rho * np.cos(angle) + rho**2)
        return np.asarray(np.exp(x[0]) * shape + np.exp(x[1]))

    start = np.append(np.log(_levels(power, filtered)), 0.1)
    found = _minimize(
        lambda x: -_log_likelihood(power, expected(x)),
        start,
        method="Nelder-Mead",
        options={"maxiter": 400},
    )
    return expected(found.x)


def _filtered(spectra: Spectra, smoothing: Smoothing) -> float:
    """Best log likelihood of filtered white noise on a white floor (rounding)."""
    power, shape = _power(spectra), _passed(spectra, smoothing)
    level, floor = _levels(power, shape)
    return _log_likelihood(power, level * shape + floor)


def _passed(spectra: Spectra, smoothing: Smoothing) -> Array:
    """Share of the power that the filter lets pass, of every ordinate."""
    return np.concatenate([magnitude_response(smoothing, dt, f) ** 2 for f, _, dt in spectra])


def _levels(power: Array, shape: Array) -> Array:
    """Power of the filtered noise and of the floor that fit the ordinates best."""

    def expected(log_floor: float) -> Array:
        relative = shape + np.exp(log_floor)
        return np.asarray(relative * np.mean(power / relative))

    found = _minimize_scalar(
        lambda x: -_log_likelihood(power, expected(x)), bounds=FLOORS, method="bounded"
    )
    relative = shape + np.exp(found.x)
    level = float(np.mean(power / relative))
    return np.array([level, level * np.exp(found.x)])
