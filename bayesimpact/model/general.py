"""The oscillator with added effects, from event to event.

A step ends at a sample, at an event (touch, release, turning point under dry friction) or on a surface where
a force has a kink. Long runs of samples without an event take a fast path; a step that might hide one is
repeated on the careful path, which locates the event on the integrator's own trajectory.
"""

from __future__ import annotations

import numpy as np
from numba import carray, prange

from bayesimpact.model.callback import call_law, pointer_to
from bayesimpact.model.compiled import compiled
from bayesimpact.model.step import (
    AHEAD,
    C1,
    C2,
    CONTACT_MASS,
    FORCE,
    FRICTION,
    GAP_STEP,
    K1,
    K2,
    LAW_FIRST,
    LAW_RATE,
    LAW_SURFACE,
    MEMORY,
    NO_TENSION,
    V0,
    WORK_ROWS,
    Y0,
    G,
    laws_force,
    propagator,
    push,
    step,
)

# what holds between events: gap, kind of motion, direction of sliding, impacts so far, then the laws' sides
GAP, MODE, SLIDING, IMPACTS, SIDES = range(5)
FREE, TOUCHING, SEPARATED = 0.0, 1.0, 2.0  # SEPARATED: beyond the gap, but the obstacle has let go
NONE, TOUCH, LEAVE, TURN, SURFACE = range(-1, 4)  # SURFACE + i: surface of law i

OK, BAD_PARAMETERS, TOO_MANY_EVENTS, NOT_FINITE = 0, 1, 2, 3
MAX_ANGLE = 0.12  # largest step times natural frequency with added forces, rad
MAX_ANGLE_PLAIN = (
    0.6  # the same without: the flow is exact, but no step may hide two turning points
)
EVENTS_PER_SAMPLE = 64
LOCATE_TRIALS = 60


@compiled(forceinline=True)
def linear_flow(s, q, mass):
    """Mass, damping, stiffness and equilibrium of the linear flow in the present kind of motion."""
    if s[MODE] == TOUCHING:
        stiffness = q[K1] + q[K2]
        rest = (q[K2] * s[GAP] - q[FRICTION] * s[SLIDING]) / stiffness
        return mass + q[CONTACT_MASS], q[C1] + q[C2], stiffness, rest
    return mass, q[C1], q[K1], -q[FRICTION] * s[SLIDING] / q[K1]


@compiled(forceinline=True)
def pieces(flow, time, plain):
    """Equal steps into which a time is cut."""
    largest = MAX_ANGLE_PLAIN if plain else MAX_ANGLE
    return int(np.ceil(np.sqrt(flow[2] / flow[0]) * time / largest))


@compiled(forceinline=True)
def keep_memory(work):
    """Take the laws' states at the end of a step as those of the next step's start."""
    for i in range(work.shape[1]):
        work[MEMORY, i] = work[AHEAD, i]


@compiled(forceinline=True)
def one_sided(q):
    """True when the obstacle cannot pull."""
    return q[NO_TENSION] != 0.0 or q[CONTACT_MASS] > 0.0


@compiled(forceinline=True)
def reaction(y, v, t, row, flow, scene):
    """Force of the obstacle on the mass in contact, N (positive pushes it back)."""
    q, gap = scene[0], scene[4]
    direct = q[C2] * v + q[K2] * (y - gap) + laws_force(y, v, t, row, scene, False)
    direct -= laws_force(y, v, t, row, (q, scene[1], scene[2], scene[3], gap, False), False)
    if q[CONTACT_MASS] == 0.0:
        return direct
    mass, damping, stiffness, rest = flow
    pull = damping * v + stiffness * (y - rest) - push(y, v, t, row, scene)
    return direct - q[CONTACT_MASS] * pull / mass


@compiled(forceinline=True)
def event_value(event, y, v, t, row, s, flow, scene):
    """Smooth function that falls below zero when the event has happened."""
    q, gap = scene[0], scene[4]
    if event == TOUCH:
        if s[MODE] == SEPARATED:
            return -(q[C2] * v + q[K2] * (y - gap))
        return gap - y
    if event == LEAVE:
        return reaction(y, v, t, row, flow, scene) if one_sided(q) else y - gap
    if event == TURN:
        return v * s[SLIDING]
    law = event - SURFACE
    return s[SIDES + law] * surface_value(law, y, v, t, row, scene)


@compiled(forceinline=True)
def surface_value(law, y, v, t, row, scene):
    """Value of a law's surface function."""
    _, base, laws, work, gap, touching = scene
    p, flag = base + 8 * laws[law, LAW_FIRST], 1.0 if touching else 0.0
    return call_law(laws[law, LAW_SURFACE], y, v, y - gap, t, work[row, law], flag, p, base)


@compiled(forceinline=True)
def passed(y, v, t, row, s, flow, scene, known):
    """An event, other than the `known` one, that lies behind this point of the trajectory, or NONE."""
    q, laws = scene[0], scene[2]
    if s[MODE] == TOUCHING:
        if known != LEAVE and event_value(LEAVE, y, v, t, row, s, flow, scene) < 0.0:
            return LEAVE
    elif known != TOUCH and event_value(TOUCH, y, v, t, row, s, flow, scene) < 0.0:
        return TOUCH
    if q[FRICTION] > 0.0 and known != TURN and v * s[SLIDING] < 0.0:
        return TURN
    for i in range(laws.shape[0]):
        if (
            laws[i, LAW_SURFACE] != 0
            and known != SURFACE + i
            and event_value(SURFACE + i, y, v, t, row, s, flow, scene) < 0.0
        ):
            return SURFACE + i
    return NONE


@compiled(forceinline=True)
def may_hide_touch(y, v, y1, v1, h, s, q):
    """True when the mass may touch and fall back (or leave and return) between the ends of a step."""
    if s[MODE] == SEPARATED or (s[MODE] == TOUCHING and one_sided(q)):
        return False
    sign = -1.0 if s[MODE] == TOUCHING else 1.0
    if not (sign * v > 0.0 and sign * v1 < 0.0):
        return False
    return sign * (y + v * h - s[GAP]) > 0.0 or sign * (y1 - v1 * h - s[GAP]) > 0.0


@compiled()
def trial(y, v, t, h, flow, plain, memory, scene):
    """A step of any length."""
    half = propagator(0.5 * h, flow[0], flow[1], flow[2])
    return step(y, v, t, h, flow, half, plain, memory, scene)


@compiled()
def hidden_touch(y, v, t, h, s, flow, plain, memory, scene):
    """Length of a step to a point beyond y = g near the turning point inside the step, or 0."""
    sign = -1.0 if s[MODE] == TOUCHING else 1.0
    low, high = 0.0, h
    for _ in range(LOCATE_TRIALS):
        middle = 0.5 * (low + high)
        y1, v1 = trial(y, v, t, middle, flow, plain, memory, scene)
        if sign * (y1 - s[GAP]) > 0.0:
            return middle
        if sign * v1 > 0.0:
            low = middle
        else:
            high = middle
    return 0.0


@compiled()
def locate(event, y, v, t, h, at_end, s, flow, plain, memory, scene):
    """Length of the step to the event inside (0, h]: a bracketed secant (Illinois) on steps of the integrator."""
    row = AHEAD if memory else MEMORY
    low, high, at_low, at_high = 0.0, h, event_value(event, y, v, t, MEMORY, s, flow, scene), at_end
    if at_low <= 0.0:  # starts on the surface itself
        at_low = -1e-6 * at_high
    tolerance = 2e-16 * (t + h) + 1e-15 * h
    for _ in range(LOCATE_TRIALS):
        middle = (low * at_high - high * at_low) / (at_high - at_low)
        if not low < middle < high:
            middle = 0.5 * (low + high)
        y1, v1 = trial(y, v, t, middle, flow, plain, memory, scene)
        value = event_value(event, y1, v1, t + middle, row, s, flow, scene)
        if value > 0.0:
            step_size = middle - low
            low, at_low, at_high = middle, value, 0.5 * at_high
        else:
            step_size = high - middle
            high, at_high, at_low = middle, value, 0.5 * at_low
        if value == 0.0 or high - low < tolerance or step_size < tolerance:
            return middle
    return high


@compiled()
def first_event(y, v, t, h, y1, v1, known, s, flow, plain, memory, scene):
    """Earliest event in a step and the length of the step to it; (NONE, h) when there is none."""
    row = AHEAD if memory else MEMORY
    event, length = NONE, h
    if may_hide_touch(y, v, y1, v1, h, s, scene[0]):
        shorter = hidden_touch(y, v, t, h, s, flow, plain, memory, scene)
        if shorter > 0.0:
            length = shorter
            y1, v1 = trial(y, v, t, length, flow, plain, memory, scene)
    for _ in range(8):
        found = passed(y1, v1, t + length, row, s, flow, scene, known if event == NONE else event)
        if found == NONE:
            break
        at_end = event_value(found, y1, v1, t + length, row, s, flow, scene)
        event, length = found, locate(found, y, v, t, length, at_end, s, flow, plain, memory, scene)
        y1, v1 = trial(y, v, t, length, flow, plain, memory, scene)
    return event, length, y1, v1


@compiled()
def start_sliding(y, t, s, scene):
    """Direction of sliding from a standstill: 0 where dry friction holds the mass."""
    q = scene[0]
    force = push(y, 0.0, t, MEMORY, scene) - q[K1] * y
    if s[MODE] == TOUCHING:
        force -= q[K2] * (y - s[GAP])
    s[SLIDING] = np.sign(force) if abs(force) > q[FRICTION] else 0.0


@compiled()
def resolve(event, y, v, t, s, mass, scene):
    """State after an event: changes what holds between events, returns displacement and velocity."""
    q = scene[0]
    if event == TOUCH:
        if s[MODE] == FREE:
            y = s[GAP]
            v *= mass / (mass + q[CONTACT_MASS])
        s[MODE] = TOUCHING
        s[IMPACTS] += 1.0
    elif event == LEAVE:
        if not one_sided(q):
            y = s[GAP]
        s[GAP] += q[GAP_STEP]
        s[MODE] = SEPARATED if y > s[GAP] else FREE
    elif event == TURN:
        v = 0.0
        start_sliding(y, t, s, scene)
    else:
        s[SIDES + event - SURFACE] *= -1.0
    return y, v


@compiled()
def careful(y, v, t, until, s, mass, plain, memory, q, base, laws, work):
    """Motion from t to the next sample, every event located and resolved: (y, v, code)."""
    known = NONE
    for _ in range(EVENTS_PER_SAMPLE):
        touching = s[MODE] == TOUCHING
        scene = (q, base, laws, work, s[GAP], touching)
        if until - t <= 0.0:
            return y, v, OK
        if q[FRICTION] > 0.0 and s[SLIDING] == 0.0 and v == 0.0:
            start_sliding(y, until, s, scene)
            return y, v, OK
        flow = linear_flow(s, q, mass)
        cuts = pieces(flow, until - t, plain)
        h = (until - t) / cuts
        event = NONE
        for _piece in range(cuts):
            y1, v1 = trial(y, v, t, h, flow, plain, memory, scene)
            event, length, y1, v1 = first_event(
                y, v, t, h, y1, v1, known, s, flow, plain, memory, scene
            )
            known = NONE
            y, v, t = y1, v1, t + length
            if memory:
                keep_memory(work)
            set_sides(y, v, t, s, scene)
            if s[MODE] == SEPARATED and event != TOUCH and y <= s[GAP]:
                s[MODE] = FREE
            if event != NONE:
                y, v = resolve(event, y, v, t, s, mass, scene)
                known = event if event >= TURN else NONE
                break
        if event == NONE:
            return y, v, OK if np.isfinite(y) else NOT_FINITE
    return y, v, TOO_MANY_EVENTS


@compiled()
def run_smooth(y, v, s, mass, interval, plain, memory, q, base, laws, work, out, first):
    """Samples from `first` on, as many as come without an event: (y, v, time reached, next sample)."""
    t = (first - 1) * interval
    if s[MODE] == SEPARATED or (q[FRICTION] > 0.0 and s[SLIDING] == 0.0):
        return y, v, t, first
    scene = (q, base, laws, work, s[GAP], s[MODE] == TOUCHING)
    flow = linear_flow(s, q, mass)
    row = AHEAD if memory else MEMORY
    cuts = pieces(flow, interval, plain)
    h = interval / cuts
    half = propagator(0.5 * h, flow[0], flow[1], flow[2])
    for j in range(first, out.size):
        for piece in range(cuts):
            t = (j - 1) * interval + piece * h
            y1, v1 = step(y, v, t, h, flow, half, plain, memory, scene)
            if may_hide_touch(y, v, y1, v1, h, s, q) or (
                passed(y1, v1, t + h, row, s, flow, scene, NONE) != NONE
            ):
                return y, v, t, j
            y, v = y1, v1
            if memory:
                keep_memory(work)
        out[j] = y
    return y, v, t, out.size


@compiled()
def begin(s, q, base, laws, work):
    """Motion and situation at t = 0 from the slots: (y, v)."""
    y, v = q[Y0], q[V0]
    s[GAP] = q[G]
    s[MODE] = TOUCHING if y > q[G] or (y == q[G] and v > 0.0) else FREE
    scene = (q, base, laws, work, s[GAP], s[MODE] == TOUCHING)
    s[SLIDING] = np.sign(v)
    if q[FRICTION] > 0.0 and v == 0.0:
        start_sliding(y, 0.0, s, scene)
    set_sides(y, v, 0.0, s, scene)
    return y, v


@compiled()
def set_sides(y, v, t, s, scene):
    """Side of each law's surface that the motion is on, where it is not known yet."""
    laws = scene[2]
    for i in range(laws.shape[0]):
        if laws[i, LAW_SURFACE] != 0 and s[SIDES + i] == 0.0:
            s[SIDES + i] = np.sign(surface_value(i, y, v, t, MEMORY, scene))


@compiled()
def admissible(q, mass):
    """True when the slots describe an oscillator."""
    for i in range(q.size):
        if not (np.isfinite(q[i]) or i == G):
            return False
    positive = mass > 0.0 and q[K1] > 0.0 and q[K2] >= 0.0
    return positive and q[CONTACT_MASS] >= 0.0 and q[FRICTION] >= 0.0


@compiled()
def integrate(q, mass, interval, laws, out):
    """As `walk`, on arrays that own nothing."""
    s, work = np.zeros(SIDES + laws.shape[0]), np.zeros((WORK_ROWS, laws.shape[0]))
    return walk(
        carray(pointer_to(q.ctypes.data), q.shape, np.float64),
        mass,
        interval,
        carray(pointer_to(laws.ctypes.data), laws.shape, np.int64),
        carray(pointer_to(s.ctypes.data), s.shape, np.float64),
        carray(pointer_to(work.ctypes.data), work.shape, np.float64),
        carray(pointer_to(out.ctypes.data), out.shape, np.float64),
    )


@compiled()
def walk(q, mass, interval, laws, s, work, out):
    """Displacement at the samples, (n,), m, without the sensor's offset; returns a failure code."""
    out[:] = 0.0
    if not admissible(q, mass):
        return BAD_PARAMETERS
    n_laws = laws.shape[0]
    plain, memory = n_laws == 0 and q[FORCE] == 0.0, False
    for i in range(n_laws):
        memory = memory or laws[i, LAW_RATE] != 0
    base = q.ctypes.data
    y, v = begin(s, q, base, laws, work)
    out[0] = y
    j = 1
    while j < out.size:
        y, v, t, j = run_smooth(y, v, s, mass, interval, plain, memory, q, base, laws, work, out, j)
        if j < out.size:
            y, v, code = careful(y, v, t, j * interval, s, mass, plain, memory, q, base, laws, work)
            if code != OK:
                return code
            out[j] = y
            j += 1
    return OK


@compiled(parallel=True)
def integrate_many(q, mass, intervals, counts, laws, out):
    """Trajectories (K, n) of slot vectors (K, Q), `counts` (K,) samples each; returns codes (K,)."""
    codes = np.zeros(q.shape[0], dtype=np.int64)
    for k in prange(q.shape[0]):
        codes[k] = integrate(q[k], mass, intervals[k], laws, out[k, : counts[k]])
    return codes


@compiled()
def integrate_few(q, mass, intervals, counts, laws, out):
    """The same on one thread."""
    codes = np.zeros(q.shape[0], dtype=np.int64)
    for k in range(q.shape[0]):
        codes[k] = integrate(q[k], mass, intervals[k], laws, out[k, : counts[k]])
    return codes
