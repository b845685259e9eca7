"""What holds between two events of the oscillator with added effects, and how an event changes it.

The mass is free, touches the obstacle, or is separated: beyond the gap though the obstacle, which
cannot pull, has let go. A contact that cannot pull ends when its reaction, once positive, falls
through zero (with adhesion: through what that holds), or at the gap if it never was positive. While
separated, contact resumes as soon as the obstacle would push again (for a gap below zero; else the
mass falls back below the gap first).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from bayesimpact.model.general.context import (
    ADHESION,
    AHEAD,
    C1,
    C2,
    CONTACT_MASS,
    FRICTION,
    GAP_STEP,
    K1,
    K2,
    NO_TENSION,
    NOW,
    RESTITUTION,
    SECOND_GAIN,
    STAGE,
    TURNED,
    V0,
    WAY,
    WORK_COLUMNS,
    Y0,
    G,
    forcing,
    law_value,
)
from bayesimpact.model.general.resonator import (
    FRAME,
    OBSTACLE,
    begin_bodies,
    body_force,
    row,
    share_of_frame,
)
from bayesimpact.model.jit.callback import call_law
from bayesimpact.model.jit.compiled import inner
from bayesimpact.model.law_table import (
    CONTACT_ONLY,
    JUMP_AT_SURFACE,
    JUMP_AT_TURN,
    LAW_COLUMNS,
    LAW_FIRST,
    LAW_FLAGS,
    LAW_FORCE,
    LAW_INITIAL,
    LAW_SURFACE,
    LAW_TRAVEL,
)

# what holds between events: gap, kind of motion, direction of sliding (0: held), direction of
# motion, whether the obstacle has pushed in this contact; displacement and velocity of a second
# mode, and what it keeps for a sampling interval; then the number of steps so far and the side of
# every law's surface
GAP, MODE, SLIDING, HEADING, PUSHED, SECOND_Q, SECOND_P, HOP = range(8)
JOINT = HOP + 8  # matrices of `joint`, in flight and in contact
STEPS = JOINT + 2 * (3 + 36)
SIDES = STEPS + 1
# of steps, on average. The catalogue at its plausible sizes takes up to 36 where a period has three
# samples, up to 4 at 1 kHz; an ascent may ask for motions that take thousands, and minutes.
STEPS_AT_LEAST, STEPS_PER_SAMPLE = 20_000, 100
FREE, TOUCHING, SEPARATED = 0.0, 1.0, 2.0
NEVER, SOON, ONCE = 0.0, 0.5, 1.0  # the obstacle has pushed in this contact; SOON: in this step
NONE, ONSET, LEAVE, TURN, SURFACE = range(-1, 4)  # SURFACE + i: surface of law i


@inner(forceinline=True)
def may_step(w: Any) -> Any:
    """Count a step, and say whether a motion that takes so many is worth its time."""
    w.s[STEPS] += 1.0
    return may_go_on(w)


@inner(forceinline=True)
def may_go_on(w: Any) -> Any:
    """Whether a motion has taken no more steps than are worth their time."""
    return w.s[STEPS] < STEPS_AT_LEAST + STEPS_PER_SAMPLE * w.n


@inner(forceinline=True)
def one_sided(q: Any) -> Any:
    """True when the obstacle cannot pull."""
    return q[NO_TENSION] != 0.0 or q[CONTACT_MASS] > 0.0


@inner(forceinline=True)
def laws_force(y: Any, v: Any, t: Any, column: Any, contact: Any, w: Any) -> Any:
    """Sum of the forces that act in contact only, or of those that act everywhere, N."""
    total, touching = 0.0, 1.0 if w.s[MODE] == TOUCHING or contact else 0.0
    for law in range(w.size):
        if (w.laws[LAW_COLUMNS * law + LAW_FLAGS] & CONTACT_ONLY != 0) == contact:
            z = w.work[WORK_COLUMNS * law + column]
            total += law_value(law, LAW_FORCE, y, v, t, z, w.s[GAP], touching, w)
    return total


@inner()
def reaction(y: Any, v: Any, t: Any, column: Any, w: Any) -> Any:
    """Force with which the obstacle pushes the mass back, N (negative: it would have to pull)."""
    q = w.q
    obstacle = q[C2] * v + q[K2] * (y - w.s[GAP]) + laws_force(y, v, t, column, True, w)
    obstacle += body_force(OBSTACLE, y, v, w.s[GAP], column, w)
    if q[CONTACT_MASS] == 0.0:
        return obstacle
    other = q[C1] * v + q[K1] * y + q[FRICTION] * w.s[SLIDING] - forcing(t, w)
    other += laws_force(y, v, t, column, False, w) + body_force(FRAME, y, v, 0.0, column, w)
    mass = w.mass * (1.0 - share_of_frame(w))
    return (mass * obstacle - q[CONTACT_MASS] * other) / (mass + q[CONTACT_MASS])


@inner(forceinline=True)
def event_value(event: Any, y: Any, v: Any, t: Any, column: Any, w: Any) -> Any:
    """Smooth function that falls through zero when the event happens."""
    s = w.s
    if event == ONSET:
        return s[GAP] - y if s[MODE] == FREE else -reaction(y, v, t, column, w)
    if event == LEAVE:
        pushed = one_sided(w.q) and s[PUSHED] != NEVER
        return reaction(y, v, t, column, w) + w.q[ADHESION] if pushed else y - s[GAP]
    if event == TURN:
        return v * s[HEADING]
    return s[SIDES + event - SURFACE] * surface_value(event - SURFACE, y, v, t, column, w)


@inner(forceinline=True)
def surface_value(law: Any, y: Any, v: Any, t: Any, column: Any, w: Any) -> Any:
    """Value of a law's surface function."""
    touching = 1.0 if w.s[MODE] == TOUCHING else 0.0
    return law_value(
        law, LAW_SURFACE, y, v, t, w.work[WORK_COLUMNS * law + column], w.s[GAP], touching, w
    )


@inner(forceinline=True)
def passed(y: Any, v: Any, t: Any, column: Any, known: Any, flow: Any, w: Any) -> Any:
    """An event other than `known` that lies behind this point of the trajectory, or NONE."""
    if w.s[MODE] == TOUCHING:
        if known != LEAVE and event_value(LEAVE, y, v, t, column, w) < 0.0:
            unpushed = one_sided(w.q) and w.s[PUSHED] == NEVER
            if not unpushed or reaction(y, v, t, column, w) <= 0.0:
                return LEAVE
    elif known != ONSET and event_value(ONSET, y, v, t, column, w) < 0.0:
        return ONSET
    for k in range(flow.count):
        law = w.acting[k]
        if known == SURFACE + law or w.laws[LAW_COLUMNS * law + LAW_SURFACE] == 0:
            continue
        if event_value(SURFACE + law, y, v, t, column, w) < 0.0:
            return SURFACE + law
    return NONE


@inner()
def begin(w: Any) -> Any:
    """Motion and contact state at t = 0 from the slots: (y, v)."""
    q, s = w.q, w.s
    y, v = q[Y0], q[V0]
    begin_bodies(y, v, w)
    for law in range(w.size):
        w.work[WORK_COLUMNS * law + TURNED] = y
        initial = w.laws[LAW_COLUMNS * law + LAW_INITIAL]
        tell(law, q[initial] if initial >= 0 else 0.0, w)
    s[GAP] = q[G]
    return set_contact(y, v, 0.0, w)


@inner()
def carry_on(jump: Any, faster: Any, w: Any) -> Any:
    """States that are counted from the mass's place stay as they are beside it where it jumps."""
    for law in range(w.size):
        w.work[WORK_COLUMNS * law + TURNED] += jump
    at = row(FRAME, w)
    w.work[at + NOW] += jump
    w.work[at + WORK_COLUMNS + NOW] += faster


@inner()
def set_contact(y: Any, v: Any, t: Any, w: Any) -> Any:
    """What holds where a motion begins, whatever it was before: (y, v)."""
    q, s = w.q, w.s
    s[SLIDING] = np.sign(v)
    s[MODE] = FREE
    if y > s[GAP]:
        s[MODE] = TOUCHING
        added_force = reaction(y, v, t, NOW, w)
        s[PUSHED] = ONCE if added_force > 0.0 else NEVER
        if one_sided(q) and added_force <= -q[ADHESION]:
            s[MODE] = SEPARATED
    set_sides(y, v, t, w)
    if v == 0.0:
        set_sliding(y, t, w)
    if y == s[GAP] and (v > 0.0 or (v == 0.0 and static_force(y, t, NOW, w) > 0.0)):
        y, v = resolve(ONSET, y, v, t, w)
    return y, v


@inner()
def static_force(y: Any, t: Any, column: Any, w: Any) -> Any:
    """What pulls at the mass at rest, dry friction apart, N; the laws' states stand in `column`."""
    q, s = w.q, w.s
    force = forcing(t, w) - q[K1] * y - laws_force(y, 0.0, t, column, False, w)
    force -= body_force(FRAME, y, 0.0, 0.0, column, w)
    if s[MODE] == TOUCHING:
        force -= q[K2] * (y - s[GAP]) + laws_force(y, 0.0, t, column, True, w)
        force -= body_force(OBSTACLE, y, 0.0, s[GAP], column, w)
    return force


@inner()
def point_laws(direction: Any, w: Any) -> Any:
    """Tell the laws whose force jumps at a turning point which way the motion goes; where the
    force jumps at a surface too and the motion is beyond it, nothing acts.
    """
    for law in range(w.size):
        flags = w.laws[LAW_COLUMNS * law + LAW_FLAGS]
        if flags & JUMP_AT_TURN != 0:
            acts = flags & JUMP_AT_SURFACE == 0 or w.s[SIDES + law] > 0.0
            tell(law, direction if acts else 0.0, w)


@inner()
def turn_paths(direction: Any, y: Any, w: Any) -> Any:
    """States that follow the path go on from here in another direction; at rest they stay."""
    for law in range(w.size):
        travel, at = w.laws[LAW_COLUMNS * law + LAW_TRAVEL], WORK_COLUMNS * law
        if travel != 0 and direction != 0.0 and w.work[at + WAY] != direction:
            p, gone = w.base + 8 * w.laws[LAW_COLUMNS * law + LAW_FIRST], y - w.work[at + TURNED]
            way, z = w.work[at + WAY], w.work[at + NOW]
            touching = 1.0 if w.s[MODE] == TOUCHING else 0.0
            z = call_law(travel, gone, way, y - w.s[GAP], 0.0, z, touching, p, w.base)
            tell(law, z, w)
            w.work[at + TURNED], w.work[at + WAY] = y, direction


@inner()
def tell(law: Any, branch: Any, w: Any) -> Any:
    """Set the state of a law that has no rate: the branch of its force that holds now."""
    at = WORK_COLUMNS * law
    w.work[at + NOW] = w.work[at + STAGE] = w.work[at + AHEAD] = branch


@inner()
def set_side(law: Any, side: Any, w: Any) -> Any:
    """Side of a law's surface; a law whose force jumps there is told."""
    w.s[SIDES + law] = side
    if w.laws[LAW_COLUMNS * law + LAW_FLAGS] & JUMP_AT_SURFACE != 0:
        tell(law, side, w)


@inner()
def set_directions(y: Any, v: Any, t: Any, w: Any) -> Any:
    """The same for the motion that begins here; from rest, where everything else pulls."""
    direction = np.sign(v)
    if v == 0.0:
        point_laws(0.0, w)
        direction = w.s[SLIDING] if w.q[FRICTION] > 0.0 else np.sign(static_force(y, t, NOW, w))
    point_laws(direction, w)
    turn_paths(direction, y, w)


@inner()
def holding_force(y: Any, t: Any, w: Any) -> Any:
    """Force up to which the mass is held at rest, N: dry friction, and laws that jump there."""
    if w.q[FRICTION] == 0.0:
        return 0.0
    point_laws(0.0, w)
    free = static_force(y, t, NOW, w)
    point_laws(1.0, w)
    jump = abs(free - static_force(y, t, NOW, w))
    point_laws(0.0, w)
    return w.q[FRICTION] + jump


@inner()
def set_sliding(y: Any, t: Any, w: Any) -> Any:
    """Direction of sliding from a standstill: 0 where dry friction holds the mass."""
    most = holding_force(y, t, w)
    force = static_force(y, t, NOW, w)
    w.s[SLIDING] = np.sign(force) if abs(force) > most else 0.0


@inner()
def set_sides(y: Any, v: Any, t: Any, w: Any) -> Any:
    """Side of every law's surface that the motion is on."""
    for law in range(w.size):
        if w.laws[LAW_COLUMNS * law + LAW_SURFACE] != 0:
            side = np.sign(surface_value(law, y, v, t, NOW, w))
            set_side(law, side if side != 0.0 else 1.0, w)


@inner()
def resolve(event: Any, y: Any, v: Any, t: Any, w: Any) -> Any:
    """Change what holds between events; returns displacement and velocity after the event."""
    q, s = w.q, w.s
    if event == ONSET:
        if s[MODE] == FREE:
            y, before = s[GAP], v
            mass = w.mass * (1.0 - share_of_frame(w))
            v *= q[RESTITUTION] * mass / (mass + q[CONTACT_MASS])
            s[SECOND_P] += q[SECOND_GAIN] * mass * (before - v)
        s[MODE] = TOUCHING
        s[PUSHED] = ONCE if reaction(y, v, t, NOW, w) > 0.0 else NEVER
        set_sides(y, v, t, w)
    elif event == LEAVE:
        if not (one_sided(q) and s[PUSHED] != NEVER):
            y = s[GAP]
        s[GAP] += q[GAP_STEP]
        s[MODE] = SEPARATED if y > s[GAP] else FREE
        set_sides(y, v, t, w)
    elif event == TURN:
        v = 0.0
        if q[FRICTION] > 0.0:
            set_sliding(y, t, w)
    else:
        set_side(event - SURFACE, -s[SIDES + event - SURFACE], w)
    return y, v


@inner(forceinline=True)
def heading(v: Any, w: Any) -> Any:
    """Direction of the motion at the start of a step, 0 where it is about to be chosen."""
    if v != 0.0:
        return 1.0 if v > 0.0 else -1.0
    return w.s[SLIDING] if w.q[FRICTION] > 0.0 else 0.0


@inner(forceinline=True)
def update_contact(y: Any, v: Any, t: Any, w: Any) -> Any:
    """What changes without a change of force: the obstacle has pushed; the mass fell back."""
    s = w.s
    if s[MODE] == SEPARATED and y < s[GAP]:
        s[MODE] = FREE
    if s[MODE] == TOUCHING and s[PUSHED] != ONCE and one_sided(w.q):
        s[PUSHED] = ONCE if reaction(y, v, t, NOW, w) > 0.0 else NEVER
