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

from bayesimpact.model.blocks import squares, squares_forced, write
from bayesimpact.model.compiled import compiled
from bayesimpact.model.events import next_crossing, next_crossing_forced
from bayesimpact.model.flow import advance_forced, forced_response, impulse_response
from bayesimpact.model.quick import fast_lane
from bayesimpact.model.tables import LENGTH, ROWS, SLOW, TERMS, fill, fill_series

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


@compiled()
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


@compiled()
def has_stop(q: Floats) -> bool:
    """Say whether there is anything to hit."""
    gap: float = q[3]
    return gap < math.inf and (q[2] > 0.0 or q[4] > 0.0)


@compiled()
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


@compiled()
def workspace() -> tuple[Floats, Floats, Floats, Floats]:
    """Return empty tables and series of two regimes, the keys of what they hold, and a history."""
    tables, series = np.empty((2, ROWS, LENGTH + 1)), np.empty((2, 2, TERMS))
    return tables, series, np.full((2, 3), np.nan), np.empty((2, 5))


@compiled()
def prepare(
    tables: Floats, series: Floats, keys: Floats, side: int, b: float, K: float, w: float,
    forced: bool,
) -> None:  # fmt: skip
    """Fill tables and series of one regime, unless they hold it already."""
    force = w if forced else _NO_FORCE
    if keys[side, 0] != b or keys[side, 1] != K or keys[side, 2] != force:
        fill(tables[side], b, K, w, forced)
        fill_series(series[side], b, K)
        keys[side, 0], keys[side, 1], keys[side, 2] = b, K, force


@compiled()
def run(
    q: Floats, mass: float, interval: float, n: int, data: Floats, out: Floats, speeds: Floats,
    events: Floats, tables: Floats, series: Floats, keys: Floats, history: Floats,
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
    tables, series, keys, history : from `workspace`; kept from call to call, so that tables of
        equal regimes are used again
    """
    code = check(q, mass, interval, n)
    if code != OK:
        return math.inf, 0, code
    g, offset = q[3], q[10]
    stop = has_stop(q)
    w = q[8] * interval
    per_mass = interval * interval / mass
    force = q[7] * per_mass
    forced = force != 0.0
    contact = begins_in_contact(q)
    limit = EVENTS_AT_LEAST + EVENTS_PER_SAMPLE * n
    compared, written = data.size > 0, out.size > 0

    b_flight, K_flight = 0.5 * q[0] * interval / mass, q[1] * per_mass
    b_contact, K_contact = 0.5 * (q[0] + q[2]) * interval / mass, (q[1] + q[4]) * per_mass
    rest_contact = q[4] * g / (q[1] + q[4]) if stop else 0.0
    prepare(tables, series, keys, 0, b_flight, K_flight, w, forced)
    if stop:
        prepare(tables, series, keys, 1, b_contact, K_contact, w, forced)
    slow = max(2.0 * b_flight + math.sqrt(K_flight), 2.0 * b_contact + math.sqrt(K_contact)) < SLOW
    quick = stop and slow and not forced

    t, y, v = 0.0, q[5], q[6] * interval
    total = 0.0
    count = 0
    i = 0
    while True:
        if quick and count > 0:
            contact, t, v, i, count, passed = fast_lane(
                tables, series, history, b_flight, K_flight, b_contact, K_contact, rest_contact,
                g, offset, n, limit, contact, t, v, i, count, data, out, speeds, events,
            )  # fmt: skip
            total += passed
        if contact:
            side, sign, b, K, rest = 1, -1.0, b_contact, K_contact, rest_contact
        else:
            side, sign, b, K, rest = 0, 1.0, b_flight, K_flight, 0.0
        u = y - rest
        fs = fc = 0.0
        if forced:
            fs, fc = force * math.sin(w * t + q[9]), force * math.cos(w * t + q[9])

        wait, v_next = math.inf, 0.0
        if stop:
            level, left = sign * (g - rest), n - 1 - t
            if forced:
                wait, v_next = next_crossing_forced(
                    b, K, w, sign * u, sign * v, sign * fs, sign * fc, level, left
                )
            else:
                wait, v_next = next_crossing(b, K, sign * u, sign * v, level, left)
            if math.isnan(wait):
                return math.inf, count, SEARCH_FAILED
        end = n if t + wait >= n else math.ceil(t + wait)

        if i < end and (compared or written):
            S, D = impulse_response(b, K, i - t)
            E = F = 0.0
            if forced:
                E, F = forced_response(b, K, w, i - t, S, D)
            while True:
                u, v = advance_forced(b, K, w, u, v, fs, fc, S, D, E, F)
                if forced:
                    fs, fc = force * math.sin(w * i + q[9]), force * math.cos(w * i + q[9])
                block = min(i + LENGTH, end)
                if not compared:
                    write(out, speeds, i, block, rest + offset, tables, side, b, K, w, u, v, fs, fc)
                elif forced:
                    total += squares_forced(
                        data, i, block, rest + offset, tables, side, b, u, v, fs, fc
                    )
                else:
                    total += squares(data, i, block, rest + offset, tables, side, b, u, v)
                i = block
                if i == end:
                    break
                S, D = tables[side, 0, LENGTH], tables[side, 1, LENGTH]
                if forced:
                    E, F = tables[side, 2, LENGTH], tables[side, 3, LENGTH]
        i = end
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
    if compared:
        if not total < math.inf:
            return math.inf, count, OVERFLOW
    else:
        for j in range(out.size):
            if not math.isfinite(out[j]):
                return math.inf, count, OVERFLOW
    return total, count, OK
