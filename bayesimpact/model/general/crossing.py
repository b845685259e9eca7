"""When the next event happens: Newton's method on the integrator's own steps, within a bracket."""

from __future__ import annotations

from typing import Any

import numpy as np

from bayesimpact.model.general.contact_state import (
    GAP,
    HEADING,
    LEAVE,
    NEVER,
    NONE,
    ONCE,
    PUSHED,
    SOON,
    SURFACE,
    TURN,
    event_value,
    one_sided,
    passed,
)
from bayesimpact.model.general.context import AHEAD, NOW
from bayesimpact.model.general.method import quarters
from bayesimpact.model.general.step import step
from bayesimpact.model.jit.compiled import inner, typed

TRIALS = 80
ROUNDS = 8
# last change over the step from which on the state follows by its own derivatives: short of the
# event, if the slope changes by no more than STRAIGHT of itself, and behind it, where a force may
# have had a kink; the first trial aims short
NEAR, STRAIGHT, BEHIND, AIM = 1e-5, 1e-4, 1e-7, 5e-6
PAST = (
    2e-13  # of the step, by which a surface is left behind: two laws may have theirs at one place
)


@inner()
def trial(y: Any, v: Any, t: Any, n0: Any, h: Any, flow: Any, w: Any) -> Any:
    """A step of any length."""
    return step(y, v, t, n0, quarters(h, flow.b, flow.K, flow.inverse), flow, w)


@inner()
def value_and_slope(
    event: Any,
    y: Any,
    v: Any,
    t: Any,
    n: Any,
    column: Any,
    short: Any,
    flow: Any,
    w: Any,
) -> Any:
    """An event's function, its slope along the trajectory by a difference over `short`, and y''.

    n is `added_force` there.
    """
    value = event_value(event, y, v, t, column, w)
    a = flow.inverse * n - 2.0 * flow.b * v - flow.K * (y - flow.rest)
    if event == TURN:
        return value, a * w.s[HEADING], a
    later = event_value(event, y + v * short, v + a * short, t + short, column, w)
    return value, (later - value) / short, a


@inner(forceinline=True)
def cubic(f0: Any, d0: Any, f1: Any, d1: Any) -> Any:
    """Coefficients of the square and the cube, where the values and slopes at 0 and 1 are known."""
    return 3.0 * (f1 - f0) - 2.0 * d0 - d1, 2.0 * (f0 - f1) + d0 + d1


@inner(forceinline=True)
def guess(f0: Any, d0: Any, f1: Any, d1: Any) -> Any:
    """Last root in (0, 1) of the cubic with values f0 >= 0 > f1 and slopes d0, d1 at 0 and 1."""
    c2, c3 = cubic(f0, d0, f1, d1)
    x = f0 / (f0 - f1) if d0 <= 0.0 else 1.0
    for _ in range(6):
        slope = d0 + x * (2.0 * c2 + 3.0 * c3 * x)
        if not slope < 0.0:
            return 0.5
        x -= (f0 + x * (d0 + x * (c2 + x * c3))) / slope
    return x


@inner()
def step_to_event(
    event: Any,
    y: Any,
    v: Any,
    t: Any,
    n0: Any,
    h: Any,
    y1: Any,
    v1: Any,
    n1: Any,
    flow: Any,
    w: Any,
) -> Any:
    """Length of the step from (y, v) to the event inside (0, h], and state and `added_force` there.

    (y1, v1) is the state after h, where the event's function is negative, and n1 the added_force.
    """
    now, column, short = typed(NOW), AHEAD if flow.memory else NOW, 1e-6 * h
    f0, d0, _ = value_and_slope(event, y, v, t, n0, now, short, flow, w)
    f1, d1, _ = value_and_slope(event, y1, v1, t + h, n1, column, short, flow, w)
    past = PAST * h if event >= SURFACE else 0.0
    low, high, x = 0.0, h, h * (guess(max(f0, 0.0), h * d0, f1, h * d1) - AIM)
    for _ in range(TRIALS):
        if not low < x < high:
            x = 0.5 * (low + high)
        y1, v1, n1 = trial(y, v, t, n0, x, flow, w)
        value, slope, a = value_and_slope(event, y1, v1, t + x, n1, column, short, flow, w)
        if value > 0.0:
            low = x
        else:
            high = x
        change = -value / slope if slope < 0.0 else h
        if abs(change) <= 1e-13 * h or high - low <= 1e-15 * h:
            if event < SURFACE or value < 0.0 or x + past > h:
                break
            x += past
            continue
        bend = change * (slope - d0) / (x * slope)  # nearly
        near = -BEHIND * h <= change <= NEAR * h and abs(bend) < STRAIGHT
        if near and low < x + change < high and not flow.memory:
            change = change * (1.0 - 0.5 * bend) + past
            jerk = -2.0 * flow.b * a - flow.K * v1
            y1 += change * (v1 + change * (0.5 * a + change * jerk / 6.0))
            return x + change, y1, v1 + change * (a + 0.5 * change * jerk), n1
        x += change
    return x, y1, v1, n1


@inner(forceinline=True)
def turn_matters(y: Any, v: Any, y1: Any, v1: Any, h: Any, flow: Any, w: Any) -> Any:
    """True when a step contains a turning point at which a force has a kink, or beyond the gap."""
    heading = w.s[HEADING]
    if not v1 * heading < 0.0:
        return False
    if flow.turns:
        return True
    reach = 0.25 * h * abs(v1 - v)
    return min(y, y1) - reach < w.s[GAP] < max(y, y1) + reach


@inner()
def foresee_force(
    y: Any, v: Any, n0: Any, y1: Any, v1: Any, n1: Any, t1: Any, h: Any, flow: Any, w: Any
) -> Any:
    """Whether the reaction, negative at both ends of a step, is positive within: SOON, else NEVER.

    Judged by the cubic through values and slopes at the ends.
    """
    if not (flow.touching == 1.0 and w.s[PUSHED] != ONCE and one_sided(w.q)):
        return
    w.s[PUSHED] = SOON  # LEAVE now stands for the reaction's way through zero
    column, short = AHEAD if flow.memory else NOW, 1e-6 * h
    f0, d0, _ = value_and_slope(LEAVE, y, v, t1 - h, n0, NOW, short, flow, w)
    f1, d1, _ = value_and_slope(LEAVE, y1, v1, t1, n1, column, short, flow, w)
    w.s[PUSHED] = NEVER
    if d0 > 0.0 > d1 and f1 < 0.0:
        d0, d1 = h * d0, h * d1
        c2, c3 = cubic(f0, d0, f1, d1)
        x = d0 / (np.sqrt(c2 * c2 - 3.0 * c3 * d0) - c2)  # the summit
        if f0 + x * (d0 + x * (c2 + x * c3)) > 0.0:
            w.s[PUSHED] = SOON


@inner(forceinline=True)
def suspicious(
    y: Any, v: Any, n0: Any, y1: Any, v1: Any, n1: Any, t1: Any, h: Any, flow: Any, w: Any
) -> Any:
    """True when a step of length h from (y, v) to (y1, v1) at t1 contains an event."""
    foresee_force(y, v, n0, y1, v1, n1, t1, h, flow, w)
    column = AHEAD if flow.memory else NOW
    return (
        turn_matters(y, v, y1, v1, h, flow, w) or passed(y1, v1, t1, column, NONE, flow, w) != NONE
    )


@inner()
def first_event(
    y: Any,
    v: Any,
    t: Any,
    n0: Any,
    h: Any,
    y1: Any,
    v1: Any,
    n1: Any,
    flow: Any,
    w: Any,
) -> Any:
    """Earliest event of a step that ends at (y1, v1) with `added_force` n1, or NONE.

    Returns the event, the time to it, and displacement, velocity and added_force there.
    """
    column = AHEAD if flow.memory else NOW
    event, length = NONE, h
    if turn_matters(y, v, y1, v1, h, flow, w):
        event = typed(TURN)
        length, y1, v1, n1 = step_to_event(event, y, v, t, n0, h, y1, v1, n1, flow, w)
    for _ in range(ROUNDS):
        if length < h and event != LEAVE:
            foresee_force(y, v, n0, y1, v1, n1, t + length, length, flow, w)
        found = passed(y1, v1, t + length, column, event, flow, w)
        if found == NONE:
            break
        event = found
        length, y1, v1, n1 = step_to_event(event, y, v, t, n0, length, y1, v1, n1, flow, w)
    return event, length, y1, v1, n1
