"""The linear flow of a stretch without events, and the steps that resolve what is added to it."""

from __future__ import annotations

from typing import Any

import numpy as np

from bayesimpact.model.added.dense import LONGEST_STRIDE
from bayesimpact.model.added.memory import split_memory
from bayesimpact.model.added.situation import GAP, MODE, SIDES, SLIDING, TOUCHING, surface_value
from bayesimpact.model.added.world import (
    C1,
    C2,
    CONTACT_MASS,
    CONTACT_ONLY,
    FORCE,
    FRICTION,
    K1,
    K2,
    KINK_AT_TURN,
    LAW_COLUMNS,
    LAW_FLAGS,
    LAW_FORCE,
    LAW_PACE,
    LAW_RATE,
    LAW_SURFACE,
    NOW,
    OMEGA,
    ROUGH_AT_TOUCH,
    WORK_COLUMNS,
    Flow,
    law_value,
)
from bayesimpact.model.compiled import compiled

MAX_ANGLE = 0.125  # longest step times natural frequency, rad
MAX_ANGLE_PLAIN = 0.6  # the same where nothing is added: exact, but one turning point at most
MAX_ANGLE_PACE = 0.35  # the same for an explicit dependence on time
MOST_CUTS = 4096  # steps per sample at most
FOLDED = 0.1  # a law's stiffness above this share of the linear one is counted into the flow
RAMP = 0.3  # first step of a contact over the time constant of a law's state
# where a force is not smooth at the touch: longest step over the usual one, first step over the
# longest, step over the time since the touch, step over the time to the release
ROUGH, FIRST, SINCE, UNTIL = 0.6, 1.0 / 256.0, 0.5, 0.33


@compiled()
def flow_from(y: Any, v: Any, t: Any, w: Any) -> Any:
    """Linear flow of the present kind of motion, and the longest step that resolves the rest."""
    q, s, laws = w.q, w.s, w.laws
    touching = s[MODE] == TOUCHING
    count, memory, turns, rough = 0, False, q[FRICTION] > 0.0, False
    for law in range(w.size):
        flags = laws[LAW_COLUMNS * law + LAW_FLAGS]
        if touching or flags & CONTACT_ONLY == 0:
            memory = memory or laws[LAW_COLUMNS * law + LAW_RATE] != 0
            w.acting[count] = law
            count += 1
            turns = turns or flags & KINK_AT_TURN != 0 or laws[LAW_COLUMNS * law + LAW_SURFACE] != 0
            rough = rough or (touching and flags & ROUGH_AT_TOUCH != 0)
    mass, damping, stiffness, force = w.mass, q[C1], q[K1], -q[FRICTION] * s[SLIDING]
    if touching:
        mass += q[CONTACT_MASS]
        damping += q[C2]
        stiffness += q[K2]
        force += q[K2] * s[GAP]
    slope, level, pace = 0.0, 0.0, abs(q[OMEGA]) if q[FORCE] != 0.0 else 0.0
    if count > 0:
        slope, level = fold(y, v, t, mass, damping, stiffness, force, count, w)
        for k in range(count):
            law = w.acting[k]
            if laws[LAW_COLUMNS * law + LAW_PACE] != 0:
                contact = 1.0 if touching else 0.0
                z = w.work[WORK_COLUMNS * law + NOW]
                pace = max(pace, law_value(law, LAW_PACE, y, v, t, z, s[GAP], contact, w))
    stiffness += slope
    b, K = 0.5 * damping / mass, stiffness / mass
    forced = q[FORCE] != 0.0
    plain = count == 0 and not memory and not forced
    longest = MAX_ANGLE_PLAIN / np.sqrt(K) if plain else MAX_ANGLE / np.sqrt(K + b * b)
    if pace > 0.0:
        longest = min(longest, MAX_ANGLE_PACE / pace)
    flow = Flow(
        1.0 / mass, b, K, (force - level) / stiffness, slope, level, s[GAP],
        1.0 if touching else 0.0, count, memory, plain, forced, turns, rough,
    )  # fmt: skip
    return flow, longest


@compiled()
def fold(
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
    """Stiffness and force at y = 0 of stiff laws, looking ahead: exact for springs with gaps."""
    touching = 1.0 if w.s[MODE] == TOUCHING else 0.0
    total, gap = force - damping * v - stiffness * y, w.s[GAP]
    for k in range(count):
        law = w.acting[k]
        total -= law_value(
            law, LAW_FORCE, y, v, t, w.work[WORK_COLUMNS * law + NOW], gap, touching, w
        )
    ahead = 0.5 * MAX_ANGLE / np.sqrt(stiffness / mass)
    shift = ahead * (v + 0.5 * ahead * total / mass)
    slope, level = 0.0, 0.0
    if shift == 0.0:
        return slope, level
    for k in range(count):
        law = w.acting[k]
        z = w.work[WORK_COLUMNS * law + NOW]
        bounded = w.laws[LAW_COLUMNS * law + LAW_SURFACE] != 0
        if bounded and w.s[SIDES + law] * surface_value(law, y + shift, v, t, NOW, w) < 0.0:
            continue
        here = law_value(law, LAW_FORCE, y, v, t, z, gap, touching, w)
        there = law_value(law, LAW_FORCE, y + shift, v, t, z, gap, touching, w)
        stiff = (there - here) / shift
        if stiff > FOLDED * stiffness:
            slope += stiff
            level += here - stiff * y
    return slope, level


@compiled(forceinline=True)
def first_step(y: Any, v: Any, t: Any, longest: Any, flow: Any, w: Any) -> Any:
    """Length of the first step, doubled from step to step: small where a law's state starts."""
    if not flow.memory:
        return np.inf
    fastest = split_memory(y, v, t, flow, w)
    return RAMP / fastest if flow.touching == 1.0 and fastest > 0.0 else np.inf


@compiled(forceinline=True)
def next_step(y: Any, v: Any, t: Any, j: Any, aligned: Any, longest: Any, flow: Any, w: Any) -> Any:
    """Length of the next step, and whether it ends on a sample.

    Near a touch that is not smooth the steps follow from the motion alone, not from the samples, so
    that they change smoothly with the parameters.
    """
    least = w.interval / MOST_CUTS
    if flow.rough:
        limit = ROUGH * longest
        if v != 0.0:
            away = (y - flow.gap) / v  # time since the touch, or minus the time to the release
            limit = min(limit, max(FIRST * limit, SINCE * away, -UNTIL * away))
        return max(limit, least), False
    longest = max(longest, least)
    if aligned and longest >= w.interval:
        return min(int(longest / w.interval), LONGEST_STRIDE, w.n - j) * w.interval, True
    left = j * w.interval - t
    cuts = int(np.ceil(left / longest * (1.0 - 1e-12)))
    return (left / cuts, False) if cuts > 1 else (left, True)
