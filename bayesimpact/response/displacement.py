"""The displacement behind a velocity or an acceleration, as start values and pictures need it.

Integrating a reading adds up its noise and its offset to a drift that soon exceeds the motion. A
high-pass filter that removes it removes the wandering of the cycles' middle as well, by which the
gap shows. But the motion itself says where its drift is zero: wherever the mass is free, the
acceleration vanishes where the displacement does, and is largest, on the side without a stop, where
the velocity vanishes. The integral is anchored at these places, once or twice a cycle, and the
drift, straight between them, taken out. So noise adds up over a fraction of a cycle only.

The likelihood never sees this: it compares what was read.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.ndimage import uniform_filter1d

from bayesimpact.data.recording import Recording
from bayesimpact.response import local
from bayesimpact.response.half_cycles import HalfCycles, half_cycles, spectral_period

Floats = NDArray[np.float64]

BRIEF = 1 / 24  # of a period, as where `half_cycles` looks for turning points
AVERAGED = 9  # extremes of a velocity, flat as they are, that share one straight drift


@dataclass(frozen=True, eq=False)
class Displacement:
    """A recording as a displacement.

    Attributes
    ----------
    samples : (n,) m; of a displacement the readings themselves
    bias : offset of the probe that was taken off a velocity or an acceleration; None of a
        displacement, whose rest reading is part of the motion
    noise : standard deviation of the reading's own noise, in its unit
    """

    samples: Floats
    bias: float | None
    noise: float


def displacement_of(recording: Recording, *, both: bool = False) -> Displacement:
    """The displacement of a recording of any quantity; `both` says that there are two stops."""
    return displacement(recording.samples, recording.interval, recording.order, both=both)


def displacement(
    samples: Floats, interval: float, order: int, *, both: bool = False
) -> Displacement:
    """The displacement of which `samples` (n,) are the `order`-th time derivative.

    Parameters
    ----------
    samples : (n,) m, m/s or m/s2, offset and noise included
    interval : s
    order : 0, 1 or 2
    both : there are two stops, between which flights may be short
    """
    period = spectral_period(samples, order)
    noise = local.noise_level(samples, period)
    if order == 0:
        return Displacement(samples, None, noise)
    slow = without_brief(samples, period) if order == 2 and both else samples
    bias = _bias(samples, slow, period, noise)
    halves = half_cycles(slow, bias, period, noise)
    rate = samples - bias
    if order == 2:
        still = halves.peaks[halves.side > 0]  # the stop is on the side of negative acceleration
        rate = _integral(rate, interval, still, period)
        return Displacement(_integral(rate, interval, halves.crossings, period), bias, noise)
    return Displacement(_integral(rate, interval, halves.peaks, period, AVERAGED), bias, noise)


def without_brief(samples: Floats, period: float) -> Floats:
    """Accelerations (n,) without what is too brief to be a half cycle: a dashpot that pulls where
    the mass leaves a stop, or pushes where it comes.
    """
    return np.asarray(uniform_filter1d(samples, max(int(BRIEF * period), 1), mode="nearest"))


def _bias(samples: Floats, slow: Floats, period: float, noise: float) -> float:
    """Mean over whole cycles: a derivative of a motion that stays in place has none."""
    bias = float(samples.mean())
    for _ in range(3):
        halves: HalfCycles = half_cycles(slow, bias, period, noise)
        whole = 2 * (halves.side.size // 2)
        if whole == 0:
            break
        first, last = halves.crossings[0], halves.crossings[whole]
        bias = float(samples[int(np.ceil(first)) : int(np.floor(last)) + 1].mean())
    return bias


def _integral(
    rate: Floats, interval: float, zeros: Floats, period: float, averaged: int = 1
) -> Floats:
    """Integral of `rate` (n,) over time that vanishes at `zeros`, positions in samples.

    Its drift is taken from straight lines through `averaged` zeros each. After the last zero, where
    the motion is lost in the noise, the mean over a period vanishes.
    """
    times = np.arange(rate.size, dtype=np.float64)
    integral = CubicSpline(times, rate * interval).antiderivative()
    values = integral(times)
    if zeros.size == 0:
        return np.asarray(values - np.polyval(np.polyfit(times, values, 1), times))
    at, drift = zeros, integral(zeros)
    if min(averaged, zeros.size) > 2:
        drift = _lines(at, drift, min(averaged, zeros.size))
    later = np.arange(zeros[-1] + period, rate.size - 0.5 * period, period)
    if later.size:
        twice = integral.antiderivative()
        means = (twice(later + 0.5 * period) - twice(later - 0.5 * period)) / period
        at, drift = np.append(at, later), np.append(drift, means)
    return np.asarray(values - np.interp(times, at, drift))


def _lines(x: Floats, y: Floats, count: int) -> Floats:
    """Values at x (k,) of the straight lines through the `count` points about each."""
    first = np.clip(np.arange(x.size) - count // 2, 0, x.size - count)
    rows = first[:, None] + np.arange(count)
    centre, level = x[rows].mean(axis=1), y[rows].mean(axis=1)
    along = x[rows] - centre[:, None]
    slope = np.sum(along * y[rows], axis=1) / np.sum(along**2, axis=1)
    return np.asarray(level + slope * (x - centre))
