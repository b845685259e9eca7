"""Samples inside a step of the oscillator with added effects.

The exact linear flow, plus what the added forces contribute: a quintic that has the right value,
slope and curvature at both ends of the step (Hermite). That contribution is small and smooth, so
the samples are as accurate as the ends. Of a velocity or an acceleration both parts are
differentiated: the flow's derivative is a motion of the same flow.
"""

from __future__ import annotations

from typing import Any

from bayesimpact.model.exact.flow import impulse_response
from bayesimpact.model.general.context import FORCE
from bayesimpact.model.jit.compiled import inner

LONGEST_STRIDE = 64  # samples that one step may span


@inner(forceinline=True)
def reading(y: Any, v: Any, n: Any, flow: Any, w: Any) -> Any:
    """What is written of a state (y, v) with the added force n: y, y' or y''."""
    if w.order == 0:
        return y
    if w.order == 1:
        return v
    return flow.inverse * n - 2.0 * flow.b * v - flow.K * (y - flow.rest)


@inner(forceinline=True)
def input_reading(j: Any, inverse: Any, w: Any) -> Any:
    """What the input adds to the reading of sample j, the motion under its lines apart.

    inverse : 1 / moving mass, 1/kg; 0 where dry friction holds the mass
    """
    if not w.driven:
        return 0.0
    extra = w.carried[j]
    if w.order == 2:
        extra += inverse * (w.shown[j] - w.wave[j])
    return w.q[FORCE] * extra


@inner(forceinline=True)
def fill_in(
    first: Any, end: Any, t: Any, aligned: Any, at: Any, flow: Any, w: Any,
    y: Any, v: Any, n0: Any, h: Any, y1: Any, v1: Any, n1: Any,
) -> Any:  # fmt: skip
    """Samples `first` to `end` - 1 inside a step of length h that began at time t.

    `aligned` says that t is that of sample `first` - 1: the flow at the samples is then tabulated.
    (y, v), (y1, v1) and n0, n1 are the states and the added forces at the two ends; `at` are the
    `Quarters` of the step that was tried, which an event may have shortened to h.
    """
    u, b2, dx = y - flow.rest, 2.0 * flow.b, w.interval / h
    m = v + b2 * u
    table = tabulate(flow, w) if aligned else 0
    x = 0.0 if aligned else (first * w.interval - t) / h - dx
    e, e1, a0, a1 = 0.0, 0.0, 0.0, 0.0
    if not flow.plain:
        S1, D1 = at.S4, at.D4
        if h != at.h:
            S1, D1 = impulse_response(flow.b, flow.K, h)
        e, e1 = y1 - (flow.rest + D1 * u + S1 * m), v1 - (D1 * v - S1 * flow.K * u)
        a0 = h * h * flow.inverse * n0
        a1 = h * h * (flow.inverse * n1 - b2 * e1 - flow.K * e)
        e1 *= h
    p3, p4 = 10.0 * e - 4.0 * e1 - 1.5 * a0 + 0.5 * a1, -15.0 * e + 7.0 * e1 + 1.5 * a0 - a1
    p5 = 6.0 * e - 3.0 * e1 - 0.5 * a0 + 0.5 * a1
    rest, p2, pull = flow.rest, 0.5 * a0, -b2 * v - flow.K * u
    p1 = p0 = 0.0
    if w.order == 1:
        rest, u, m = 0.0, v, -flow.K * u
        p1, p2, p3, p4, p5 = a0 / h, 3.0 * p3 / h, 4.0 * p4 / h, 5.0 * p5 / h, 0.0
    elif w.order == 2:
        rest, u, m, h2 = 0.0, pull, -flow.K * v, h * h
        p0, p1, p2 = a0 / h2, 6.0 * p3 / h2, 12.0 * p4 / h2
        p3, p4, p5 = 20.0 * p5 / h2, 0.0, 0.0
    for i in range(end - first):
        x += dx
        if aligned:
            S, D = w.tables[table + 2 * i], w.tables[table + 2 * i + 1]
        else:
            S, D = impulse_response(flow.b, flow.K, x * h)
        added = x * x * (p2 + x * (p3 + x * (p4 + x * p5)))
        if w.order > 0:
            added += p0 + x * p1
        w.out[first + i] = rest + D * u + S * m + added
        if w.driven:
            w.out[first + i] += input_reading(first + i, flow.inverse, w)


@inner(forceinline=True)
def tabulate(flow: Any, w: Any) -> Any:
    """Where the table of S, D after 1, 2, ... samples begins; computed unless it still holds."""
    side = int(flow.touching)
    table = 2 * LONGEST_STRIDE * side
    if w.keys[2 * side] != flow.b or w.keys[2 * side + 1] != flow.K:
        S1, D1 = impulse_response(flow.b, flow.K, w.interval)
        S, D = S1, D1
        for i in range(LONGEST_STRIDE):
            w.tables[table + 2 * i], w.tables[table + 2 * i + 1] = S, D
            S, D = S * (D1 + 2.0 * flow.b * S1) + D * S1, D * D1 - flow.K * S1 * S
        w.keys[2 * side], w.keys[2 * side + 1] = flow.b, flow.K
    return table
