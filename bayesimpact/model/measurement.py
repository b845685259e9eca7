"""The measuring chain after the probe: linear filters that a recording passes."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import Smoothing

Array = NDArray[np.float64]

FILTERS = 64  # whose weights are kept: predictions ask for them anew every time


def smooth(samples: Array, smoothing: Smoothing | None, interval: float) -> Array:
    """Samples (..., n) after the filter; the ends as the chain treats them.

    Savitzky-Golay: polynomial fits of the end windows (Savitzky and Golay 1964). Lag: exact
    first-order low pass of a staircase signal, started at rest on the first sample. A signal
    of NaN stays NaN.
    """
    if smoothing is None:
        return samples
    from scipy import signal  # slow to import, and most recordings are not smoothed

    if smoothing.kind == "savgol":
        return _savgol(samples, smoothing.window, smoothing.polyorder)
    decay = np.exp(-interval / smoothing.time_constant)
    state = decay * samples[..., :1]
    filtered, _ = signal.lfilter([1.0 - decay], [1.0, -decay], samples, axis=-1, zi=state)
    return np.asarray(filtered, dtype=np.float64)


def _savgol(samples: Array, window: int, order: int) -> Array:
    from scipy.ndimage import convolve1d

    # SciPy's savgol_filter fits the end windows with LAPACK, which refuses NaN, and whose last bit
    # depends on the number of rows; a resumed sampler needs the same bits
    filtered = convolve1d(samples, _taps(window, order), axis=-1, mode="constant")
    half, ends = window // 2, _end_weights(window, order)
    for read, out in ((samples, filtered), (samples[..., ::-1], filtered[..., ::-1])):
        out[..., :half] = np.einsum("...w,hw->...h", read[..., :window], ends)
    return np.asarray(filtered, dtype=np.float64)


@lru_cache(maxsize=FILTERS)
def _taps(window: int, order: int) -> Array:
    """Weights (window,) of the samples in the middle."""
    from scipy.signal import savgol_coeffs

    return _kept(savgol_coeffs(window, order))


@lru_cache(maxsize=FILTERS)
def _end_weights(window: int, order: int) -> Array:
    """Weights (window // 2, window) of the samples at an end."""
    half = window // 2
    basis = np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, window), order + 1))[0]
    return _kept(np.einsum("hk,wk->hw", basis[:half], basis))


def _kept(values: Array) -> Array:
    """An array that may be shared: nobody writes into it."""
    found = np.asarray(values, dtype=np.float64)
    found.setflags(write=False)
    return found


def high_passed(samples: Array, corner: float, interval: float) -> Array:
    """Samples (..., n) after a first-order high-pass of a corner in Hz that takes nothing off the
    first. What it takes off, z with z' = w (y - z), follows y between two samples as the mean of
    the parabolas through three: exact for a line, else to the fourth order of the interval.
    """
    from scipy import signal  # slow to import

    step = 2.0 * np.pi * corner * interval
    if step == 0.0:
        return samples.copy()
    gone = -np.expm1(-step)  # share of a constant that an interval takes off
    new = 1.0 - gone / step  # of which by the later sample
    between = samples.copy()
    between[..., 1:-1] -= np.diff(samples, 2, axis=-1) / 12.0
    first = -new * between[..., :1]
    constant, _ = signal.lfilter([new, gone - new], [1.0, gone - 1.0], between, axis=-1, zi=first)
    return np.asarray(samples - constant)


def remembered(corner: float, interval: float, count: int) -> Array:
    """Share (count,) of what a high-pass had settled on at the first sample that it still takes off
    at each.
    """
    return np.asarray(np.exp(-2.0 * np.pi * corner * interval * np.arange(count)))


def settling(corner: Array, times: Array) -> Array:
    """What a high-pass of a corner (..., 1), Hz, makes at `times` (n,) of a line of slope 1, (...,
    n), s: (1 - exp(-w t)) / w.
    """
    turns = np.maximum(2.0 * np.pi * corner * times, 1e-300)
    return np.asarray(times * -np.expm1(-turns) / turns)


def magnitude_response(smoothing: Smoothing | None, interval: float, frequency: Array) -> Array:
    """Amplitude response of the filter at `frequency` in Hz."""
    if smoothing is None:
        return np.ones_like(frequency)
    angle = 2 * np.pi * frequency * interval
    if smoothing.kind == "savgol":  # the weights are the same on both sides
        middle, *side = _taps(smoothing.window, smoothing.polyorder)[smoothing.window // 2 :]
        response = np.polynomial.chebyshev.chebval(np.cos(angle), [middle, *2 * np.array(side)])
    else:
        decay = np.exp(-interval / smoothing.time_constant)
        response = (1.0 - decay) / (1.0 - decay * np.exp(-1j * angle))
    return np.asarray(np.abs(response), dtype=np.float64)


def covariance(smoothing: Smoothing | None, interval: float, length: int) -> Array:
    """Of `length` samples of white noise of variance 1 after the filter, (length, length)."""
    from scipy.linalg import toeplitz

    size = 8 * length
    frequency: Array = np.asarray(np.fft.rfftfreq(size, interval), dtype=np.float64)
    power = magnitude_response(smoothing, interval, frequency) ** 2
    return np.asarray(toeplitz(np.fft.irfft(power, size)[:length]))


def edge(smoothing: Smoothing | None, interval: float) -> int:
    """Samples at an end of a recording that the filter treats differently."""
    if smoothing is None:
        return 0
    if smoothing.kind == "savgol":
        return smoothing.window // 2
    return int(np.ceil(5 * smoothing.time_constant / interval))
