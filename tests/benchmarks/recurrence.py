"""The plain way to simulate a recording with numba: sample by sample, each from the one before.

Kept as the peer of `kernel.py` and `peers.py`. Exact in the free motion (a 2 x 2 step matrix per
regime); an event is noticed by a change of sign between two samples and located by bisection and
Newton.
"""

from __future__ import annotations

import math

import numba
import numpy as np


@numba.njit
def step_matrix(b, K, t):
    """2 x 2 matrix of an under-damped motion over the time t."""
    wd = math.sqrt(K - b * b)
    e, c, s = math.exp(-b * t), math.cos(wd * t), math.sin(wd * t) / wd
    return e * (c + b * s), e * s, -e * K * s, e * (c - b * s)


@numba.njit
def crossing(b, K, u, v, level, t):
    """Time at which the motion from (u, v) is at the level, known to lie in (0, t)."""
    low, high = 0.0, t
    start = u - level
    t *= 0.5
    for _ in range(60):
        A, B, C, D = step_matrix(b, K, t)
        x, speed = A * u + B * v - level, C * u + D * v
        if (x > 0.0) == (start > 0.0) and start != 0.0:
            low = t
        else:
            high = t
        moved = t - x / speed
        if not low < moved < high:
            moved = 0.5 * (low + high)
        if abs(moved - t) < 1e-15 * t:
            return moved
        t = moved
    return t


@numba.njit
def sum_of_squares(q, mass, interval, data, out):
    """Sum of squared residuals of one recording, started away from the stop, under-damped.

    data : (n,) samples, m; out : (n,) receives the displacement, m, without the offset
    """
    c1, k1, c2, g, k2, y, v = q[0], q[1], q[2], q[3], q[4], q[5], q[6]
    contact = y > g
    t = 0.0
    out[0] = y
    total = (data[0] - q[10] - y) ** 2
    flight = step_matrix(0.5 * c1 / mass, k1 / mass, interval)
    touch = step_matrix(0.5 * (c1 + c2) / mass, (k1 + k2) / mass, interval)
    for i in range(1, data.size):
        left = interval
        whole = True
        while True:
            if contact:
                b, K, rest = 0.5 * (c1 + c2) / mass, (k1 + k2) / mass, k2 * g / (k1 + k2)
                A, B, C, D = touch if whole else step_matrix(b, K, left)
            else:
                b, K, rest = 0.5 * c1 / mass, k1 / mass, 0.0
                A, B, C, D = flight if whole else step_matrix(b, K, left)
            u = y - rest
            y_next, v_next = rest + A * u + B * v, C * u + D * v
            if (y_next > g) == contact:
                break
            t = crossing(b, K, u, v, g - rest, left)
            A, B, C, D = step_matrix(b, K, t)
            y, v = g, C * u + D * v
            left -= t
            contact = not contact
            whole = False
        y, v = y_next, v_next
        out[i] = y
        total += (data[i] - q[10] - y) ** 2
    return total


@numba.njit
def sums_of_squares(theta, columns, constants, mass, samples, starts, counts, intervals):
    """As `bayesimpact.model.exact.simulate.sums_of_squares` for one vector theta (d,)."""
    sse = np.empty(columns.shape[0])
    q = np.empty(11)
    out = np.empty(counts.max())
    for r in range(columns.shape[0]):
        for i in range(11):
            q[i] = theta[columns[r, i]] if columns[r, i] >= 0 else constants[r, i]
        data = samples[starts[r] : starts[r] + counts[r]]
        sse[r] = sum_of_squares(q, mass, intervals[r], data, out[: counts[r]])
    return sse


@numba.njit(fastmath=True)
def floor(a, b):
    """Sum of squared differences of two stored arrays: no simulation can be faster."""
    total = 0.0
    for i in range(a.size):
        total += (a[i] - b[i]) ** 2
    return total
