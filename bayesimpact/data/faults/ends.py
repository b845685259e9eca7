"""Readings at an end of a recording that those beside them do not predict, a few at most.

A spike is told by both sides (`spikes`); the first and the last readings have one. What that side
predicts of them is off by as much wherever the motion has a corner, so that a reading at an end has
to be off by far more than any between the ends is, and those next to it must not be: a motion that
begins with a blow, or with a mode that dies out, is off for longer.

Of drawn decays 0 of 3,000 had such an end, with a fast mode beside it 5 of 3,000, with impacts 0 of
1,600, with quadratic drag and time stamps that jitter 0 of 150. Of single readings that were 12, 20
and 40 deviations of the noise off, 22, 59 and 87 % were found.

A fit predicts an end from all readings, and what it leaves has no corners of the motion: there a
reading need be beyond chance only, and beyond those near it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bayesimpact.data.faults.bursts import Spike
from bayesimpact.data.faults.fault import Array, gaussian_threshold
from bayesimpact.data.faults.flat import last_digit
from bayesimpact.data.faults.local import best_form, predict_sides, robust_sd, rounding_error
from bayesimpact.data.period import crossing_period

REACH = 3  # readings at an end
USUAL = 97.0  # percentile of such deviations that the motion alone may reach
BEYOND = 4.0  # times that percentile
NEAR = 24  # readings beside an end, where what begins there and dies out is
FARTHER = 2.0  # times the farthest of those


def unpredicted_ends(x: Array) -> list[Spike]:
    """Those of the first and the last `REACH` readings of x (n,) that are far off what lies inside
    of them; none where the next one is as well: that is the motion.
    """
    form = best_form(x, crossing_period(x, 1.0))
    return _of_both_ends(x, lambda turned, place, gap: _off(turned, form, place, gap))


def missed_ends(residual: Array) -> list[Spike]:
    """Those of the first and the last `REACH` readings that a fit misses beyond chance and by far
    more than the ones near; none where the next one is missed so as well.

    What dies out by less than a half from one reading to the next is missed near the end too.
    """
    return _of_both_ends(residual, _missed)


def _of_both_ends(x: Array, off: Callable[[Array, int, int], tuple[float, float]]) -> list[Spike]:
    """Those of the first readings that are off, and of the last ones, which are the first of what
    is turned round.
    """
    found = _first_off(x, off)
    for one in _first_off(x[::-1], off):
        first, end = one.span
        found.append(Spike((x.size - end, x.size - first), one.size, one.strength, one.threshold))
    return found


def _first_off(x: Array, off: Callable[[Array, int, int], tuple[float, float]]) -> list[Spike]:
    """Those of the first readings that are off, from the inside outwards."""
    least = _least(x)
    found, inside = list[Spike](), None
    for place in range(REACH, -1, -1):
        size, strength = off(x, place, 1 if inside is None else inside - place)
        if strength > least:
            if place == REACH:
                return []
            inside = inside or place + 1
            found.append(Spike((place, place + 1), size, strength, least))
    return found


def _least(x: Array) -> float:
    """Standard deviations beyond which no reading at either end is by chance."""
    return gaussian_threshold(x.size * 2 * (REACH + 1))


def _missed(residual: Array, place: int, gap: int) -> tuple[float, float]:
    """By how much a fit misses one of the first readings, and that over its noise; 0 where it
    misses others near by nearly as much.
    """
    level, near = robust_sd(residual), np.abs(residual[place + gap : place + gap + NEAR])
    if level == 0.0 or not near.size:
        return 0.0, 0.0
    size = float(residual[place])
    limit = max(_least(residual) * level, FARTHER * float(near.max()))
    return (size, abs(size) / level) if abs(size) > limit else (0.0, 0.0)


def _off(x: Array, form: tuple[int, int], place: int, gap: int) -> tuple[float, float]:
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
    usual = float(np.nanpercentile(np.abs(between), USUAL))
    near = float(np.nanmax(np.abs(between[:NEAR])))
    limit = max(_least(x) * level, BEYOND * usual, FARTHER * near, rounded)
    size = float(deviation[place])
    return (size, abs(size) / level) if abs(size) > limit else (0.0, 0.0)
