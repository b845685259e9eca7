"""Readings at an end of a recording that those beside them do not predict, a few at most.

A spike is told by both sides (`spikes`); the first and the last readings have one. What that side
predicts of them is off by as much wherever the motion has a corner, so that a reading at an end has
to be off by far more than any between the ends is, and those next to it must not be: a motion that
begins with a blow, or with a mode that dies out, is off for longer.
"""

from __future__ import annotations

import numpy as np

from bayesimpact.data.faults.bursts import Spike
from bayesimpact.data.faults.fault import Array, gaussian_threshold
from bayesimpact.data.faults.flat import last_digit
from bayesimpact.data.faults.local import best_form, predict_sides, robust_sd, rounding_error
from bayesimpact.data.period import crossing_period

REACH = 3  # readings at an end
FARTHER = 2.0
"""Times the farthest one between the ends: a decay's first corner is its largest. Of drawn decays 0
of 3,000 had such an end, with a fast mode beside it 11 of 3,000, with impacts 0 of 1,600; of single
readings 12, 20 and 40 deviations of the noise off, 44, 70 and 90 % were found."""


def unpredicted_ends(x: Array) -> list[Spike]:
    """Those of the first and the last `REACH` readings of x (n,) that are far off what lies inside
    of them; none where the next one is as well: that is the motion.
    """
    form = best_form(x, crossing_period(x, 1.0))
    found = _first_off(x, form)
    for one in _first_off(x[::-1], form):
        first, end = one.span
        found.append(Spike((x.size - end, x.size - first), one.size, one.strength, one.threshold))
    return found


def _first_off(x: Array, form: tuple[int, int]) -> list[Spike]:
    """Those of the first readings that are off, from the inside outwards."""
    least = gaussian_threshold(x.size * 2 * (REACH + 1))
    found, inside = list[Spike](), None
    for place in range(REACH, -1, -1):
        gap = 1 if inside is None else inside - place
        size, strength = _off(x, form, place, gap, least)
        if strength > least:
            if place == REACH:
                return []
            inside = inside or place + 1
            found.append(Spike((place, place + 1), size, strength, least))
    return found


def _off(
    x: Array, form: tuple[int, int], place: int, gap: int, least: float
) -> tuple[float, float]:
    """By how much one of the first readings is off what follows it after a gap, and that over what
    is usual between the ends; 0 where others there are off by nearly as much.
    """
    deviation = x - predict_sides(x, form, gap).after
    between = deviation[REACH + 1 :]
    level = robust_sd(between)
    if level == 0.0 or not np.isfinite(deviation[place]):
        return 0.0, 0.0
    step = last_digit(x)
    rounded = 0.5 * step + rounding_error(form, gap - 1.0, step)
    limit = max(least * level, FARTHER * float(np.nanmax(np.abs(between))), rounded)
    size = float(deviation[place])
    return (size, abs(size) / level) if abs(size) > limit else (0.0, 0.0)
