"""How long one period of a recording is: only enough to tell a usable recording from a stub."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def crossing_period(samples: NDArray[np.float64], interval: float) -> float | None:
    """Mean time between crossings of the median in one direction, s; None below three crossings.

    Parameters
    ----------
    samples : (n,) any unit
    interval : sampling interval, s

    Notes
    -----
    A crossing counts only once the signal has left a band about the median on the other side, so
    noise at the crossing is not counted twice. The band is four standard deviations of the noise
    as second differences show it, but 2 to 20 % of the largest excursion.
    """
    if samples.size < 3:
        return None
    centred = samples - np.median(samples)
    largest = float(np.max(np.abs(centred)))
    if largest == 0.0:
        return None
    noise = float(np.median(np.abs(np.diff(samples, 2)))) / (0.6745 * np.sqrt(6.0))
    band = float(np.clip(4.0 * noise, 0.02 * largest, 0.2 * largest))
    outside = np.flatnonzero(np.abs(centred) > band)
    sides = np.sign(centred[outside])
    crossings = outside[1:][np.diff(sides) != 0]
    whole = (crossings.size - 1) // 2
    if whole < 1:
        return None
    return float((crossings[2 * whole] - crossings[0]) * interval / whole)


def noise_level(samples: NDArray[np.float64]) -> float:
    """Standard deviation of white noise, from the bulk of sixth differences; 0 for none.

    A motion of 100 samples per period leaves 6e-8 of its amplitude in a sixth difference.
    """
    if samples.size < 8:
        return 0.0
    return float(np.median(np.abs(np.diff(samples, 6))) / (0.6745 * np.sqrt(924.0)))
