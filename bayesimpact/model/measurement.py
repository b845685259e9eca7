"""The measuring chain after the probe: linear filters that smooth a recording."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import Smoothing

Array = NDArray[np.float64]


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
    from scipy import signal

    # SciPy fits the end windows with LAPACK, which refuses NaN, and whose last bit depends on the
    # number of rows; a resumed sampler needs the same bits
    filtered = signal.savgol_filter(samples, window, order, axis=-1, mode="constant")
    half = window // 2
    place = np.linspace(-1.0, 1.0, window)
    basis = np.linalg.qr(np.vander(place, order + 1))[0]
    ends = np.einsum("hk,wk->hw", basis[:half], basis)
    for read, out in ((samples, filtered), (samples[..., ::-1], filtered[..., ::-1])):
        out[..., :half] = np.einsum("...w,hw->...h", read[..., :window], ends)
    return np.asarray(filtered, dtype=np.float64)


def gain(smoothing: Smoothing | None, interval: float, frequency: Array) -> Array:
    """Amplitude response of the filter at `frequency` in Hz."""
    if smoothing is None:
        return np.ones_like(frequency)
    from scipy import signal

    angle = 2 * np.pi * frequency * interval
    if smoothing.kind == "savgol":
        taps = signal.savgol_coeffs(smoothing.window, smoothing.polyorder)
        _, response = signal.freqz(taps, worN=angle)
    else:
        decay = np.exp(-interval / smoothing.time_constant)
        _, response = signal.freqz([1.0 - decay], [1.0, -decay], worN=angle)
    return np.asarray(np.abs(response), dtype=np.float64)


def edge(smoothing: Smoothing | None, interval: float) -> int:
    """Samples at an end of a recording that the filter treats differently."""
    if smoothing is None:
        return 0
    if smoothing.kind == "savgol":
        return smoothing.window // 2
    return int(np.ceil(5 * smoothing.time_constant / interval))
