"""One cycle of the impact oscillator, from one lower turning point to the next, in closed form.

The cycle is the quick estimates' measuring unit: its length, the next depth and the height reached
on the side of the stop follow from the depth it starts at, and nothing needs to be integrated
along the whole recording. So there is no phase to lock onto, and a wrong first guess still points
the right way. All functions work on arrays of cycles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
    depth: Floats, mass: float, c1: float, k1: float, c2: Floats, g: Floats, k2: Floats
) -> CycleEnd:
    """Follow cycles of m y'' + c1 y' + k1 y + [c2 y' + k2 (y - g)] H(y - g) = 0 from y = -depth.

    Parameters
    ----------
    depth : (n,) m, positive; the cycle starts there at rest, away from the stop
    mass, c1, k1 : kg, N s/m, N/m, the same for all cycles; free motion must be underdamped
    c2, g, k2 : (n,) N s/m, m, N/m; g may be negative (a preloaded stop)

    Returns
    -------
    CycleEnd of (n,) arrays.
    """
    depth, c2, g, k2 = np.broadcast_arrays(depth, c2, g, k2)
    b, w0 = c1 / (2 * mass), np.sqrt(k1 / mass)
    w = np.sqrt(w0**2 - b**2)
    half = np.pi / w
    top = depth * np.exp(-b * half)
    length = np.full(depth.shape, 2 * half)
    after = depth * np.exp(-2 * b * half)
    height = top.astype(np.float64)
    hit = np.flatnonzero((top > g) & (k2 + c2 > 0) & (g > -depth))
    if hit.size:
        d, gap = depth[hit], g[hit]
        free = (np.full(hit.size, b), np.full(hit.size, w0**2))
        start = np.arccos(np.clip(-gap / d, -1.0, 1.0)) / w
        touch = _solve(*free, -d, np.zeros_like(d), gap, np.zeros_like(d), half + 0 * d, start, 1)
        speed = _motion(*free, -d, np.zeros_like(d), touch)[1]
        stay, peak, leave = _contact(mass, c1 + c2[hit], k1, k2[hit], gap, speed)
        home, deep = _to_minimum(b, w, gap, leave)
        length[hit], after[hit], height[hit] = touch + stay + home, deep, peak
    lost = g <= -depth
    length[lost] = after[lost] = height[lost] = np.nan
    impact = np.zeros(depth.shape, dtype=bool)
    impact[hit] = True
    return CycleEnd(length, after, height, impact)


def _contact(
    mass: float, c: Floats, k1: float, k2: Floats, g: Floats, speed: Floats
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


def _to_minimum(b: float, w: float, g: Floats, speed: Floats) -> tuple[Floats, Floats]:
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
        step = t - (value - target) / np.where(slope == 0, np.inf, slope)
        inside = (step >= low) & (step <= high)
        last, t = t, np.where(inside, step, 0.5 * (low + high))
        if np.all(np.abs(t - last) <= 1e-13 * np.abs(t)):
            break
    return np.asarray(t)
