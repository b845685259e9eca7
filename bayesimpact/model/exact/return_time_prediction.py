"""Events by return-time prediction: one stretch after the other without exp, sin or cos.

For unforced regimes that are slow against the sampling. A stretch begins at the stop and moves away
from it. How long it lasts is guessed from how long the regime lasted the last times; from the
table's sample next to the guess the local Taylor series is inverted, and the crossing corrected by
the exact motion. The answer counts only if no earlier crossing is possible: moving away, z rises
for the first time from its first trough to the peak half a period later, monotonically; so a rising
crossing before the second trough is the first. Whatever is not settled here is left to the general
search in `events`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.exact.blocks import Sink, pass_plain, reading_of
from bayesimpact.model.exact.flow import advance
from bayesimpact.model.exact.normalized import NormalizedParameters
from bayesimpact.model.exact.tables import LENGTH, ResponseTables, nearby
from bayesimpact.model.jit.compiled import compiled, inner

Floats = NDArray[np.float64]

#: Corrections after which the general search takes over.
CORRECTIONS = 5
#: Error left by the last correction, in sampling intervals.
SMALL = 2e-14


@inner()
def second_trough(b: float, K: float) -> float:
    """Return a time at which a motion that falls now cannot have begun to rise a second time."""
    square = K - b * b
    return 1.999 * math.pi / math.sqrt(square) if square > 0.0 else math.inf


@inner()
def first_guess(K: float, z: float, v: float) -> float:
    """Return when a motion that falls from z with v < 0 would be back at z without damping."""
    rate = math.sqrt(K)
    return 2.0 * math.atan2(-v, -z * rate) / rate


@inner(forceinline=True, fastmath={"contract"})
def correct(b: float, K: float, z: float, v: float, level: float) -> tuple[float, float, bool]:
    """Return the time from (z, v) to the level, z' there, and whether both are exact to rounding.

    The motion's Taylor series to third order, inverted.
    """
    pull = -2.0 * b * v - K * z
    jerk = -2.0 * b * pull - K * v
    inverse = 1.0 / v
    error = (z - level) * inverse
    bend = error * pull * inverse
    square = error * error
    step = -error * (1.0 + bend * (0.5 + 0.5 * bend) - jerk * inverse * square * (1.0 / 6.0))
    rise = v + step * (pull + step * (0.5 * jerk + step * (-2.0 * b * jerk - K * pull) / 6.0))
    curved = K * square
    left = abs(error) * (abs(bend) * (bend * bend + curved) + curved * curved)
    return step, rise, left < SMALL


@inner(forceinline=True)
def expect(history: Floats, side: int) -> float:
    """Return how long a regime is expected to last, by extrapolation; 0 at its first time."""
    total: float = history[side, 0] + history[side, 1] + history[side, 2] + history[side, 3]
    return total


@inner(forceinline=True)
def remember(history: Floats, side: int, wait: float) -> None:
    """Update a row of the history: last duration, three backward differences, how many so far."""
    seen = history[side, 4]
    first = wait - history[side, 0] if seen > 0.0 else 0.0
    second = first - history[side, 1] if seen > 1.0 else 0.0
    history[side, 3] = second - history[side, 2] if seen > 2.0 else 0.0
    history[side, 2], history[side, 1], history[side, 0] = second, first, wait
    history[side, 4] = seen + 1.0


@compiled(fastmath={"contract"})
def return_time_prediction(
    response_tables: ResponseTables, sink: Sink, motion: NormalizedParameters, n: int, limit: int,
    contact: bool, t: float, v: float, i: int, count: int,
) -> tuple[bool, float, float, int, int, float]:  # fmt: skip
    """Carry the motion from an event at (t, gap, v) to the last event that prediction settles.

    i is the first sample at or after t, `count` the events so far, `limit` how many there may be;
    response_tables.history is 0 at the start of a recording.
    Returns (contact, t, v, i, count) there and the sum of squares of the samples passed.
    """
    tables, series, history = (
        response_tables.tables,
        response_tables.series,
        response_tables.history,
    )
    data, out, speeds, events = sink.data, sink.out, sink.speeds, sink.events
    b_flight, K_flight, b_contact, K_contact = motion[:4]
    gap, rest_contact, offset = motion.gap, motion.rest, motion.offset
    safe_flight, safe_contact = (
        second_trough(b_flight, K_flight),
        second_trough(b_contact, K_contact),
    )
    total = 0.0
    fall = -v if contact else v  # z' = +-y' at the start of a stretch, below 0
    while count < limit:
        if contact:
            side, b, K, rest, safe = 1, b_contact, K_contact, rest_contact, safe_contact
            u, v, level = gap - rest, -fall, rest - gap
        else:
            side, b, K, rest, safe = 0, b_flight, K_flight, 0.0, safe_flight
            u, v, level = gap, fall, gap

        # z at the table's sample next to the expected end, and the time from there to the end
        guess = expect(history, side)
        if guess == 0.0:
            guess = first_guess(K, level, fall)
        if not t + guess < n:
            break
        j = math.floor(guess + 0.5)
        ahead = guess - j
        blocks = 0
        z, speed = level, fall
        while j > LENGTH:
            z, speed = advance(b, K, z, speed, tables[side, 0, LENGTH], tables[side, 1, LENGTH])
            blocks += 1
            j -= LENGTH
        j = max(j, 0)
        first_z, first_speed = z, speed
        rise = 0.0
        converged = False
        for _ in range(CORRECTIONS):
            z, speed = advance(b, K, first_z, first_speed, tables[side, 0, j], tables[side, 1, j])
            S, D = nearby(series, side, ahead)
            z, speed = advance(b, K, z, speed, S, D)
            step, rise, converged = correct(b, K, z, speed, level)
            ahead += step
            if converged:
                break
            if abs(ahead) > 0.75:  # closer to another sample of the table, if not nonsense
                hop = math.floor(min(max(ahead, -LENGTH), LENGTH) + 0.5)
                hop = min(max(hop, -j), LENGTH - j)
                j, ahead = j + hop, ahead - hop
        wait = blocks * LENGTH + j + ahead
        if not (converged and rise > 0.0 and abs(ahead) <= 1.0 and 0.0 < wait < safe):
            break
        if not t + wait < n - 1.0:
            break

        end = math.ceil(t + wait)
        S, D = nearby(series, side, i - t)
        u, v = advance(b, K, u, v, S, D)
        shift, u, v, _, _ = reading_of(
            sink.order, sink.rate, b, K, 0.0, rest, offset, u, v, 0.0, 0.0
        )
        total += pass_plain(data, out, speeds, tables, side, b, K, shift, u, v, i, end)
        i = end
        remember(history, side, wait)
        t += wait
        fall = -rise
        contact = not contact
        if count < events.shape[0]:
            events[count, 0] = t
            events[count, 1] = rise if contact else fall
        count += 1
    return contact, t, (-fall if contact else fall), i, count, total
