"""Displacement and velocity as a recording shows them, by local polynomials and integrals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks, savgol_filter

from bayesimpact.data.high_pass import before_high_pass
from bayesimpact.data.recording import Recording
from bayesimpact.response.displacement import displacement_of

Array = NDArray[np.float64]

STEADY = 3e-3  # of the largest speed: noise that is left in a measured velocity
WIDEST = 1 / 24  # of a natural period: half width of the polynomials that smooth the motion
APART = 0.6  # natural periods from one lowest point to the next, at least
STANDING_OUT = 6.0  # noise levels by which one lies below the motion beside it


def measured_motion(
    recording: Recording, period: float, noise: float
) -> tuple[Array, Array, Array]:
    """Displacement, velocity and what is read, smoothed, (n,) each, of readings from rest; `noise`
    is theirs.
    """
    reading, rate = smoothed(recording.samples, recording.interval, period, noise)
    if recording.order == 0:
        return reading, rate, reading
    y = displacement_of(recording).samples
    v = reading if recording.order == 1 else np.gradient(y, recording.interval)
    return y, v, reading


def from_rest(
    recording: Recording, offset: float, gain: float = 1.0, state: float = 0.0
) -> Recording:
    """A recording whose readings are counted from rest, and not enlarged by a gain; before its
    high-pass, where it has one that had settled on `state`.
    """
    seen = before_high_pass(recording, offset, state)
    rest = 0.0 if recording.high_pass else offset
    return replace(seen, samples=(seen.samples - rest) / gain)


def smoothed(samples: Array, interval: float, period: float, noise: float) -> tuple[Array, Array]:
    """Displacement and velocity (n,) by local quartics, no wider than the noise asks for."""
    speed = np.pi * float(np.ptp(samples)) / period
    asked = (3.0 * noise / (STEADY * speed * interval)) ** (2 / 3)
    most = min(WIDEST * period / interval, (samples.size - 1) / 2)  # a fitted period may be long
    half = int(np.clip(np.ceil(asked), 3, max(most, 3)))
    y, v = (savgol_filter(samples, 2 * half + 1, 4, deriv=k, delta=interval) for k in (0, 1))
    return np.asarray(y), np.asarray(v)


def lowest_points(y: Array, interval: float, period: float, noise: float) -> NDArray[np.int64]:
    """Samples (m,) at which a motion turns farthest from the stop, one per period, as far as the
    `noise` lets them be told.
    """
    apart = max(APART * period / interval, 1.0)
    found, _ = find_peaks(-y, distance=apart, prominence=STANDING_OUT * noise)
    return np.asarray(found, dtype=np.int64)
