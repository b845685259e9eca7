"""A second mode of the oscillator, which the contact force excites and the probe sees as well.

    q'' + 2 beta q' + W q = gain F,      F = force between mass and obstacle, reading y + q

The motion itself is not affected. Between two events F is the linear flow's force, for which the
response of the mode is exact at any frequencies, equal ones included, plus what added forces
contribute to F: a cubic with the right values and slopes at both ends of a step (Hermite). Nothing
is sampled, so a mode above half the sampling rate reads as the probe would read it.
"""

from __future__ import annotations

import math
from typing import Any

from bayesimpact.model.exact.flow import impulse_response
from bayesimpact.model.general.contact_state import (
    GAP,
    HOP,
    MODE,
    SECOND_P,
    SECOND_Q,
    TOUCHING,
    laws_force,
    reaction,
)
from bayesimpact.model.general.context import (
    AHEAD,
    C1,
    C2,
    CONTACT_MASS,
    K1,
    K2,
    NOW,
    SECOND_DAMPING,
    SECOND_FREQUENCY,
    SECOND_GAIN,
    STAGE,
    WORK_COLUMNS,
    law_value,
)
from bayesimpact.model.general.resonator import (
    OBSTACLE,
    body,
    body_force,
    share_of_frame,
    shift_bodies,
)
from bayesimpact.model.jit.compiled import compiled, inner
from bayesimpact.model.law_table import LAW_COLUMNS, LAW_RATE

TERMS = 14  # of a power series over a time of at most half a radian: the rest is below 1e-18
SHORT = 1e-6  # of a step, for the slope of the contact force along the motion
# rows of what is kept for hops of one sampling interval: key, then see `joint_response`
KEY_B, KEY_K, HOP_S, HOP_D, HOP_M, HOP_N, HOP_X, HOP_XR = range(8)


@compiled()
def joint_response(
    b: float, K: float, beta: float, W: float, t: float
) -> tuple[float, float, float, float, float, float]:
    """Impulse responses S of the motion and M of the mode, X = S * M (convolution), and the rates.

    Returns S, S', M, M', X, X' at time t. Power series at t / 2^k, then k doublings by the addition
    theorem: nothing is divided by a difference of frequencies.
    """
    rate = math.sqrt(K) + 2.0 * b + math.sqrt(W) + 2.0 * beta
    halvings, h = 0, t
    while rate * h > 0.5:
        h *= 0.5
        halvings += 1
    if not h > 0.0:
        return 0.0, 1.0, 0.0, 1.0, 0.0, 0.0
    bh, Kh, betah, Wh, hh = 2.0 * b * h, K * h * h, 2.0 * beta * h, W * h * h, h * h
    S = M = h
    D = N = 1.0
    X = XR = s0 = m0 = x0 = x1 = 0.0  # s0, s1 are terms n and n + 1 of S
    s1 = m1 = h
    for n in range(TERMS):
        both, step, power = 1.0 / ((n + 1.0) * (n + 2.0)), n + 1.0, (n + 2.0) / h
        s2 = -(bh * step * s1 + Kh * s0) * both
        m2 = -(betah * step * m1 + Wh * m0) * both
        x2 = (hh * s0 - betah * step * x1 - Wh * x0) * both
        S, D, M, N = S + s2, D + power * s2, M + m2, N + power * m2
        X, XR = X + x2, XR + power * x2
        s0, s1, m0, m1, x0, x1 = s1, s2, m1, m2, x1, x2
    for _ in range(halvings):
        first, curved = D + 2.0 * b * S, S - 2.0 * beta * XR - W * X
        X, XR = (
            X * (N + 2.0 * beta * M + first) + XR * (M + S),
            XR * (N + first) - W * X * M + curved * S,
        )
        S, D = 2.0 * S * (D + b * S), D * D - K * S * S
        M, N = 2.0 * M * (N + beta * M), N * N - W * M * M
    return S, D, M, N, X, XR


@compiled()
def polynomial_response(
    q: float, p: float, beta: float, W: float, a0: float, a1: float, a2: float, a3: float, t: float
) -> tuple[float, float]:
    """(q, q') after a time t under q'' + 2 beta q' + W q = a0 + a1 s + a2 s^2 + a3 s^3, W > 0.

    s counts from the start. Over less than half a radian by power series; over more as a cubic
    that solves the equation and a free motion, which then do not cancel.
    """
    if not t > 0.0:
        return q, p
    if (math.sqrt(W) + 2.0 * beta) * t > 0.5:
        b3 = a3 / W
        b2 = (a2 - 6.0 * beta * b3) / W
        b1 = (a1 - 4.0 * beta * b2 - 6.0 * b3) / W
        b0 = (a0 - 2.0 * beta * b1 - 2.0 * b2) / W
        M, N = impulse_response(beta, W, t)
        q, p = q - b0, p - b1
        return (
            b0 + t * (b1 + t * (b2 + t * b3)) + N * q + M * (p + 2.0 * beta * q),
            b1 + t * (2.0 * b2 + 3.0 * t * b3) + N * p - W * M * q,
        )
    betat, Wt = 2.0 * beta * t, W * t * t
    f0, f1, f2, f3 = a0, a1 * t, a2 * t * t, a3 * t * t * t
    total, rate, c0, c1 = q + p * t, p, q, p * t
    for n in range(TERMS):
        c2 = (t * t * f0 - betat * (n + 1.0) * c1 - Wt * c0) / ((n + 1.0) * (n + 2.0))
        f0, f1, f2, f3 = f1, f2, f3, 0.0
        total, rate = total + c2, rate + (n + 2.0) * c2 / t
        c0, c1 = c1, c2
    return total, rate


@inner(forceinline=True)
def listens(w: Any) -> Any:
    """True when there is a second mode."""
    return w.q[SECOND_GAIN] != 0.0


@inner(forceinline=True)
def constants(w: Any) -> Any:
    """Half the damping rate, 1/s, and the squared angular frequency, 1/s2, of the mode."""
    omega = 6.283185307179586 * w.q[SECOND_FREQUENCY]
    return w.q[SECOND_DAMPING] * omega, omega * omega


@inner()
def prepare_hops(b: Any, K: Any, beta: Any, W: Any, w: Any) -> Any:
    """Keep the responses after one sampling interval, unless they still hold."""
    s = w.s
    if s[HOP + KEY_K] != K or s[HOP + KEY_B] != b:
        s[HOP + KEY_B], s[HOP + KEY_K] = b, K
        kept = joint_response(b, K, beta, W, w.interval)
        s[HOP + HOP_S], s[HOP + HOP_D], s[HOP + HOP_M], s[HOP + HOP_N] = kept[:4]
        s[HOP + HOP_X], s[HOP + HOP_XR] = kept[4:]


@inner()
def respond(
    y: Any, v: Any, t: Any, n0: Any, y1: Any, v1: Any, n1: Any, h: Any, first: Any, end: Any,
    flow: Any, w: Any,
) -> Any:  # fmt: skip
    """Carry the mode through a step of length h, and add it to samples `first` to `end` - 1.

    Arguments as of `dense.fill_in`: states and added forces at both ends of the step from time t.
    """
    s, touching = w.s, flow.touching == 1.0
    beta, W = constants(w)
    if touching or s[HOP + KEY_K] == 0.0:
        prepare_hops(flow.b, flow.K, beta, W, w)
    aligned = t == (first - 1) * w.interval
    q, p, u, done, gain = s[SECOND_Q], s[SECOND_P], y - flow.rest, 0.0, w.q[SECOND_GAIN]
    c, k, level = linear_force(y, v, u, t, w) if touching else (0.0, 0.0, 0.0)
    more = touching and not flow.plain
    a1 = a2 = a3 = extra = extra_rate = 0.0
    if more:
        a1, a2, a3 = remainder(y, v, t, n0, y1, v1, n1, h, c, k, level, flow, w)
    for i in range(first, end + 1):
        to = min(i * w.interval - t, h) if i < end else h
        dt = to - done
        if i < end and (i > first or aligned):
            S, D, M, N = s[HOP + HOP_S], s[HOP + HOP_D], s[HOP + HOP_M], s[HOP + HOP_N]
            X, XR = s[HOP + HOP_X], s[HOP + HOP_XR]
        elif not dt > 0.0:
            S, D, M, N, X, XR = 0.0, 1.0, 0.0, 1.0, 0.0, 0.0
        elif touching:
            S, D, M, N, X, XR = joint_response(flow.b, flow.K, beta, W, dt)
        else:
            M, N = impulse_response(beta, W, dt)
            S, D, X, XR = 0.0, 1.0, 0.0, 0.0
        q, p = N * q + M * (p + 2.0 * beta * q), N * p - W * M * q
        if touching:
            m = v + 2.0 * flow.b * u
            X2 = S - 2.0 * beta * XR - W * X
            X3 = D - 2.0 * beta * X2 - W * XR
            steady = (1.0 - N - 2.0 * beta * M) / W
            by_u, by_u_rate = XR * u + X * m, X2 * u + XR * m
            by_v, by_v_rate = by_u_rate - M * u, X3 * u + X2 * m - N * u
            q += gain * (c * by_v + k * by_u + level * steady)
            p += gain * (c * by_v_rate + k * by_u_rate + level * M)
            u, v = D * u + S * m, D * v - S * flow.K * u
        if more and dt > 0.0:
            extra, extra_rate = polynomial_response(
                extra, extra_rate, beta, W,
                done * (a1 + done * (a2 + done * a3)), a1 + done * (2.0 * a2 + 3.0 * done * a3),
                a2 + 3.0 * done * a3, a3, dt,
            )  # fmt: skip
        if i < end:
            q1, p1 = q + gain * extra, p + gain * extra_rate
            force = c * v + k * u + level + to * (a1 + to * (a2 + to * a3)) if touching else 0.0
            w.out[i] += mode_reading(q1, p1, force, beta, W, w)
        done = to
    s[SECOND_Q], s[SECOND_P] = q + gain * extra, p + gain * extra_rate


@inner(forceinline=True)
def mode_reading(q: Any, p: Any, force: Any, beta: Any, W: Any, w: Any) -> Any:
    """What the mode adds to a reading: q, q' = p or q'' under the contact force."""
    if w.order == 0:
        return q
    if w.order == 1:
        return p
    return w.q[SECOND_GAIN] * force - 2.0 * beta * p - W * q


@inner(forceinline=True)
def added_reading(y: Any, v: Any, t: Any, w: Any) -> Any:
    """The same at a state (y, v) of the mass whose laws stand in NOW; 0 without a second mode."""
    if not listens(w):
        return 0.0
    beta, W = constants(w)
    force = reaction(y, v, t, NOW, w) if w.order == 2 and w.s[MODE] == TOUCHING else 0.0
    return mode_reading(w.s[SECOND_Q], w.s[SECOND_P], force, beta, W, w)


@inner(forceinline=True)
def linear_force(y: Any, v: Any, u: Any, t: Any, w: Any) -> Any:
    """The contact force as c y' + k (y - rest) + level, where u = y - rest: (c, k, level).

    `level` is such that the force at (y, v) itself is right, whatever acts.
    """
    q = w.q
    mass = w.mass * (1.0 - share_of_frame(w))
    share = q[CONTACT_MASS] / (mass + q[CONTACT_MASS])
    m2, W, drag = body(OBSTACLE, w)
    c = (1.0 - share) * (q[C2] + m2 * drag) - share * q[C1]
    k = (1.0 - share) * (q[K2] + m2 * W) - share * q[K1]
    return c, k, reaction(y, v, t, NOW, w) - c * v - k * u


@inner()
def remainder(
    y: Any, v: Any, t: Any, n0: Any, y1: Any, v1: Any, n1: Any, h: Any,
    c: Any, k: Any, level: Any, flow: Any, w: Any,
) -> Any:  # fmt: skip
    """Coefficients of s, s^2, s^3: the contact force over a step beyond that of the linear flow."""
    u, short, column = y - flow.rest, SHORT * h, AHEAD if flow.memory else NOW
    S, D = impulse_response(flow.b, flow.K, h)
    m = v + 2.0 * flow.b * u
    u1, speed1 = D * u + S * m, D * v - S * flow.K * u
    pull, pull1 = -2.0 * flow.b * v - flow.K * u, -2.0 * flow.b * speed1 - flow.K * u1
    here = reaction(y, v, t, NOW, w)
    there = reaction(y1, v1, t + h, column, w)
    slope = force_slope(y, v, t, pull + flow.inverse * n0, NOW, here, short, flow, w)
    a = -2.0 * flow.b * v1 - flow.K * (y1 - flow.rest) + flow.inverse * n1
    slope1 = force_slope(y1, v1, t + h, a, column, there, -short, flow, w)
    r1 = there - (c * speed1 + k * u1 + level)
    d0 = h * (slope - c * pull - k * v)
    d1 = h * (slope1 - c * pull1 - k * speed1)
    return d0 / h, (3.0 * r1 - 2.0 * d0 - d1) / (h * h), (d0 + d1 - 2.0 * r1) / (h * h * h)


@inner()
def force_slope(
    y: Any, v: Any, t: Any, a: Any, column: Any, here: Any, short: Any, flow: Any, w: Any
) -> Any:
    """Slope of the contact force along the motion, by a difference over `short`."""
    at = column
    if flow.memory:
        at = STAGE
        for law in range(w.size):
            if w.laws[LAW_COLUMNS * law + LAW_RATE] != 0:
                row = WORK_COLUMNS * law
                z = w.work[row + column]
                rate = law_value(law, LAW_RATE, y, v, t, z, flow.gap, flow.touching, w)
                w.work[row + STAGE] = z + short * rate
        if flow.bodies:
            shift_bodies(y, v, column, short, flow, w)
    return (reaction(y + short * v, v + short * a, t + short, at, w) - here) / short


@inner()
def respond_at_rest(y: Any, t: Any, dt: Any, column: Any, w: Any) -> Any:
    """Carry the mode through a time dt in which dry friction holds the mass at y."""
    beta, W = constants(w)
    s, force, later = w.s, 0.0, 0.0
    if s[MODE] == TOUCHING:
        spring = w.q[K2] * (y - s[GAP])
        force = spring + laws_force(y, 0.0, t, NOW, True, w)
        force += body_force(OBSTACLE, y, 0.0, s[GAP], NOW, w)
        later = spring + laws_force(y, 0.0, t + dt, column, True, w)
        later += body_force(OBSTACLE, y, 0.0, s[GAP], column, w)
    gain = w.q[SECOND_GAIN]
    growth = (later - force) / dt if dt > 0.0 else 0.0
    s[SECOND_Q], s[SECOND_P] = polynomial_response(
        s[SECOND_Q], s[SECOND_P], beta, W, gain * force, gain * growth, 0.0, 0.0, dt
    )
