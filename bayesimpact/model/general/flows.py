"""The linear flow of a stretch without events, and the steps that resolve what is added to it."""

from __future__ import annotations

from typing import Any

import numpy as np

from bayesimpact.model.general.contact_state import (
    GAP,
    MODE,
    SIDES,
    SLIDING,
    TOUCHING,
    surface_value,
)
from bayesimpact.model.general.context import (
    C1,
    C2,
    CONTACT_MASS,
    FORCE,
    FRICTION,
    K1,
    K2,
    NOW,
    OMEGA,
    V0,
    WORK_COLUMNS,
    Y0,
    Flow,
    law_value,
    strength,
)
from bayesimpact.model.general.dense import LONGEST_STRIDE
from bayesimpact.model.general.memory import split_memory
from bayesimpact.model.general.resonator import (
    BODIES,
    OBSTACLE,
    acts,
    body,
    fastest_body,
    share_of_frame,
)
from bayesimpact.model.general.second_mode import listens
from bayesimpact.model.general.turning import (
    STIFF,
    graded,
    pull_at,
    rooted_damping,
    sum_of_laws,
)
from bayesimpact.model.jit.compiled import inner
from bayesimpact.model.law_table import (
    CONTACT_ONLY,
    JUMP_AT_TURN,
    KINK_AT_TURN,
    LAW_COLUMNS,
    LAW_FEATURE,
    LAW_FLAGS,
    LAW_FORCE,
    LAW_RATE,
    LAW_SURFACE,
    LAW_TIME_RATE,
    LAW_TRAVEL,
    LAW_TURN,
    PLACED,
    POLYNOMIAL,
    ROUGH_AT_TOUCH,
)

MAX_ANGLE = 0.125  # longest step times natural frequency, rad
MAX_ANGLE_PLAIN = 0.6  # the same where nothing is added: exact, but one turning point at most
MAX_ANGLE_OF_TIME = 0.32  # the same for an explicit dependence on time
FINER = 2.4  # of a body on a spring of its own: it is not small, as other added forces are
LONGER = 1.28  # where no force depends on the velocity: the method for these is the more accurate
SHORTER = 0.5  # where a force that does is not smooth at impact
FEATURES = 1.1  # that a step may pass at the cycle's highest speed
ROUND_UP = 0.3  # of a sample: steps end on samples, and may be that much longer for it
RENEWED = 64  # longest steps after which a flow is chosen anew: the amplitude may have grown
MOST_CUTS = 4096  # steps per sample at most
MOST_HOPS = 64  # per sample, of an exact flow with a body too fast to be seen
FOLDED = 0.1  # a law's stiffness above this share of the linear one is counted into the flow
LEAST = 0.25  # of the linear stiffness, which the flow keeps
REACH = np.sqrt(0.75)  # where a cubic spring's secant has its mean stiffness, over the amplitude
RAMP = 0.3  # first step of a contact over the time constant of a law's state
# where a force is not smooth at impact: shortest step over the longest; then, for times in units
# of the longest step, step over the 3/4th power of the time since the impact, or to the release
FIRST, SINCE, UNTIL = 1.0 / 80.0, 0.46, 0.27
ENDS_ON_TURNS = KINK_AT_TURN | JUMP_AT_TURN
# a force without features admits longer steps the weaker it is: share of the linear force at which
# they are the usual ones, and by how much they are shortened and lengthened at most
SLIGHT, LEAST_LENGTHENING, MOST_LENGTHENING = 0.07, 0.4, 3.2
OUTSIDE = 0.04  # of a force that does not depend on the motion: nothing feeds its errors back
DRIVEN = 4.0  # times its static deflection: an amplitude that an input is expected to cause
OFF_TURN, OFF_PASSAGE = np.cos(np.pi / 8), np.sin(np.pi / 8)  # of the cycle's four points


@inner()
def flow_from(y: Any, v: Any, t: Any, w: Any) -> Any:
    """Linear flow of the present kind of motion, and the longest step that resolves the rest."""
    q, s, laws = w.q, w.s, w.laws
    touching = s[MODE] == TOUCHING
    count, memory, turns, rough, tame, placed = 0, False, q[FRICTION] > 0.0, False, True, True
    first_at_turn = 1.0
    for law in range(w.size):
        flags = laws[LAW_COLUMNS * law + LAW_FLAGS]
        if touching or flags & CONTACT_ONLY == 0:
            memory = memory or laws[LAW_COLUMNS * law + LAW_RATE] != 0
            w.acting[count] = law
            count += 1
            bounded = laws[LAW_COLUMNS * law + LAW_SURFACE] != 0
            rooted = laws[LAW_COLUMNS * law + LAW_TURN] != 0
            turns = turns or flags & ENDS_ON_TURNS != 0 or bounded or rooted
            turns = turns or laws[LAW_COLUMNS * law + LAW_TRAVEL] != 0
            rough = rough or (touching and flags & ROUGH_AT_TOUCH != 0)
            tame = tame and flags & POLYNOMIAL != 0
            placed = placed and flags & PLACED != 0
    mass, damping, stiffness, force = w.mass, q[C1], q[K1], -q[FRICTION] * s[SLIDING]
    if touching:
        mass += q[CONTACT_MASS]
        damping += q[C2]
        stiffness += q[K2]
        force += q[K2] * s[GAP]
    bodies = fastest_body(touching, w)
    if bodies > 0.0:
        memory, tame = True, False
        mass -= share_of_frame(w) * w.mass
        for which in range(BODIES):
            if acts(which, touching, w):
                m2, W, own = body(which, w)
                damping, stiffness = damping + m2 * own, stiffness + m2 * W
                force += m2 * W * s[GAP] if which == OBSTACLE else 0.0
    slope, level, time_rate = 0.0, 0.0, abs(q[OMEGA]) if q[FORCE] != 0.0 else 0.0
    time_rate, feature_length = max(time_rate, FINER * bodies), np.inf
    if count > 0:
        slope, level = linearize(y, v, t, mass, damping, stiffness, force, count, w)
        for k in range(count):
            law = w.acting[k]
            contact, z = 1.0 if touching else 0.0, w.work[WORK_COLUMNS * law + NOW]
            if laws[LAW_COLUMNS * law + LAW_TIME_RATE] != 0:
                time_rate = max(
                    time_rate, law_value(law, LAW_TIME_RATE, y, v, t, z, s[GAP], contact, w)
                )
            if laws[LAW_COLUMNS * law + LAW_FEATURE] != 0:
                feature_length = min(
                    feature_length, law_value(law, LAW_FEATURE, y, v, t, z, s[GAP], contact, w)
                )
            if laws[LAW_COLUMNS * law + LAW_TURN] != 0:
                share = law_value(law, LAW_TURN, y, v, t, z, s[GAP], contact, w)
                first_at_turn = min(first_at_turn, share)
    stiffness += slope
    b, K = 0.5 * damping / mass, stiffness / mass
    forced, drag = q[FORCE] != 0.0, 0.0
    plain = count == 0 and not memory and not forced
    longest = MAX_ANGLE_PLAIN / np.sqrt(K) if plain else MAX_ANGLE / np.sqrt(K + b * b)
    if time_rate > 0.0:
        longest = min(longest, MAX_ANGLE_OF_TIME / time_rate)
    placed = placed and not memory
    if placed and not plain:
        longest *= LONGER
    if rough and not placed:
        longest *= SHORTER
    joint = bodies > 0.0 and count == 0 and not forced
    if joint:
        longest = MAX_ANGLE_PLAIN / (np.sqrt(K) + bodies)
        if listens(w):
            longest = min(longest, MAX_ANGLE_OF_TIME / time_rate)
        longest = max(longest, w.interval / MOST_HOPS)
        longest = w.interval / np.ceil(w.interval / longest)
    linearizes = first_at_turn < 1.0 and not (placed or memory or forced) and time_rate == 0.0
    if linearizes:  # the method is none for a force that changes faster than such a speed settles
        rate = rooted_damping(y, v, t, count, w) / mass
        pull = damping * v + (stiffness - slope) * y - force
        pull += sum_of_laws(y, v, t, count, False, w)
        if rate * graded(v, pull / mass, longest, first_at_turn) > STIFF:
            b, drag = b + 0.5 * rate, mass * rate
            level += sum_of_laws(y, v, t, count, True, w) - drag * v
    flow = Flow(
        1.0 / mass, b, K, (force - level) / stiffness, slope, level, drag, s[GAP],
        1.0 if touching else 0.0, count, memory, plain, placed, forced, turns, rough, first_at_turn,
        linearizes, bodies > 0.0, joint, longest,
    )  # fmt: skip
    if tame and not plain:
        longest *= lengthening(y, v, t, time_rate, longest, flow, w)
    if w.driven:
        longest = min(longest, w.interval)  # the input has a kink at every sample
    if feature_length < np.inf:
        longest = min(
            longest, FEATURES * feature_length / np.sqrt(K * (y - flow.rest) ** 2 + v * v)
        )
    return flow, longest


@inner()
def lengthening(y: Any, v: Any, t: Any, time_rate: Any, longest: Any, flow: Any, w: Any) -> Any:
    """Length of the steps over the usual one: longer where what is added to the flow is weak.

    Its size is the largest at four points of a cycle, a quarter of it apart, each at another time
    (phase, where there is a rate of time), over the linear force at the amplitude or, if that is
    larger, at the release: the error of a step grows with it, and with the step's sixth power.
    """
    q, w0, largest = w.q, np.sqrt(flow.K), 0.0
    speed = np.sqrt(flow.K * (y - flow.rest) ** 2 + v * v)
    if w.driven:  # it may grow before the flow is renewed
        speed = max(speed, DRIVEN * strength(w) * flow.inverse / w0)
    y0, v0, wait = speed / w0 * OFF_TURN, speed * OFF_PASSAGE, RENEWED * longest / 3.0
    if time_rate > 0.0:
        wait = 0.5 * np.pi / time_rate
    outside = left_out(flow.rest, 0.0, t, flow, w)
    for point in range(4):
        ys, vs, ts = y0, v0, t + point * wait
        if point % 2 == 1:
            ys, vs = -v0 / w0, y0 * w0
        if point >= 2:
            ys, vs = -ys, -vs
        if flow.touching == 1.0:
            ys = max(ys, flow.gap - flow.rest)
        if time_rate > 0.0 and point > 0:
            outside = left_out(flow.rest, 0.0, ts, flow, w)
        inside = left_out(flow.rest + ys, vs, ts, flow, w) - outside
        largest = max(largest, abs(inside) + OUTSIDE * abs(outside))
    largest += OUTSIDE * strength(w)
    if largest == 0.0:
        return MOST_LENGTHENING
    speed = max(speed, np.sqrt(q[K1] / w.mass * q[Y0] * q[Y0] + q[V0] * q[V0]))
    weight = SLIGHT * w0 * speed / (flow.inverse * largest)
    return min(max(np.sqrt(np.cbrt(weight)), LEAST_LENGTHENING), MOST_LENGTHENING)


@inner(forceinline=True)
def beyond_surface(law: Any, y: Any, v: Any, t: Any, w: Any) -> Any:
    """Whether a point lies on the other side of a law's own surface (if it has one)."""
    if w.laws[LAW_COLUMNS * law + LAW_SURFACE] == 0:
        return False
    return w.s[SIDES + law] * surface_value(law, y, v, t, NOW, w) < 0.0


@inner()
def left_out(y: Any, v: Any, t: Any, flow: Any, w: Any) -> Any:
    """Force that the linear flow leaves out at a point other than the present one, N.

    A law beyond a surface of its own does not count: the motion does not get there within a step.
    """
    total = flow.level + flow.slope * y + flow.drag * v
    for k in range(flow.count):
        law = w.acting[k]
        if beyond_surface(law, y, v, t, w):
            continue
        z = w.work[WORK_COLUMNS * law + NOW]
        total -= law_value(law, LAW_FORCE, y, v, t, z, flow.gap, flow.touching, w)
    return total


@inner()
def linearize(
    y: Any,
    v: Any,
    t: Any,
    mass: Any,
    damping: Any,
    stiffness: Any,
    force: Any,
    count: Any,
    w: Any,
) -> Any:
    """Stiffness and force at y = 0 of the laws: what of them is counted into the linear flow.

    The secant over the cycle of a steady law that has no features; of others what lies just ahead
    (on this side of the law's surface), if it is stiff: exact for springs with gaps.
    """
    touching = 1.0 if w.s[MODE] == TOUCHING else 0.0
    total, gap = force - damping * v - stiffness * y, w.s[GAP]
    for k in range(count):
        law = w.acting[k]
        total -= law_value(
            law, LAW_FORCE, y, v, t, w.work[WORK_COLUMNS * law + NOW], gap, touching, w
        )
    ahead = 0.5 * MAX_ANGLE / np.sqrt(stiffness / mass)
    shift = ahead * (v + 0.5 * ahead * total / mass)
    rest, slope, level = force / stiffness, 0.0, 0.0
    amplitude = REACH * np.sqrt((y - rest) * (y - rest) + v * v * mass / stiffness)
    low, high = rest - amplitude, rest + amplitude
    if touching == 1.0:
        low = max(low, gap)
    for k in range(count):
        law = w.acting[k]
        z = w.work[WORK_COLUMNS * law + NOW]
        bounded = w.laws[LAW_COLUMNS * law + LAW_SURFACE] != 0
        wide = w.laws[LAW_COLUMNS * law + LAW_FLAGS] & (POLYNOMIAL | ROUGH_AT_TOUCH) != 0
        wide = wide and not bounded and w.laws[LAW_COLUMNS * law + LAW_TIME_RATE] == 0
        start, end, speed = (low, high, 0.0) if wide else (y, y + shift, v)
        if beyond_surface(law, end, v, t, w):
            end = y - shift  # about to leave: what lies behind tells the stiffness
        if start == end:
            continue
        here = law_value(law, LAW_FORCE, start, speed, t, z, gap, touching, w)
        there = law_value(law, LAW_FORCE, end, speed, t, z, gap, touching, w)
        stiff = (there - here) / (end - start)
        if wide or stiff > FOLDED * stiffness:
            slope += stiff
            level += here - stiff * start
    if stiffness + slope < LEAST * stiffness:
        return 0.0, 0.0
    return slope, level


@inner(forceinline=True)
def first_step(y: Any, v: Any, t: Any, flow: Any, w: Any) -> Any:
    """Length of the first step, doubled from step to step: small where a law's state starts."""
    if not flow.memory:
        return np.inf
    fastest = split_memory(y, v, t, flow, w)
    return RAMP / fastest if flow.touching == 1.0 and fastest > 0.0 else np.inf


@inner(forceinline=True)
def stride_of(longest: Any, w: Any) -> Any:
    """Samples that a step from a sample on may span, 0 where it has to be cut."""
    samples = longest / w.interval
    return min(int(samples + ROUND_UP), LONGEST_STRIDE) if samples >= 1.0 else 0


@inner(forceinline=True)
def not_beyond(left: Any, h: Any, w: Any) -> Any:
    """A step of length h, ended on the next sample, `left` away, where the input has its kink."""
    return (left, True) if w.driven and h >= left else (h, False)


@inner(forceinline=True)
def next_step(
    y: Any, v: Any, t: Any, n0: Any, j: Any, aligned: Any, longest: Any, rate: Any, flow: Any,
    w: Any,
) -> Any:  # fmt: skip
    """Length of the next step, and whether it ends on a sample.

    n0 is `added_force` at its start, `rate` the `settling_rate`. Near a contact onset that is not
    smooth the steps follow from the motion alone, not from the samples, so that they change
    smoothly with the parameters.
    """
    least = w.interval / MOST_CUTS
    left = j * w.interval - t
    if flow.rough:
        if v != 0.0:
            away = (y - flow.gap) / v  # time since the impact, or minus the time to the release
            root = np.sqrt(abs(away) / longest)
            share = (SINCE if away >= 0.0 else UNTIL) * (LONGER if flow.placed else 1.0)
            longest *= min(1.0, max(FIRST, share * root * np.sqrt(root)))
        return not_beyond(left, max(longest, least), w)
    if flow.first_at_turn < 1.0:
        longest = graded(v, pull_at(y, v, n0, flow), longest, flow.first_at_turn)
        longest = min(longest, STIFF / max(rate, STIFF / longest))
        return not_beyond(left, max(longest, least), w)
    longest = max(longest, least)
    stride = stride_of(longest, w)
    if aligned and stride > 0:
        return min(stride, w.n - j) * w.interval, True
    cuts = int(np.ceil(left / longest * (1.0 - 1e-12)))
    return (left / cuts, False) if cuts > 1 else (left, True)
