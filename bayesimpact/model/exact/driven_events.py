"""When does a driven motion next reach the stop? From its power series over a short stretch.

In either regime the displacement z over a stretch of h, x = s / h from 0 to 1, is the series

    a0 = z, a1 = h z',  (n + 1)(n + 2) a[n+2] = -beta h (n + 1) a[n+1] - K h^2 a[n] + force

(the equation of motion, with h^2 p at n = 0 and h^3 r at n = 1). Where (sqrt K + beta) h is small a
few terms hold z to rounding, one expansion serves every look at the stretch, and its coefficients
bound z''. As in `events`, z rises through a level, contact being mirrored. No look at samples: an
impact that fits between two of them is found all the same.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.jit.compiled import compiled, inner

Floats = NDArray[np.float64]

#: Longest stretch that is expanded, in units of 1 / (sqrt K + beta).
LONGEST = 0.5
#: Terms that hold such a stretch to rounding.
TERMS = 17
MAX_STEPS = 20_000
#: The shortest step of a search, a share of the stretch: at a graze the sure steps shrink to none.
SHORTEST = 1e-9
#: A step of `refine` below this share of the time, over which the speed changes by no more than
#: twice this share, leaves no error: the fourth power of it.
LAST_STEP = 1e-4
#: 1 / (n + 2) and 1 / ((n + 1)(n + 2)), which bring speed and force to the term after the next.
ONCE = 1.0 / np.arange(2.0, TERMS + 1)
TWICE = 1.0 / (np.arange(1.0, TERMS) * np.arange(2.0, TERMS + 1))


@compiled()
def terms_needed(rate: float) -> int:
    """Return how many terms hold a stretch to rounding; rate: (sqrt K + beta) h.

    Term n of what a ramp of the force makes, the slowest to fall, is at most rate^(n - 3) / n!.
    """
    left, terms = 1.0 / 6.0, 3
    while terms < TERMS and left > 2e-17:
        terms += 1
        left *= rate / terms
    return terms


@inner(fastmath={"contract"})
def expand(
    path: Floats, bh: float, Kh: float, z: float, v: float, p: float, r: float
) -> tuple[float, float, float]:
    """Fill `path` (n,) with the series of a stretch; return z and z' at its end, a bound of z''.

    All per stretch: bh = beta h, Kh = K h^2, v = h z', p and r the force and its rise, times h^2
    and h^3.
    """
    a, b = z, v
    path[0], path[1] = a, b
    end, speed, bound = a + b, b, 0.0
    force, following = p, r
    for n in range(path.size - 2):
        c = (force * TWICE[n] - (Kh * TWICE[n]) * a) - (bh * ONCE[n]) * b
        path[n + 2] = c
        rate = (n + 2.0) * c
        end += c
        speed += rate
        bound += (n + 1.0) * abs(rate)
        a, b = b, c
        force, following = following, 0.0
    return end, speed, bound


@inner(fastmath={"contract"})
def look(path: Floats, x: float) -> tuple[float, float, float, float]:
    """Return z, z', z'' / 2 and z''' / 6 at x: the series about there."""
    z = v = half = sixth = 0.0
    for n in range(path.size - 1, -1, -1):
        sixth = sixth * x + half
        half = half * x + v
        v = v * x + z
        z = z * x + path[n]
    return z, v, half, sixth


@inner(fastmath={"contract"})
def refine(path: Floats, level: float, x: float) -> tuple[float, float]:
    """Return (x, z') where z is the level, from close by: Newton's method with two terms more."""
    v = 0.0
    for _ in range(8):
        z, v, half, sixth = look(path, x)
        step = (level - z) / v
        bent = half * step / v
        step *= 1.0 - bent + (2.0 * bent * bent - sixth * step * step / v)
        x += step
        v += step * (2.0 * half + 3.0 * sixth * step)
        if abs(step) <= LAST_STEP * x and abs(bent) <= LAST_STEP:
            break
    return x, v


@inner()
def next_rise(
    path: Floats, level: float, end: float, speed: float, bound: float
) -> tuple[float, float]:
    """Return (x, z') at the first rise through `level` within a stretch; x is inf if there is none,
    nan on failure.

    path : its series, from at or below the level
    end, speed, bound : what `expand` returned: z and z' at its end, a bound of z''
    """
    z, v = path[0], path[1]
    if max(z, end) + 0.125 * bound < level or (v <= 0.0 and z + v + 0.5 * bound < level):
        return math.inf, 0.0
    if not (v + speed > 2.0 * bound and z < level):
        found: tuple[float, float] = _walk(path, level, bound)
        return found
    # it rises throughout, and nowhere slower than M / 2: Newton's method cannot miss
    if end < level:
        return math.inf, 0.0
    # a cubic through both ends: time as a function of the height
    height = end - z
    u = (level - z) / height
    u1 = 1.0 - u
    x = u * u * (3.0 - 2.0 * u) + height * u * u1 * (u1 / v - u / speed)
    x, rise = refine(path, level, min(max(x, 0.0), 1.0))
    return min(max(x, 0.0), 1.0), rise


@inner()
def _walk(path: Floats, level: float, bound: float) -> tuple[float, float]:
    """As `next_rise`, by steps that provably cannot jump over a crossing.

    While v x + M x^2 / 2 is less than the distance to the level, M the bound of z'', nothing
    crosses; close to a crossing the largest such step is Newton's, from below.
    """
    if bound == 0.0:
        return math.inf, 0.0
    x, position, speed = 0.0, path[0], path[1]
    for _ in range(MAX_STEPS):
        distance = level - position
        if distance <= 0.0 and speed > 0.0 and x > 0.0:
            return x, speed
        if not x < 1.0:
            return math.inf, 0.0
        root = math.sqrt(speed * speed + 2.0 * bound * max(distance, 0.0))
        step = 2.0 * max(distance, 0.0) / (root + speed) if speed > 0.0 else (root - speed) / bound
        sure = speed > 0.0 and bound * step <= 0.1 * speed
        x = min(x + max(step, SHORTEST), 1.0)
        if sure:  # the speed hardly changes any more
            x, speed = refine(path, level, x)
            return (max(x, 0.0), speed) if x <= 1.0 else (math.inf, 0.0)
        position, speed, _, _ = look(path, x)
    return math.nan, 0.0
