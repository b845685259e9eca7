"""The event loop of the base oscillator for one recording, compiled.

The regime is a state of the loop, never inferred from the sign of y - g, and y is set to g at every
event. Inside, time is counted in sampling intervals: velocities, rates and frequencies are per
interval. Failures are codes; nothing here raises, and nothing it returns is NaN.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.exact.blocks import Sink, pass_samples
from bayesimpact.model.exact.events import next_event
from bayesimpact.model.exact.normalized import (
    OK,
    OVERFLOW,
    SEARCH_FAILED,
    TOO_MANY_EVENTS,
    V0,
    Y0,
    begins_in_contact,
    check,
    has_stop,
    scale,
)  # fmt: skip
from bayesimpact.model.exact.return_time_prediction import return_time_prediction
from bayesimpact.model.exact.tables import SLOW, ResponseTables, prepare
from bayesimpact.model.jit.compiled import inner, typed

Floats = NDArray[np.float64]

#: Events after which a recording of n samples is given up: EVENTS_AT_LEAST + EVENTS_PER_SAMPLE n.
EVENTS_AT_LEAST = 1000
EVENTS_PER_SAMPLE = 50


@inner()
def run(
    q: Floats, mass: float, interval: float, n: int, sink: Sink, response_tables: ResponseTables
) -> tuple[float, int, int]:
    """Simulate one recording; return (sum of squared residuals, events, code).

    Parameters
    ----------
    q : (11,) parameters, SI units (see `normalized`)
    mass, interval, n : kg, s, samples
    sink : what to compare with, or to fill
    response_tables : tables, kept from call to call
    """
    code = check(q, mass, interval, n)
    if code != OK:
        return math.inf, 0, code
    motion = scale(q, mass, interval)
    stop, contact = has_stop(q), begins_in_contact(q)
    forced = motion.force != 0.0
    prepare(response_tables, 0, motion.b_flight, motion.K_flight, motion.w, forced)
    predictable = stop and not forced and 2.0 * motion.b_flight + math.sqrt(motion.K_flight) < SLOW
    if stop:
        prepare(response_tables, 1, motion.b_contact, motion.K_contact, motion.w, forced)
        predictable = predictable and 2.0 * motion.b_contact + math.sqrt(motion.K_contact) < SLOW

    limit = EVENTS_AT_LEAST + EVENTS_PER_SAMPLE * n
    t, y, v = 0.0, q[Y0], q[V0] * interval
    total = 0.0
    count = i = typed(0)
    response_tables.history[:] = 0.0
    while True:
        if predictable and count > 0:
            contact, t, v, i, count, passed = return_time_prediction(
                response_tables, sink, motion, n, limit, contact, t, v, i, count
            )
            total += passed
        if contact:
            side, b, K, rest = 1, motion.b_contact, motion.K_contact, motion.rest
        else:
            side, b, K, rest = 0, motion.b_flight, motion.K_flight, 0.0
        wait, v_next = math.inf, 0.0
        if stop:
            wait, v_next = next_event(motion, contact, b, K, rest, t, y - rest, v, n - 1 - t)
            if math.isnan(wait):
                return math.inf, count, SEARCH_FAILED
        end = n if t + wait >= n else math.ceil(t + wait)
        total += pass_samples(
            sink, response_tables.tables, side, motion, b, K, rest, t, y - rest, v, i, end
        )
        i = end
        if i >= n:
            break
        t, y, v = t + wait, motion.gap, v_next
        contact = not contact
        if count < sink.events.shape[0]:
            sink.events[count, 0] = t
            sink.events[count, 1] = v
        count += 1
        if count > limit:
            return math.inf, count, TOO_MANY_EVENTS
    if not finite(total, sink.out):
        return math.inf, count, OVERFLOW
    return total, count, OK


@inner(fastmath={"reassoc"})
def finite(total: float, out: Floats) -> bool:
    """Say whether a recording's results are finite."""
    for i in range(out.size):  # 0 if finite, else nan; a test of each would not vectorise
        total += out[i] * 0.0
    return math.isfinite(total)
