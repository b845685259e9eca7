"""The oscillator under a measured input: its event loop, one sampling interval after the other.

Between two samples the input is a line (first-order hold), so that in either regime

    y'' + beta y' + K y = p + r s,      s = time since the last sample or event,

with beta = c / m, K = k / m and, in contact, k2 g / m counted into p. The motion is known in closed
form: with the impulse response S, D = S', and the responses B, R from rest to a step and a ramp,

    y(s)  = D y0 + S (v0 + beta y0) + p B + r R
    y'(s) = D v0 - S K y0           + p S + r B

(Duhamel integrals), and y'' follows from the equation itself. G = S * S and H = S * D
(convolutions) and the integrals P of G and Q of P are minus the derivatives of these responses with
respect to K and beta, see `driven_sensitivity_pass`. Time is counted in sampling intervals, as in
`kernel`; failures are codes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.blocks import Sink
from bayesimpact.model.compiled import compiled, inner
from bayesimpact.model.flow import impulse_response, second_response
from bayesimpact.model.normalized import (
    K2,
    OFFSET,
    OK,
    OVERFLOW,
    SEARCH_FAILED,
    TOO_MANY_EVENTS,
    V0,
    Y0,
    A,
    G,
    begins_in_contact,
    check,
    has_stop,
    scale,
)  # fmt: skip

Floats = NDArray[np.float64]

#: Rate times time below which responses are power series.
EARLY = 0.5
TERMS = 14
MAX_STEPS = 20_000
#: Events after which a recording of n samples is given up: EVENTS_AT_LEAST + EVENTS_PER_SAMPLE n.
EVENTS_AT_LEAST = 1000
EVENTS_PER_SAMPLE = 50


class Responses(NamedTuple):
    """Responses of one regime after a time, see the module's docstring."""

    beta: float
    K: float
    S: float
    D: float
    B: float
    R: float
    G: float
    H: float
    P: float
    Q: float


class Wave(NamedTuple):
    """The input of one recording for a gain of 1, one value per sample.

    held (n,) : forces between which the force on the mass is a line, N
    shown (n,) : the force at the samples, which an acceleration holds, N: other than `held` where
        lines between the samples are no more than a way to the motion
    carried (n,) : what the input adds to a reading, m/s^order: the base's own motion where a probe
        reads the absolute one
    """

    held: Floats
    shown: Floats
    carried: Floats


@inner()
def wave_of(waves: Floats, first: int, n: int) -> Wave:
    """The n samples from `first` on of `waves` (3, M)."""
    end = first + n
    return Wave(waves[0, first:end], waves[1, first:end], waves[2, first:end])


@compiled()
def responses(beta: float, K: float, t: float) -> Responses:
    """Responses after a time t >= 0; early ones as power series, where differences would cancel."""
    if (math.sqrt(K) + beta) * t < EARLY:
        bt, Kt = beta * t, K * t * t
        S = G = B = R = P = Q = D = H = 0.0
        s0, s1, g0, g1 = 0.0, 1.0, 0.0, 0.0  # terms n and n + 1 of S / t and of G / t^3
        for n in range(TERMS):
            # s1 stands for t^(n+1) of S, g1 for t^(n+3) of G
            S, D = S + s1, D + (n + 1.0) * s1
            B, R = B + s1 / (n + 2.0), R + s1 / ((n + 2.0) * (n + 3.0))
            both = 1.0 / ((n + 2.0) * (n + 3.0))
            g2 = (s1 - bt * (n + 2.0) * g1 - Kt * g0) * both
            s2 = -(bt * (n + 1.0) * s1 + Kt * s0) / ((n + 1.0) * (n + 2.0))
            G, H = G + g2, H + (n + 3.0) * g2
            P, Q = P + g2 / (n + 4.0), Q + g2 / ((n + 4.0) * (n + 5.0))
            s0, s1, g0, g1 = s1, s2, g1, g2
        t2 = t * t
        t3 = t2 * t
        return Responses(
            beta, K, t * S, D, t2 * B, t3 * R, t3 * G, t2 * H, t2 * t2 * P, t2 * t3 * Q
        )
    S, D = impulse_response(0.5 * beta, K, t)
    G, H = second_response(0.5 * beta, K, t, S, D)
    B = (1.0 - D - beta * S) / K
    R = (t - S - beta * B) / K
    P = (B - H - beta * G) / K
    Q = (R - G - beta * P) / K
    return Responses(beta, K, S, D, B, R, G, H, P, Q)


@compiled(forceinline=True, fastmath={"contract"})
def advance_driven(after: Responses, y: float, v: float, p: float, r: float) -> tuple[float, float]:
    """Return (y, y') after the motion from (y, v) under the force per mass p + r s."""
    return (
        after.D * y + after.S * (v + after.beta * y) + (p * after.B + r * after.R),
        after.D * v - after.S * (after.K * y) + (p * after.S + r * after.B),
    )


@inner(forceinline=True, fastmath={"contract"})
def reading_driven(
    order: int, rate: float, beta: float, K: float, y: float, v: float, p: float
) -> float:
    """Return y, y' or y'' of a state under the force per mass p; `rate` intervals per second."""
    if order == 0:
        return y
    if order == 1:
        return rate * v
    return rate * rate * (p - beta * v - K * y)


@inner(forceinline=True)
def may_rise(
    beta: float, K: float, z: float, v: float, p: float, r: float, level: float, horizon: float
) -> bool:
    """Say whether z can reach the level within the horizon at all, by a bound of z''.

    With e^2 = v^2 + K (z - p / K)^2 the rate of e is at most abs(r) s.
    """
    rate = math.sqrt(K) + beta
    u = z - p / K
    bound = rate * (math.sqrt(v * v + K * u * u) + 0.5 * abs(r) * horizon * horizon)
    bound += abs(r) * horizon
    return z + horizon * (max(v, 0.0) + 0.5 * bound * horizon) >= level


@compiled()
def next_rise(
    beta: float, K: float, z: float, v: float, p: float, r: float, level: float, horizon: float
) -> tuple[float, float]:
    """Return (t, z'(t)) at the first rise through `level` within the horizon; inf if there is none,
    nan on failure.

    Steps that provably cannot jump over a crossing: while v s + M s^2 / 2 is less than the distance
    to the level, M a bound of z'' (see `may_rise`), nothing crosses; close to a crossing the
    largest such step is Newton's, from below.
    """
    rate = math.sqrt(K) + beta
    shortest = min(1e-9 / rate, 1e-9 * horizon)
    t, position, speed = 0.0, z, v
    for _ in range(MAX_STEPS):
        distance = level - position
        if distance <= 0.0 and speed > 0.0 and t > 0.0:
            return t, speed
        left = horizon - t
        if not left > 0.0:
            return math.inf, 0.0
        distance = max(distance, 0.0)
        longest = min(1.0 / rate, left)
        u = position - (p + r * t) / K
        energy = math.sqrt(speed * speed + K * u * u)
        bound = rate * (energy + 0.5 * abs(r) * longest * longest) + abs(r) * longest
        if bound == 0.0:
            return math.inf, 0.0
        root = math.sqrt(speed * speed + 2.0 * bound * distance)
        step = 2.0 * distance / (root + speed) if speed > 0.0 else (root - speed) / bound
        sure = speed > 0.0 and step < longest and bound * step <= 0.1 * speed
        step = min(max(step, shortest), longest)
        t = horizon if step == left else t + step
        position, speed = advance_driven(responses(beta, K, t), z, v, p, r)
        if sure:  # the speed hardly changes any more: plain Newton
            for _ in range(6):
                step = (level - position) / speed
                t += step
                position, speed = advance_driven(responses(beta, K, t), z, v, p, r)
                if abs(step) <= 4e-16 * t:
                    break
            return (t, speed) if t <= horizon else (math.inf, 0.0)
    return math.nan, 0.0


@inner()
def run_driven(
    q: Floats, mass: float, interval: float, wave: Wave, sink: Sink
) -> tuple[float, int, int]:
    """Simulate one recording under q[A] times `wave`; return (sum of squares, events, code).

    Parameters
    ----------
    q : (11,) parameters, SI units (see `normalized`); A is the gain of the input
    mass, interval : kg, s
    wave : the input
    sink : what to compare with, or to fill
    """
    n, held = wave.held.size, wave.held
    code = check(q, mass, interval, n)
    if code != OK:
        return math.inf, 0, code
    motion = scale(q, mass, interval)
    stop, contact = has_stop(q), begins_in_contact(q)
    per_mass = interval * interval / mass
    gain = q[A] * per_mass
    hold = per_mass * q[K2] * q[G] if stop else 0.0
    free = responses(2.0 * motion.b_flight, motion.K_flight, 1.0)
    touching = free
    if stop:
        touching = responses(2.0 * motion.b_contact, motion.K_contact, 1.0)
    data, out, speeds, events = sink.data, sink.out, sink.speeds, sink.events
    limit = EVENTS_AT_LEAST + EVENTS_PER_SAMPLE * n
    y, v = q[Y0], q[V0] * interval
    total, count = 0.0, 0
    offset, order, rate = q[OFFSET], sink.order, sink.rate
    compared, written = data.size > 0, out.size > 0
    for i in range(n):
        if compared or written:
            beta, K, level = free.beta, free.K, 0.0
            if contact:
                beta, K, level = touching.beta, touching.K, hold
            pushed = gain * wave.shown[i] + level
            read = reading_driven(order, rate, beta, K, y, v, pushed)
            read += offset + q[A] * wave.carried[i]
            if compared:
                residual = data[i] - read
                total += residual * residual
            else:
                out[i] = read
                if speeds.size > 0:
                    speeds[i] = v
        if i == n - 1:
            break
        p = gain * held[i]
        r = gain * held[i + 1] - p
        if not stop:
            y, v = advance_driven(free, y, v, p, r)
            continue
        t = 0.0
        while True:
            flow, level, sign = (touching, hold, -1.0) if contact else (free, 0.0, 1.0)
            now, left = p + r * t + level, 1.0 - t
            z, zv, height = sign * y, sign * v, sign * motion.gap
            wait, speed = math.inf, 0.0
            if may_rise(flow.beta, flow.K, z, zv, sign * now, sign * r, height, left):
                wait, speed = next_rise(
                    flow.beta, flow.K, z, zv, sign * now, sign * r, height, left
                )
                if math.isnan(wait):
                    return math.inf, count, SEARCH_FAILED
            if not wait <= left:
                after = flow if t == 0.0 else responses(flow.beta, flow.K, left)
                y, v = advance_driven(after, y, v, now, r)
                break
            t, y, v = t + wait, motion.gap, sign * speed
            contact = not contact
            if count < events.shape[0]:
                events[count, 0] = i + t
                events[count, 1] = v
            count += 1
            if count > limit:
                return math.inf, count, TOO_MANY_EVENTS
    if not math.isfinite(total + y * 0.0):
        return math.inf, count, OVERFLOW
    return total, count, OK
