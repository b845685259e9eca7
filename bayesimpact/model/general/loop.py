"""The oscillator with added effects, from event to event.

Between two events the motion runs in steps that span as many samples as the accuracy admits, or a
part of one. An event (contact onset or end, turning point, surface of a law) ends a step; it is
located on the integrator's own trajectory, so that the state there is as accurate as anywhere. The
parts: `general.context` (arrays, laws), `general.flows` (between events), `general.step` and
`general.method` (how), `general.turning` (where a force has a root of the speed),
`general.crossing` (when), `general.contact_state` (what then),
`general.memory`, `general.stiction`, `general.dense`, `general.second_mode`, `general.resonator`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.exact.arguments import Inputs
from bayesimpact.model.general.contact_state import (
    HEADING,
    LEAVE,
    NONE,
    SIDES,
    SLIDING,
    begin,
    carry_on,
    heading,
    may_go_on,
    may_step,
    resolve,
    set_contact,
    set_directions,
    update_contact,
)
from bayesimpact.model.general.context import (
    C1,
    C2,
    CONTACT_MASS,
    FRICTION,
    K1,
    K2,
    NOW,
    OBSTACLE_MASS,
    RESTITUTION,
    SECOND_DAMPING,
    SECOND_FREQUENCY,
    SECOND_GAIN,
    WORK_COLUMNS,
    Context,
    G,
)
from bayesimpact.model.general.crossing import first_event, suspicious
from bayesimpact.model.general.dense import LONGEST_STRIDE, fill_in, input_reading, reading
from bayesimpact.model.general.flows import (
    RENEWED,
    first_step,
    flow_from,
    next_step,
    stride_of,
)
from bayesimpact.model.general.memory import keep_memory, relax
from bayesimpact.model.general.method import quarters
from bayesimpact.model.general.resonator import ROWS
from bayesimpact.model.general.second_mode import added_reading, listens, respond
from bayesimpact.model.general.step import added_force, step
from bayesimpact.model.general.stiction import stick
from bayesimpact.model.general.turning import is_outdated, settling_rate
from bayesimpact.model.jit.callback import floats_at, integers_at
from bayesimpact.model.jit.compiled import compiled, inner, typed
from bayesimpact.model.jit.threads import in_shares

OK, BAD_PARAMETERS, TOO_MANY_EVENTS, NOT_FINITE = 0, 1, 2, 3
THREADING_PAYS = 4  # trajectories from which on
FARTHEST = 1e6  # m or rad: a motion that has come as far grows without end, in ever more steps
EVENTS_AT_LEAST, EVENTS_PER_SAMPLE = 1000, 2  # of sections, most of which end without one


@inner()
def admissible(q: Any, mass: Any) -> Any:
    """True when the slots describe an oscillator."""
    for i in range(q.size):
        if not (np.isfinite(q[i]) or i == G):
            return False
    if np.isnan(q[G]) or q[G] == -np.inf:
        return False
    positive = mass > 0.0 and q[K1] > 0.0 and q[K2] >= 0.0 and q[C1] >= 0.0 and q[C2] >= 0.0
    if q[SECOND_GAIN] != 0.0 and not (q[SECOND_FREQUENCY] > 0.0 and q[SECOND_DAMPING] >= 0.0):
        return False
    for i in range(OBSTACLE_MASS, RESTITUTION + 1):
        if not q[i] >= 0.0:
            return False
    return positive and q[CONTACT_MASS] >= 0.0 and q[FRICTION] >= 0.0


@inner()
def cruise(y: Any, v: Any, n0: Any, j: Any, stride: Any, end: Any, flow: Any, w: Any) -> Any:
    """Strides from sample j - 1 to before `end` without an event.

    Returns displacement, velocity, added_force and next sample; whether an event ended it, and then
    displacement, velocity and added_force at the end of the stride that contains it.
    """
    h, event, second = stride * w.interval, False, listens(w)
    at = quarters(h, flow.b, flow.K, flow.inverse)
    y1, v1, n1 = y, v, n0
    while j + stride <= end:
        t = (j - 1) * w.interval
        w.s[HEADING] = heading(v, w)
        y1, v1, n1 = step(y, v, t, n0, at, flow, w)
        event = suspicious(y, v, n0, y1, v1, n1, t + h, h, flow, w)
        if event:
            break
        fill_in(j, j + stride - 1, t, True, at, flow, w, y, v, n0, h, y1, v1, n1)
        last = j + stride - 1
        w.out[last] = reading(y1, v1, n1, flow, w) + input_reading(last, flow.inverse, w)
        if second:
            respond(y, v, t, n0, y1, v1, n1, h, j, j + stride, flow, w)
        j += stride
        y, v, n0 = y1, v1, n1
        if flow.memory:
            keep_memory(w)
        update_contact(y, v, t + h, w)
    return y, v, n0, j, event, y1, v1, n1


@inner()
def section(y: Any, v: Any, t: Any, j: Any, w: Any) -> Any:
    """Motion to the next event, or to where its flow is renewed: (y, v, t, next sample)."""
    set_directions(y, v, t, w)
    flow, longest = flow_from(y, v, t, w)
    start, event, second, stepped = t, typed(NONE), listens(w), False
    ramp = first_step(y, v, t, flow, w)
    n0 = 0.0 if flow.plain else added_force(y, v, t, NOW, flow, w)
    y1, v1, n1 = y, v, n0
    stride = stride_of(longest, w)
    at = quarters(longest, flow.b, flow.K, flow.inverse)
    end = min(w.n, j + max(1, int(min(RENEWED * longest / w.interval, 1.0 * w.n))))
    while j < end:
        aligned, expected = t == (j - 1) * w.interval, False
        even = not flow.rough and flow.first_at_turn >= 1.0
        if aligned and stride > 0 and ramp >= longest and even:
            y, v, n0, j, expected, y1, v1, n1 = cruise(y, v, n0, j, stride, end, flow, w)
            t = (j - 1) * w.interval
            if j == end:
                break
        h, lands = stride * w.interval, True
        if not expected:
            rate = settling_rate(y, v, t, n0, flow, w)
            if stepped and is_outdated(rate, y, v, n0, min(longest, ramp), flow):
                break
            h, lands = next_step(y, v, t, n0, j, aligned, min(longest, ramp), rate, flow, w)
            if not h > 0.0:  # an event on the sample itself
                w.out[j] = reading(y, v, n0, flow, w) + added_reading(y, v, t, w)
                w.out[j] += input_reading(j, flow.inverse, w)
                t = j * w.interval
                j += 1
                continue
            w.s[HEADING] = heading(v, w)
            if h != at.h:
                at = quarters(h, flow.b, flow.K, flow.inverse)
            y1, v1, n1 = step(y, v, t, n0, at, flow, w)
            if not (np.isfinite(y1 + v1) and may_step(w)):  # no step would be short enough
                w.out[j] = np.nan
                return y1, v1, t, w.n
        length = h
        if expected or suspicious(y, v, n0, y1, v1, n1, t + h, h, flow, w):
            event, length, y1, v1, n1 = first_event(y, v, t, n0, h, y1, v1, n1, flow, w)
        lands = lands and event == NONE
        reached = min(int((t + length) / w.interval + 0.5 * lands) + 1, w.n)
        if reached > j + lands:
            fill_in(j, reached - lands, t, aligned, at, flow, w, y, v, n0, length, y1, v1, n1)
        if lands:
            last = reached - 1
            w.out[last] = reading(y1, v1, n1, flow, w) + input_reading(last, flow.inverse, w)
        if second:
            respond(y, v, t, n0, y1, v1, n1, length, j, reached, flow, w)
        t = (reached - 1) * w.interval if lands else t + length
        y, v, n0, j = y1, v1, n1, reached
        ramp, stepped = 2.0 * ramp, True
        if flow.memory:
            keep_memory(w)
        if event != LEAVE:
            update_contact(y, v, t, w)
        if event != NONE:
            break
    if flow.touching == 0.0 and not flow.memory:
        relax(y, v, start, t - start, flow, w)
    if event != NONE:
        y, v = resolve(event, y, v, t, w)
    return y, v, t, j


@inner()
def reading_at(j: Any, y: Any, v: Any, t: Any, w: Any) -> Any:
    """What the probe reads at sample `j`, where a motion begins."""
    at_once = input_reading(j, 0.0, w)
    if w.order < 2:
        return at_once + (y if w.order == 0 else v)
    if v == 0.0 and w.q[FRICTION] > 0.0 and w.s[SLIDING] == 0.0:
        return at_once + added_reading(y, v, t, w)
    set_directions(y, v, t, w)
    flow, _ = flow_from(y, v, t, w)
    force = 0.0 if flow.plain else added_force(y, v, t, NOW, flow, w)
    at_once = input_reading(j, flow.inverse, w)
    return reading(y, v, force, flow, w) + added_reading(y, v, t, w) + at_once


@inner()
def up_to(n: Any, w: Any) -> Any:
    """What stays the same, up to a sample."""
    return Context(
        w.mass, w.interval, n, w.order, w.out, w.tables, w.keys, w.size, w.q, w.base, w.laws,
        w.acting, w.work, w.s, w.wave, w.shown, w.carried, w.driven, w.peak,
    )  # fmt: skip


@inner(inline="always")
def walk(restarts: Any, w: Any) -> Any:
    """Readings at the samples, without the sensor's offset; returns a failure code."""
    y, v = begin(w)
    w.out[0] = reading_at(0, y, v, 0.0, w)
    t, j, r = 0.0, typed(1), 0
    limit = w.n if restarts.shape[0] == 0 else int(restarts[0, 0]) + 1
    part = up_to(limit, w)
    events = EVENTS_AT_LEAST + EVENTS_PER_SAMPLE * w.n
    while j < w.n:
        if j == part.n:
            t = (j - 1) * w.interval
            carry_on(restarts[r, 1] - w.out[j - 1], restarts[r, 2] - v, w)
            y, v = set_contact(restarts[r, 1], restarts[r, 2], t, w)
            w.out[j - 1] = reading_at(j - 1, y, v, t, w)
            r += 1
            part = up_to(w.n if r == restarts.shape[0] else int(restarts[r, 0]) + 1, w)
            continue
        events -= 1
        if events < 0:
            return TOO_MANY_EVENTS
        if v == 0.0 and w.q[FRICTION] > 0.0 and w.s[SLIDING] == 0.0:
            t, j = stick(y, t, j, part)
        else:
            y, v, t, j = section(y, v, t, j, part)
        if not (abs(y) < FARTHEST and np.isfinite(v) and may_go_on(w)):
            return NOT_FINITE
    return OK


@inner(inline="always")
def integrate(
    q: Any,
    mass: Any,
    interval: Any,
    laws: Any,
    order: Any,
    out: Any,
    waves: Any,
    restarts: Any,
    room: Any,
) -> Any:
    """One trajectory, see `integrate_many`. The caller keeps `room`: w has only its addresses.

    waves : (3, n) measured input, see `driven.Wave`, or (3, 0)
    restarts : (m, 3) samples from which on, and states in which, the motion begins anew
    """
    if not admissible(q, mass):
        return BAD_PARAMETERS
    s, acting, work, tables, keys = room
    s[:], acting[:], work[:], keys[:] = 0.0, 0, 0.0, np.nan
    wave, shown, carried = waves[0], waves[1], waves[2]
    w = Context(
        mass, interval, out.size, order, floats_at(out.ctypes.data), floats_at(tables.ctypes.data),
        floats_at(keys.ctypes.data), laws.shape[0], floats_at(q.ctypes.data), q.ctypes.data,
        integers_at(laws.ctypes.data), integers_at(acting.ctypes.data),
        floats_at(work.ctypes.data), floats_at(s.ctypes.data), floats_at(wave.ctypes.data),
        floats_at(shown.ctypes.data), floats_at(carried.ctypes.data), wave.size > 1, largest(wave),
    )  # fmt: skip
    code = walk(restarts, w)
    if code == OK and not np.all(np.isfinite(out)):
        return NOT_FINITE
    return code


@inner()
def largest(values: Any) -> Any:
    """Largest size of values (n,), 0 without any."""
    most = 0.0
    for value in values:
        most = max(most, abs(value))
    return most


@inner()
def room_for(size: Any) -> Any:
    """Work arrays for a number of laws: state, which laws act, memories, tables and their keys."""
    return (
        np.empty(SIDES + size),
        np.empty(size, dtype=np.int64),
        np.empty((size + ROWS, WORK_COLUMNS)),
        np.empty((2, LONGEST_STRIDE, 2)),
        np.empty((2, 2)),
    )


@compiled(nogil=True)
def _in_turn(
    q: Any, mass: Any, intervals: Any, counts: Any, laws: Any, orders: Any, waves: Any,
    starts: Any, restarts: Any, firsts: Any, out: Any, codes: Any,
) -> Any:  # fmt: skip
    room = room_for(laws.shape[0])
    for k in range(q.shape[0]):
        first, size = (0, 0) if starts[k] < 0 else (starts[k], counts[k])
        codes[k] = integrate(
            q[k], mass, intervals[k], laws, orders[k], out[k, : counts[k]],
            waves[:, first : first + size], restarts[firsts[k] : firsts[k + 1]], room,
        )  # fmt: skip


def integrate_many(
    q: NDArray[np.float64],
    mass: float,
    intervals: NDArray[np.float64],
    counts: NDArray[np.int64],
    laws: NDArray[np.int64],
    out: NDArray[np.float64],
    inputs: Inputs | None = None,
    *,
    orders: NDArray[np.int64] | None = None,
    threads: bool | None = None,
    restarts: Sequence[NDArray[np.float64]] = (),
) -> NDArray[np.int64]:
    """Trajectories of many slot vectors, each a recording of its own.

    Parameters
    ----------
    q : (K, Q) slots, then the parameters of the laws, SI units
    mass : kg
    intervals, counts : (K,) sampling intervals, s, and numbers of samples
    laws : (L, LAW_COLUMNS) table of laws, see `bayesimpact.model.law_table.law_row`
    out : (K, n) receives displacements, m, or what `orders` says, without the sensor's offset
    orders : (K,) which time derivative of the displacement; None: 0 throughout
    inputs : measured forces, where recordings have any; the slot A is then their gain
    restarts : per trajectory (m, 3) or none: samples, ascending, none the first, at which the
        motion begins anew, and the displacements, m, and velocities, m/s, there; time, states of
        laws and bodies go on
    threads : share the work among threads; the numbers do not depend on it. None: where it pays

    Returns
    -------
    (K,) codes: OK, BAD_PARAMETERS, TOO_MANY_EVENTS or NOT_FINITE (too many steps too); `out` is
    then not to be used.
    """
    table = np.ascontiguousarray(laws)
    codes = np.zeros(q.shape[0], dtype=np.int64)
    q = np.ascontiguousarray(q)
    orders = np.zeros_like(counts) if orders is None else np.ascontiguousarray(orders)
    given = inputs or Inputs(np.empty((3, 0)), np.full(q.shape[0], -1, dtype=np.int64))
    waves, starts = np.ascontiguousarray(given.values), np.ascontiguousarray(given.starts)

    anew = np.concatenate([np.empty((0, 3)), *restarts])
    firsts = np.concatenate([[0], np.cumsum([len(one) for one in restarts])]).astype(np.int64)
    if not restarts:
        firsts = np.zeros(q.shape[0] + 1, dtype=np.int64)

    def run(first: int, end: int) -> None:
        some = slice(first, end)
        _in_turn(
            q[some], mass, intervals[some], counts[some], table, orders[some], waves, starts[some],
            anew, firsts[first : end + 1], out[some], codes[some],
        )  # fmt: skip

    if threads or (threads is None and q.shape[0] >= THREADING_PAYS):
        in_shares(run, q.shape[0])
    else:
        run(0, q.shape[0])
    return codes
