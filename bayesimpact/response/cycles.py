"""One cycle of the impact oscillator, from one lower turning point to the next, in closed form.

The initial estimates measure in cycles: the length of one, the next depth and the height reached on
the side of the stop follow from the depth it starts at, and nothing needs to be integrated
along the whole recording. So there is no phase to lock onto, and a wrong first guess still points
the right way. All functions work on arrays of cycles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

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
    depth, c1, k1, c2, g, k2 = np.broadcast_arrays(depth, c1, k1, c2, g, k2)
    b, w0 = c1 / (2 * mass), np.sqrt(k1 / mass)
    w = np.sqrt(np.maximum(w0**2 - b**2, 1e-6 * w0**2))
    half = np.pi / w
    height = np.asarray(depth * np.exp(-b * half))
    length, after = 2 * half, depth * np.exp(-2 * b * half)
    hit = np.flatnonzero((height > g) & ((k2 != 0) | (c2 != 0)) & (g > -depth))
    if hit.size:
        d, gap, still = depth[hit], g[hit], np.zeros(hit.size)
        free = (b[hit], w0[hit] ** 2)
        start = np.arccos(np.clip(-gap / d, -1.0, 1.0)) / w[hit]
        onset = _solve(*free, -d, still, gap, still, half[hit], start, 1)
        speed = _motion(*free, -d, still, onset)[1]
        stay, peak, leave = _contact(mass, c1[hit] + c2[hit], k1[hit], k2[hit], gap, speed)
        home, deep = _to_minimum(b[hit], w[hit], gap, leave)
        length[hit], after[hit], height[hit] = onset + stay + home, deep, peak
    lost = g <= -depth
    length[lost] = after[lost] = height[lost] = np.nan
    impact = np.zeros(depth.shape, dtype=bool)
    impact[hit] = True
    return CycleEnd(length, after, height, impact)


def _contact(
    mass: float, c: Floats, k1: Floats, k2: Floats, g: Floats, speed: Floats
) -> tuple[Floats, Floats, Floats]:
    """Time on the stop, highest displacement, velocity when leaving."""
    b, square = c / (2 * mass), (k1 + k2) / mass
    centre = k2 * g / (k1 + k2)
    u = g - centre
    root = np.sqrt(np.abs(square - b**2)) + 1e-9 * np.sqrt(square)
    under = square > b**2
    across = square * u + b * speed
    # Overdamped: without a turning point the mass creeps to rest inside the stop.
    creeps = ~under & (across <= 0)
    ratio = np.where(across > 0, speed * root / np.where(across > 0, across, 1.0), 0.5)
    over = np.arctanh(np.clip(ratio, 0.0, 1 - 1e-12))
    turn = np.where(under, np.arctan2(speed * root, across), over) / root
    highest = _motion(b, square, u, speed, turn)[0]
    end = np.where(under, turn + np.pi / root, 2 * turn)
    for _ in range(40):
        still = ~under & ~creeps & (_motion(b, square, u, speed, end)[0] > u)
        if not still.any():
            break
        end = np.where(still, 2 * end, end)
    stays = creeps | (_motion(b, square, u, speed, end)[0] > u)
    stay = _solve(b, square, u, speed, u, turn, end, np.minimum(2 * turn, 0.5 * (turn + end)), -1)
    leave = _motion(b, square, u, speed, stay)[1]
    stay = np.where(stays, np.nan, stay)
    return stay, centre + highest, leave


def _to_minimum(b: Floats, w: Floats, g: Floats, speed: Floats) -> tuple[Floats, Floats]:
    """Time from leaving the stop (speed < 0) to the next minimum, and its depth."""
    p, q = g, (speed + b * g) / w
    phase = np.arctan2(w * q - b * p, w * p + b * q) % np.pi
    value = np.exp(-b * phase / w) * (p * np.cos(phase) + q * np.sin(phase))
    phase = np.where(value > 0, phase + np.pi, phase)
    value = np.exp(-b * phase / w) * (p * np.cos(phase) + q * np.sin(phase))
    return phase / w, -value


def _motion(b: Floats, square: Floats, u: Floats, v: Floats, t: Floats) -> tuple[Floats, Floats]:
    """Position and velocity of u'' + 2 b u' + square u = 0 after time t."""
    s = square - b**2
    root = np.sqrt(np.abs(s)) + 1e-9 * np.sqrt(square)
    x = root * t
    fast, slow = np.exp(-(b + root) * t), np.exp(-np.maximum(b - root, 0.0) * t)
    decay = np.exp(-b * t)
    c = np.where(s > 0, decay * np.cos(x), 0.5 * (slow + fast))
    d = np.where(s > 0, decay * np.sin(x), 0.5 * (slow - fast)) / root
    return u * c + (v + b * u) * d, v * c - (square * u + b * v) * d


def _solve(
    b: Floats,
    square: Floats,
    u: Floats,
    v: Floats,
    target: Floats,
    low: Floats,
    high: Floats,
    start: Floats,
    sign: int,
) -> Floats:
    """When the motion passes `target` between `low` and `high`, rising (+1) or falling (-1)."""
    t = np.clip(start, low, high)
    low, high = low.astype(np.float64), high.astype(np.float64)
    for _ in range(14):
        value, slope = _motion(b, square, u, v, t)
        before = sign * (value - target) < 0
        low, high = np.where(before, t, low), np.where(before, high, t)
        with np.errstate(over="ignore"):
            step = t - (value - target) / np.where(slope == 0, np.inf, slope)
        inside = (step >= low) & (step <= high)
        last, t = t, np.where(inside, step, 0.5 * (low + high))
        if np.all(np.abs(t - last) <= 1e-13 * np.abs(t)):
            break
    return np.asarray(t)
