"""Does something on one side shorten the swings? Told from how long half cycles last, no physics.

About its rest a spring is left for as long on one side as on the other. An obstacle on one side
turns the mass back sooner: deep in it the mass swings at sqrt((k1 + k2) / m) instead of
sqrt(k1 / m), so the half cycle on its side lasts r = sqrt(k1 / (k1 + k2)) of the other. That holds
for displacements and accelerations. A velocity is as long positive as negative, whatever is hit.
Rest is taken for the median over time of whole cycles in the second half: of the readings
themselves hardly any lie near rest, through which the motion is fastest. Where the obstacle is hit
there as well, that is not rest but what halves the time, and about half of the difference is left.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.period import noise_level

CYCLES = 3
"""At the beginning of a recording, where swings are largest; so many one by one alike are no
chance of a hand that lets go."""
BEYOND = 3.0  # standard deviations of noise: their sum is once in 370 recordings by chance

BETWEEN = 16  # places on a line from one reading to the next


def shortened(samples: NDArray[np.float64]) -> float | None:
    """How much shorter half cycles to one side are, 0 to 1: the least of the first three cycles.

    0 where it is not the same side in all of them, or by no more than noise does it; None for fewer
    cycles.

    Parameters
    ----------
    samples : (n,) evenly spaced, any unit; what is not finite is left out
    """
    x = samples[np.isfinite(samples)]
    if x.size < 3 or x.max() == x.min():
        return None
    rough, _ = _crossings(x, _median_over_time(x, x.size // 2, x.size - 1))
    if rough.size < 2 * CYCLES + 1:
        return None
    # a part of a cycle draws the median to its side
    late = rough[rough >= x.size / 2.0]
    whole = late[: 2 * ((late.size - 1) // 2) + 1] if late.size > 2 else rough[: 2 * CYCLES + 1]
    crossings, errors = _crossings(x, _median_over_time(x, whole[0], whole[-1]))
    halves = np.diff(crossings)
    if halves.size < 2 * CYCLES:
        return None
    first, second = halves[: 2 * CYCLES].reshape(CYCLES, 2).T
    difference = first - second
    weights = np.where(np.arange(2 * CYCLES + 1) % 2, 2.0, -2.0)  # of the crossings in their sum
    weights[[0, -1]] = -1.0
    noise = float(np.sqrt(np.sum((weights * errors[: weights.size]) ** 2)))
    alike = abs(np.sign(difference).sum()) == CYCLES
    if not alike or abs(difference.sum()) < BEYOND * noise:
        return 0.0
    return float(np.min(np.abs(difference) / np.maximum(first, second)))


def _median_over_time(x: NDArray[np.float64], first: float, last: float) -> float:
    """What readings (n,) with lines between them are above for as long as below, from one place, in
    samples, to another.
    """
    place = np.linspace(first, last, BETWEEN * int(np.ceil(last - first)) + 1)
    return float(np.median(np.interp(place, np.arange(x.size), x)))


def _crossings(
    x: NDArray[np.float64], rest: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Where readings (n,) cross their rest, in samples, and the standard deviations (crossings,)
    that noise gives those places.
    """
    way = x - rest
    largest = float(np.max(np.abs(way)))
    noise = float(np.median(np.abs(np.diff(x, 2)))) / (0.6745 * np.sqrt(6.0))
    # as in `crossing_period`: what crosses rest has come from beyond a band about it
    outside = np.flatnonzero(np.abs(way) > np.clip(4.0 * noise, 0.02 * largest, 0.2 * largest))
    turns = np.flatnonzero(np.diff(np.sign(way[outside])) != 0)
    times, slopes = [], []
    for before, after in zip(outside[turns], outside[turns + 1], strict=True):
        span = way[before : after + 1]
        last = int(np.flatnonzero(np.diff(span >= 0.0))[-1])
        times.append(before + last + span[last] / (span[last] - span[last + 1]))
        # of the whole way from one side to the other, of which noise changes less
        slopes.append(abs(span[-1] - span[0]) / (span.size - 1))
    return np.array(times), noise_level(x) / np.array(slopes)
