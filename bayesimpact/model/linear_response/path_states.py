"""States of laws with a memory along a motion that is given.

The motion drives the state, the state does not drive the motion: it follows from the samples one by
one. A state of the path goes from turning point to turning point in closed form; between samples
these are where a velocity that changes in a line is zero. A rate is integrated over parts of a
sampling interval, in which the motion changes in a line, with the state's own decay exact
(exponential Euler method; Hochbruck and Ostermann 2010, Acta Numerica 19:209).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from bayesimpact.model.jit.callback import call_law
from bayesimpact.model.jit.compiled import compiled
from bayesimpact.model.law_table import LAW_RATE, LAW_TRAVEL

PARTS = 4  # of a sampling interval: an impact begins and ends within one


@compiled(nogil=True)
def follow(law: Any, y: Any, v: Any, d: Any, t: Any, p: Any, q: Any, z: Any) -> None:
    """Fill z (n,) with a law's state at samples of displacement, velocity, indentation and time.

    z[0] is given.
    p and q are the addresses of the law's parameters and of the slots. A law without a memory
    leaves z as it is.
    """
    if law[LAW_TRAVEL]:
        _follow_path(law[LAW_TRAVEL], y, v, d, t, p, q, z)
    elif law[LAW_RATE]:
        _follow_time(law[LAW_RATE], y, v, d, t, p, q, z)


@compiled(nogil=True)
def _follow_path(travel: Any, y: Any, v: Any, d: Any, t: Any, p: Any, q: Any, z: Any) -> None:
    start, way, turned = z[0], np.sign(v[0]), y[0]
    for i in range(1, y.size):
        touching = 1.0 if d[i] > 0.0 else 0.0
        if v[i] * way < 0.0:
            share = v[i - 1] / (v[i - 1] - v[i])
            turn = y[i - 1] + 0.5 * v[i - 1] * share * (t[i] - t[i - 1])
            start = call_law(travel, turn - turned, way, d[i], 0.0, start, touching, p, q)
            turned, way = turn, -way
        elif way == 0.0:
            way = np.sign(v[i])
        z[i] = call_law(travel, y[i] - turned, way, d[i], 0.0, start, touching, p, q)


@compiled(nogil=True)
def _follow_time(rate: Any, y: Any, v: Any, d: Any, t: Any, p: Any, q: Any, z: Any) -> None:
    for i in range(1, y.size):
        now, h = z[i - 1], (t[i] - t[i - 1]) / PARTS
        for k in range(PARTS):
            share = (k + 0.5) / PARTS
            at = y[i - 1] + share * (y[i] - y[i - 1])
            speed = v[i - 1] + share * (v[i] - v[i - 1])
            depth = d[i] if np.isinf(d[i]) else d[i - 1] + share * (d[i] - d[i - 1])
            time = t[i - 1] + share * (t[i] - t[i - 1])
            touching = 1.0 if depth > 0.0 else 0.0
            own = call_law(rate, at, speed, depth, time, now, touching, p, q)
            decay = own - call_law(rate, at, speed, depth, time, now + 1.0, touching, p, q)
            now += own * (-np.expm1(-decay * h) / decay if decay > 0.0 else h)
        z[i] = now
