"""Whether a line stands out of a recording's spectrum, whatever the colour of what is around it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesimpact.response.half_cycles import with_motion

Floats = NDArray[np.float64]

CHANCE = 1e-3  # of a recording of noise to show a line
LEAST = 10  # whole periods: below, too few neighbours tell the background
SHARE = 0.01  # of the variance, set by hand: start values cannot be read from a smaller line
NEAR = 2  # bins on either side that Hann's window spreads a steady line over


def has_line(samples: Floats) -> bool:
    """Whether readings (n,) hold an oscillation of ten periods or more, of four samples or more.

    The periodogram over its background is compared with what noise shows. The background of a
    frequency is the larger one of the medians of the octaves below and above it, over the median of
    an exponential variable: what falls towards high frequencies, as drift, random walks and
    integrated noise do, does not stand out of it. The largest of m such ratios exceeds
    ln(m / alpha) with chance alpha (Fisher 1929; background by medians: Mann and Lees 1996);
    between the gaps of a filter more often.

    Parameters
    ----------
    samples : readings of one recording, evenly spaced, of any quantity and unit
    """
    samples = with_motion(samples)
    at = np.arange(samples.size)
    trend = np.polynomial.Polynomial.fit(at, samples, 1)
    # Without a window steps and trends leak into all frequencies.
    power = np.abs(np.fft.rfft((samples - trend(at)) * np.hanning(samples.size))) ** 2
    near = np.convolve(power, np.ones(2 * NEAR + 1), mode="same")
    large = np.flatnonzero(near > SHARE * power.sum())
    large = large[(large >= LEAST) & (2 * large < power.size + LEAST)]
    least = np.log(power.size / CHANCE)
    return any(power[k] > least * _background(power, int(k)) for k in large)


def _background(power: Floats, k: int) -> float:
    """Expected power of noise at a frequency, from the octaves on either side."""
    below = np.median(power[k // 2 : k - NEAR + 1])
    above = np.median(power[k + NEAR : 2 * k])
    return max(float(below), float(above)) / float(np.log(2))
