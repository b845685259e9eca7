"""One cycle of the impact oscillator, from one lower turning point to the next, in closed form.

The initial estimates measure in cycles: the length of one, the next depth and the height reached on
the side of the stop follow from the depth it starts at, and nothing needs to be integrated
along the whole recording. So there is no phase to lock onto, and a wrong first guess still points
the right way. All functions work on arrays of cycles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayesimpact.model.jit.compiled import compiled, inner

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CycleEnd:
    """What one cycle leads to, arrays over cycles; NaN when the mass never leaves the stop.

    Attributes
    ----------
    length : time to the next lower turning point, s
    depth : distance of the next lower turning point below y = 0, m
    height : highest displacement in between, m
    impact : whether the mass touched the stop
    """

    length: Floats
    depth: Floats
    height: Floats
    impact: NDArray[np.bool_]


def cycle(
    depth: Floats,
    mass: float,
    c1: ArrayLike,
    k1: ArrayLike,
    c2: ArrayLike,
    g: ArrayLike,
    k2: ArrayLike,
) -> CycleEnd:
    """Follow cycles of m y'' + c1 y' + k1 y + [c2 y' + k2 (y - g)] H(y - g) = 0 from y = -depth.

    Parameters
    ----------
    depth : (n,) m, positive; the cycle starts there at rest, away from the stop
    mass : kg
    c1, k1 : (n,) or one for all, N s/m, N/m; free motion must be underdamped
    c2, g, k2 : likewise, N s/m, m, N/m; g may be negative (a preloaded stop), and so may c2 and k2
        (beyond y = g the oscillator gets softer) as long as c1 + c2 and k1 + k2 do not

    Returns
    -------
    CycleEnd of (n,) arrays.
    """
    rows = np.empty((7, depth.size))
    for row, values in zip(rows, (depth, mass, c1, k1, c2, g, k2), strict=True):
        row[:] = values
    ends, impact = _ends(*rows)
    return CycleEnd(ends[0], ends[1], ends[2], impact)


@compiled()
def _ends(depth, mass, c1, k1, c2, g, k2):  # type: ignore[no-untyped-def]
    """Length, next depth and height (3, n) of the cycles, and whether they touch (n,)."""
    ends, impact = np.empty((3, depth.size)), np.zeros(depth.size, np.bool_)
    for i in range(depth.size):
        one = _end(depth[i], mass[i], c1[i], k1[i], c2[i], g[i], k2[i])
        ends[0, i], ends[1, i], ends[2, i], impact[i] = one
    return ends, impact


@inner()
def _end(depth, mass, c1, k1, c2, g, k2):  # type: ignore[no-untyped-def]
    if g <= -depth:
        return math.nan, math.nan, math.nan, False
    b, square = c1 / (2 * mass), k1 / mass
    w = math.sqrt(max(square - b**2, 1e-6 * square))
    half = math.pi / w
    height = depth * math.exp(-b * half)
    if not (height > g and (k2 != 0 or c2 != 0)):
        return 2 * half, depth * math.exp(-2 * b * half), height, False
    start = math.acos(min(max(-g / depth, -1.0), 1.0)) / w
    onset = _time(b, square, -depth, 0.0, g, 0.0, half, start, 1)
    speed = _motion(b, square, -depth, 0.0, onset)[1]
    stay, peak, leave = _contact(mass, c1 + c2, k1, k2, g, speed)
    if math.isnan(stay):
        return math.nan, math.nan, peak, True
    home, deep = _to_minimum(b, w, g, leave)
    return onset + stay + home, deep, peak, True


@inner()
def _contact(mass, c, k1, k2, g, speed):  # type: ignore[no-untyped-def]
    """Time on the stop, highest displacement, velocity when leaving; NaN where it never leaves."""
    b, square = c / (2 * mass), (k1 + k2) / mass
    centre = k2 * g / (k1 + k2)
    u = g - centre
    root = math.sqrt(abs(square - b**2)) + 1e-9 * math.sqrt(square)
    under = square > b**2
    across = square * u + b * speed
    # Overdamped: without a turning point the mass creeps to rest inside the stop.
    creeps = not under and across <= 0
    if under:
        turn = math.atan2(speed * root, across) / root
        end = turn + math.pi / root
    else:
        ratio = speed * root / across if across > 0 else 0.5
        turn = math.atanh(min(max(ratio, 0.0), 1 - 1e-12)) / root
        end = 2 * turn
        for _ in range(40):
            if creeps or not _motion(b, square, u, speed, end)[0] > u:
                break
            end *= 2
    peak = centre + _motion(b, square, u, speed, turn)[0]
    if creeps or _motion(b, square, u, speed, end)[0] > u:
        return math.nan, peak, math.nan
    start = min(2 * turn, 0.5 * (turn + end))
    stay = _time(b, square, u, speed, u, turn, end, start, -1)
    return stay, peak, _motion(b, square, u, speed, stay)[1]


@inner()
def _to_minimum(b, w, g, speed):  # type: ignore[no-untyped-def]
    """Time from leaving the stop (speed < 0) to the next minimum, and its depth."""
    p, q = g, (speed + b * g) / w
    phase = math.atan2(w * q - b * p, w * p + b * q) % math.pi
    value = math.exp(-b * phase / w) * (p * math.cos(phase) + q * math.sin(phase))
    if value > 0:
        phase += math.pi
        value = math.exp(-b * phase / w) * (p * math.cos(phase) + q * math.sin(phase))
    return phase / w, -value


@inner()
def _motion(b, square, u, v, t):  # type: ignore[no-untyped-def]
    """Position and velocity of u'' + 2 b u' + square u = 0 after time t."""
    s = square - b**2
    root = math.sqrt(abs(s)) + 1e-9 * math.sqrt(square)
    if s > 0:
        decay = math.exp(-b * t)
        c, d = decay * math.cos(root * t), decay * math.sin(root * t) / root
    else:
        fast, slow = math.exp(-(b + root) * t), math.exp(-max(b - root, 0.0) * t)
        c, d = 0.5 * (slow + fast), 0.5 * (slow - fast) / root
    return u * c + (v + b * u) * d, v * c - (square * u + b * v) * d


@inner()
def _time(b, square, u, v, target, low, high, start, sign):  # type: ignore[no-untyped-def]
    """When the motion passes `target` between `low` and `high`, rising (+1) or falling (-1)."""
    t = min(max(start, low), high)
    for _ in range(14):
        value, slope = _motion(b, square, u, v, t)
        if sign * (value - target) < 0:
            low = t
        else:
            high = t
        step = t - (value - target) / slope if slope != 0 else t
        last = t
        t = step if low <= step <= high else 0.5 * (low + high)
        if abs(t - last) <= 1e-13 * abs(t):
            break
    return t
