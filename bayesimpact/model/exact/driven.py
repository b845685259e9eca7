"""The oscillator under a measured input: its event loop, one sampling interval after the other.

Between two samples the input is a line (first-order hold), so that in either regime

    y'' + beta y' + K y = p + r s,      s = time since the last sample or event,

with beta = c / m, K = k / m and, in contact, k2 g / m counted into p. The motion is known in closed
form: with the impulse response S, D = S', and the responses B, R from rest to a step and a ramp,

    y(s)  = D y0 + S (v0 + beta y0) + p B + r R
    y'(s) = D v0 - S K y0           + p S + r B

(Duhamel integrals), and y'' follows from the equation itself. G = S * S and H = S * D
(convolutions) and the integrals P of G and Q of P are minus the derivatives of these responses with
respect to K and beta, see `driven_pass`. Time is counted in sampling intervals, as in
`kernel`; failures are codes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.exact.blocks import Sink
from bayesimpact.model.exact.driven_events import LONGEST, expand, next_rise, terms_needed
from bayesimpact.model.exact.flow import impulse_response, second_response
from bayesimpact.model.exact.normalized import (
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
from bayesimpact.model.jit.compiled import compiled, inner

Floats = NDArray[np.float64]

#: Rate times time below which responses are power series.
EARLY = 0.5
TERMS = 14
#: Stretches without an event after which an interval is given up.
MAX_STRETCHES = 40_000
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


class Regime(NamedTuple):
    """What one side of the stop needs in every interval.

    beta, K, S, D, B, R : as in `Responses`, after one interval
    rest : force per mass of the undeformed contact, k2 g / m, or 0
    sign, height : 1 and g in flight; -1 and -g in contact, where -y rises to leave; g may be inf
    longest : stretch that is expanded at once, in intervals
    path (n,) : room for its series
    """

    beta: float
    K: float
    S: float
    D: float
    B: float
    R: float
    rest: float
    sign: float
    height: float
    longest: float
    path: Floats


class Drive(NamedTuple):
    """What a recording adds to the motion it reads: gain of the input, and per mass and interval,
    the offset of the probe, and the input.
    """

    gain: float
    per_mass: float
    offset: float
    wave: Wave


class Point(NamedTuple):
    """Where a motion is: displacement, velocity, in contact or not; and its events so far."""

    y: float
    v: float
    contact: bool
    events: int


@inner()
def regime_of(beta: float, K: float, rest: float, sign: float, gap: float) -> Regime:
    """One regime, in sampling intervals."""
    whole = responses(beta, K, 1.0)
    rate = math.sqrt(K) + beta
    longest = min(1.0, LONGEST / rate)
    path = np.empty(terms_needed(rate * longest))
    return Regime(
        beta, K, whole.S, whole.D, whole.B, whole.R, rest, sign, sign * gap, longest, path
    )


@inner(fastmath={"contract"})
def glide(
    side: Regime, first: int, y: float, v: float, drive: Drive, sink: Sink
) -> tuple[int, float, float, float]:
    """Read the samples from `first` on, up to one after which the motion may reach the stop.

    Returns (i, y, v, sum of squares): the last sample read, and the motion there. Over an interval
    z is at most the larger of its values at the ends and M / 8, M a bound of z'': with
    e^2 = v^2 + K (z - p / K)^2 the rate of e is at most abs(r) s.
    """
    gain, per_mass, offset, wave = drive
    beta, K, S, D, B, R, rest, sign, height, _, _ = side
    C, KS, inverse, root = D + beta * S, K * S, 1.0 / K, math.sqrt(K)
    # what v, z - p / K and r add to the bound
    by_v = 0.125 * (root + beta)
    by_u, by_r = by_v * root, 0.5 * by_v + 0.125
    data, out, speeds, held = sink.data, sink.out, sink.speeds, wave.held
    order, compared, written = sink.order, sink.data.size > 0, sink.out.size > 0
    last, total, i = held.size - 1, 0.0, first
    following = per_mass * held[i]
    while True:
        if compared or written:
            forced = per_mass * wave.shown[i] + rest
            read = reading_driven(order, sink.rate, beta, K, y, v, forced)
            read += offset + gain * wave.carried[i]
            if compared:
                residual = data[i] - read
                total += residual * residual
            else:
                out[i] = read
                if speeds.size > 0:
                    speeds[i] = v
        if i == last:
            break
        now, following = following, per_mass * held[i + 1]
        p, r = now + rest, following - now
        y_next = C * y + (S * v + (p * B + r * R))
        v_next = D * v - (KS * y - (p * S + r * B))
        margin = by_v * abs(v) + by_u * abs(y - p * inverse) + by_r * abs(r)
        if not (sign * y + margin < height and sign * y_next + margin < height):
            break
        y, v = y_next, v_next
        i += 1
    return i, y, v, total


@inner()
def cross(
    start: Point, sides: tuple[Regime, Regime], i: int, p: float, r: float, events: Floats,
    limit: int,
) -> tuple[Point, int]:  # fmt: skip
    """Bring a motion that may reach the stop through interval i; return it and a code.

    p, r : force per mass, and its rise, of the input alone
    events, limit : where events are noted, and after how many of them to give up
    """
    y, v, contact, count = start
    t, steps = 0.0, 0
    while True:
        side = sides[1] if contact else sides[0]
        left = 1.0 - t
        h = min(left, side.longest)
        scale = side.sign * h * h
        now = scale * (p + r * t + side.rest)
        bh, Kh = side.beta * h, side.K * h * h
        end, speed, bound = expand(
            side.path, bh, Kh, side.sign * y, side.sign * v * h, now, scale * h * r
        )
        if not math.isfinite(end + speed):
            return Point(y, v, contact, count), OVERFLOW
        x, rise = next_rise(side.path, side.height, end, speed, bound)
        steps += 1
        if math.isnan(x) or steps > MAX_STRETCHES:
            return Point(y, v, contact, count), SEARCH_FAILED
        if x <= 1.0:
            t, y, v = t + x * h, side.sign * side.height, side.sign * rise / h
            contact, steps = not contact, 0
            if count < events.shape[0]:
                events[count, 0] = i + t
                events[count, 1] = v
            count += 1
            if count > limit:
                return Point(y, v, contact, count), TOO_MANY_EVENTS
        else:
            t, y, v = t + h, side.sign * end, side.sign * speed / h
            if h == left:
                return Point(y, v, contact, count), OK


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
    per_mass = interval * interval / mass
    drive = Drive(q[A], q[A] * per_mass, q[OFFSET], wave)
    free = regime_of(2.0 * motion.b_flight, motion.K_flight, 0.0, 1.0, math.inf)
    sides = (free, free)
    if has_stop(q):
        free = regime_of(2.0 * motion.b_flight, motion.K_flight, 0.0, 1.0, motion.gap)
        rest = per_mass * q[K2] * q[G]
        sides = (
            free, regime_of(2.0 * motion.b_contact, motion.K_contact, rest, -1.0, motion.gap)
        )  # fmt: skip
    at = Point(q[Y0], q[V0] * interval, begins_in_contact(q), 0)
    limit = EVENTS_AT_LEAST + EVENTS_PER_SAMPLE * n
    total, i = 0.0, 0
    while True:
        side = sides[1] if at.contact else sides[0]
        i, y, v, squares = glide(side, i, at.y, at.v, drive, sink)
        total += squares
        at = Point(y, v, at.contact, at.events)
        if i == n - 1:
            break
        p = drive.per_mass * held[i]
        r = drive.per_mass * held[i + 1] - p
        at, code = cross(at, sides, i, p, r, sink.events, limit)
        if code != OK:
            return math.inf, at.events, code
        i += 1
    if not math.isfinite(total + at.y * 0.0):
        return math.inf, at.events, OVERFLOW
    return total, at.events, OK
