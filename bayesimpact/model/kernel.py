"""The event loop of the base oscillator for one recording, compiled.

q = (c1, k1, c2, g, k2, y0, v0, A, w, phase, offset) in SI units, t = 0 at the first sample. The
regime is a state of the loop, never inferred from the sign of y - g, and y is set to g at every
event. Inside, time is counted in sampling intervals: velocities, rates and frequencies are per
interval. Failures are codes; nothing here raises, and nothing it returns is NaN.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.compiled import compiled
from bayesimpact.model.events import next_crossing, next_crossing_forced
from bayesimpact.model.flow import advance, advance_forced, forced_response, impulse_response
from bayesimpact.model.tables import LENGTH, ROWS, fill

Floats = NDArray[np.float64]

#: The unknowns of one recording, in this order everywhere.
Q = ("c1", "k1", "c2", "g", "k2", "y0", "v0", "A", "w", "phase", "offset")

OK = 0
NOT_FINITE = 1
BAD_MASS = 2
BAD_STIFFNESS = 3
BAD_DAMPING = 4
BAD_CONTACT = 5
BAD_GAP = 6
BAD_FREQUENCY = 7
BAD_SAMPLING = 8
TOO_MANY_EVENTS = 9
SEARCH_FAILED = 10
OVERFLOW = 11

#: Events after which a recording of n samples is given up: EVENTS_AT_LEAST + EVENTS_PER_SAMPLE n.
EVENTS_AT_LEAST = 1000
EVENTS_PER_SAMPLE = 50

_NO_FORCE = -1.0


@compiled(error_model="numpy")
def check(q: Floats, mass: float, interval: float, n: int) -> int:
    """Return OK or the code of the first thing wrong with the arguments of `run`."""
    for i in range(11):
        if i != 3 and not math.isfinite(q[i]):
            return NOT_FINITE
    if not (math.isfinite(mass) and mass > 0.0):
        return BAD_MASS
    if not q[1] > 0.0:
        return BAD_STIFFNESS
    if q[0] < 0.0:
        return BAD_DAMPING
    if q[2] < 0.0 or q[4] < 0.0:
        return BAD_CONTACT
    if math.isnan(q[3]) or q[3] == -math.inf:
        return BAD_GAP
    if q[8] < 0.0:
        return BAD_FREQUENCY
    if not (math.isfinite(interval) and interval > 0.0 and n > 0):
        return BAD_SAMPLING
    return OK


@compiled(error_model="numpy")
def has_stop(q: Floats) -> bool:
    """Say whether there is anything to hit."""
    gap: float = q[3]
    return gap < math.inf and (q[2] > 0.0 or q[4] > 0.0)


@compiled(error_model="numpy")
def begins_in_contact(q: Floats) -> bool:
    """Say whether motion begins in contact: beyond the stop, or at it and heading into it."""
    if not has_stop(q):
        return False
    above: float = q[5] - q[3]
    if above == 0.0:
        above = q[6]
    if above == 0.0:
        above = q[7] * math.sin(q[9]) - q[1] * q[3]
    return above > 0.0


@compiled(error_model="numpy")
def write(
    out: Floats, speeds: Floats, first: int, end: int, shift: float, table: Floats,
    b: float, K: float, w: float, u: float, v: float, fs: float, fc: float,
) -> None:  # fmt: skip
    """Write positions (and velocities, if `speeds` has room) of one block, samples first..end-1."""
    S, D, E, F = table[0], table[1], table[2], table[3]
    m = v + 2.0 * b * u
    if fs == 0.0 and fc == 0.0:
        for j in range(end - first):
            out[first + j] = shift + D[j] * u + S[j] * m
    else:
        for j in range(end - first):
            out[first + j] = shift + D[j] * u + S[j] * m + fs * E[j] + fc * F[j]
    if speeds.size:
        for j in range(end - first):
            speeds[first + j] = D[j] * v - S[j] * K * u
        if fs != 0.0 or fc != 0.0:
            for j in range(end - first):
                speeds[first + j] += fs * (S[j] - w * F[j]) + fc * w * E[j]


@compiled(error_model="numpy", fastmath={"reassoc", "contract"})
def squares(
    data: Floats, first: int, end: int, shift: float, table: Floats,
    b: float, u: float, v: float, fs: float, fc: float,
) -> float:  # fmt: skip
    """Return the sum of squared residuals of one block, samples first..end-1."""
    S, D, E, F = table[0], table[1], table[2], table[3]
    m = v + 2.0 * b * u
    total = 0.0
    segment = data[first:end]
    if fs == 0.0 and fc == 0.0:
        for j in range(segment.size):
            r = segment[j] - shift - (D[j] * u + S[j] * m)
            total += r * r
    else:
        for j in range(segment.size):
            r = segment[j] - shift - (D[j] * u + S[j] * m + fs * E[j] + fc * F[j])
            total += r * r
    return total


@compiled(error_model="numpy")
def workspace() -> tuple[Floats, Floats]:
    """Return empty tables of two regimes and the keys of what they hold."""
    return np.empty((2, ROWS, LENGTH + 1)), np.full((2, 3), np.nan)


@compiled(error_model="numpy")
def run(
    q: Floats, mass: float, interval: float, n: int, data: Floats, out: Floats, speeds: Floats,
    events: Floats, tables: Floats, keys: Floats,
) -> tuple[float, int, int]:  # fmt: skip
    """Simulate one recording; return (sum of squares, events, code).

    Parameters
    ----------
    q : (11,) parameters, SI units
    mass, interval, n : kg, s, samples
    data : (n,) measured, m, to be compared with; or empty
    out : (n,) receives y + offset, m, when `data` is empty; both empty: events only
    speeds : (n,) receives y', m/s; or empty
    events : (capacity, 2) receives time and velocity of the first events, in intervals; or empty
    tables, keys : from `workspace`; tables of equal regimes are reused from call to call
    """
    code = check(q, mass, interval, n)
    if code != OK:
        return math.inf, 0, code
    square = interval * interval
    g, offset = q[3], q[10]
    stop = has_stop(q)
    w = q[8] * interval
    force = q[7] * square / mass
    forced = force != 0.0
    contact = begins_in_contact(q)
    limit = EVENTS_AT_LEAST + EVENTS_PER_SAMPLE * n

    t, y, v = 0.0, q[5], q[6] * interval
    nothing_wanted = data.size == 0 and out.size == 0
    total = 0.0
    count = 0
    i = 0
    while True:
        if contact:
            stiffness = q[1] + q[4]
            b = 0.5 * (q[0] + q[2]) * interval / mass
            rest = q[4] * g / stiffness
            sign, side = -1.0, 1
        else:
            stiffness = q[1]
            b = 0.5 * q[0] * interval / mass
            rest = 0.0
            sign, side = 1.0, 0
        K = stiffness * square / mass
        u = y - rest
        fs = fc = 0.0
        if forced:
            fs = force * math.sin(w * t + q[9])
            fc = force * math.cos(w * t + q[9])
        wait, v_next = math.inf, 0.0
        if stop:
            left = n - 1 - t
            level = sign * (g - rest)
            if forced:
                wait, v_next = next_crossing_forced(
                    b, K, w, sign * u, sign * v, sign * fs, sign * fc, level, left
                )
            else:
                wait, v_next = next_crossing(b, K, sign * u, sign * v, level, left)
            if math.isnan(wait):
                return math.inf, count, SEARCH_FAILED
        end = n if t + wait >= n else math.ceil(t + wait)

        if i < end and nothing_wanted:
            i = end
        elif i < end:
            key = w if forced else _NO_FORCE
            kept = keys[side]
            table = tables[side]
            if kept[0] != b or kept[1] != K or kept[2] != key:
                fill(table, b, K, w, forced)
                kept[0], kept[1], kept[2] = b, K, key
            S, D = impulse_response(b, K, i - t)
            if forced:
                E, F = forced_response(b, K, w, i - t, S, D)
                u, v = advance_forced(b, K, w, u, v, fs, fc, S, D, E, F)
            else:
                u, v = advance(b, K, u, v, S, D)
            while i < end:
                stop_at = min(i + LENGTH, end)
                if forced:
                    fs = force * math.sin(w * i + q[9])
                    fc = force * math.cos(w * i + q[9])
                if data.size:
                    total += squares(data, i, stop_at, rest + offset, table, b, u, v, fs, fc)
                else:
                    write(out, speeds, i, stop_at, rest + offset, table, b, K, w, u, v, fs, fc)
                S, D = table[0, LENGTH], table[1, LENGTH]
                if forced:
                    E, F = table[2, LENGTH], table[3, LENGTH]
                    u, v = advance_forced(b, K, w, u, v, fs, fc, S, D, E, F)
                else:
                    u, v = advance(b, K, u, v, S, D)
                i = stop_at
        if i >= n:
            break
        t += wait
        y = g
        v = sign * v_next
        contact = not contact
        if count < events.shape[0]:
            events[count, 0] = t
            events[count, 1] = v
        count += 1
        if count > limit:
            return math.inf, count, TOO_MANY_EVENTS
    if speeds.size:
        for j in range(n):
            speeds[j] /= interval
    if data.size:
        if not total < math.inf:
            return math.inf, count, OVERFLOW
    else:
        for j in range(out.size):
            if not math.isfinite(out[j]):
                return math.inf, count, OVERFLOW
    return total, count, OK
