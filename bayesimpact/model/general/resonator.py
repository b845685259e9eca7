"""Modes that move with the mass and act back on it: one of the obstacle, one of the frame.

Each is a body of mass m2 on a spring and a damper whose other end follows a point P:

    x'' = W (P - x) + 2 beta (P' - x')      force on the mass: m2 W (P - x) + 2 m2 beta (P' - x')

The obstacle's (`OBSTACLE`) P is the indentation in contact and rests in flight; its force is part
of the obstacle's. The frame's (`FRAME`): with X the displacement of a frame of mass m / r, and y
counted from the frame, m (y'' + X'') + N = 0 and X'' + 2 z w X' + w^2 X = r N / m give

    m (1 - n) y'' + N + [force of a body of mass n m that follows y] = 0,     n = r / (1 + r)

with W = w^2 (1 - n), 2 beta = 2 z w (1 - n), X = n (x - y). What follows y and y' of the force is
counted into the linear flow; x itself decays and turns exactly, and takes impulses of P (as a
law's state in `memory`: Lawson 1967).
"""

from __future__ import annotations

import math
from typing import Any

from bayesimpact.model.exact.flow import impulse_response
from bayesimpact.model.general.context import (
    AHEAD,
    FADE,
    FRAME_DAMPING,
    FRAME_FREQUENCY,
    FRAME_RATIO,
    NOW,
    OBSTACLE_DAMPING,
    OBSTACLE_FREQUENCY,
    OBSTACLE_MASS,
    STAGE,
    STATE_RATE,
    WORK_COLUMNS,
)
from bayesimpact.model.general.method import stage
from bayesimpact.model.jit.compiled import inner

OBSTACLE, FRAME, BODIES = range(3)
ROWS = 2 * BODIES  # of the work array, after those of the laws: x and x' of each body


@inner(forceinline=True)
def share_of_frame(w: Any) -> Any:
    """Share n of the mass that moves as a body of its own because the frame does."""
    return w.q[FRAME_RATIO] / (1.0 + w.q[FRAME_RATIO])


@inner(forceinline=True)
def body(which: Any, w: Any) -> Any:
    """(m2, W, 2 beta) of a body; m2 = 0 where there is none."""
    q = w.q
    if which == OBSTACLE:
        omega = 6.283185307179586 * q[OBSTACLE_FREQUENCY]
        return q[OBSTACLE_MASS], omega * omega, 2.0 * q[OBSTACLE_DAMPING] * omega
    share, omega = share_of_frame(w), 6.283185307179586 * q[FRAME_FREQUENCY]
    rest = 1.0 - share
    return share * w.mass, rest * omega * omega, 2.0 * rest * q[FRAME_DAMPING] * omega


@inner(forceinline=True)
def acts(which: Any, touching: Any, w: Any) -> Any:
    """True when a body is there and follows the mass in the present kind of motion."""
    if which == OBSTACLE:
        return touching and w.q[OBSTACLE_MASS] != 0.0
    return w.q[FRAME_RATIO] != 0.0


@inner(forceinline=True)
def row(which: Any, w: Any) -> Any:
    """Where a body's displacement begins in the work array; its velocity follows."""
    return WORK_COLUMNS * (w.size + 2 * which)


@inner(forceinline=True)
def own_force(which: Any, column: Any, w: Any) -> Any:
    """What a body's own displacement and velocity exert as a force, N."""
    m2, W, drag = body(which, w)
    at = row(which, w)
    return m2 * (W * w.work[at + column] + drag * w.work[at + WORK_COLUMNS + column])


@inner()
def bodies_force(column: Any, touching: Any, w: Any) -> Any:
    """Sum of `own_force` over the bodies that act."""
    total = 0.0
    for which in range(BODIES):
        if acts(which, touching, w):
            total += own_force(which, column, w)
    return total


@inner()
def body_force(which: Any, y: Any, v: Any, gap: Any, column: Any, w: Any) -> Any:
    """Force of a body on the mass, on the left-hand side, N."""
    if not acts(which, True, w):
        return 0.0
    m2, W, drag = body(which, w)
    place = y - gap if which == OBSTACLE else y
    return m2 * (W * place + drag * v) - own_force(which, column, w)


@inner()
def begin_bodies(y: Any, v: Any, w: Any) -> Any:
    """At t = 0 the obstacle's body rests; the frame rests as well, so that its body moves as y."""
    at = row(FRAME, w)
    w.work[at + NOW], w.work[at + WORK_COLUMNS + NOW] = y, v


@inner()
def begin_step(h: Any, w: Any) -> Any:
    """Keep the impulse responses after one to four quarters of a step of length h."""
    for which in range(BODIES):
        m2, W, drag = body(which, w)
        if m2 == 0.0:
            continue
        at = row(which, w) + FADE
        for k in range(4):
            M, N = impulse_response(0.5 * drag, W, 0.25 * (k + 1) * h)
            w.work[at + k], w.work[at + WORK_COLUMNS + k] = M, N


@inner()
def body_rates(number: Any, y: Any, v: Any, flow: Any, w: Any) -> Any:
    """What P contributes to x'' at a stage."""
    for which in range(BODIES):
        m2, W, drag = body(which, w)
        if m2 == 0.0:
            continue
        follows = acts(which, flow.touching == 1.0, w)
        place = y - flow.gap if which == OBSTACLE else y
        w.work[row(which, w) + STATE_RATE + number] = (W * place + drag * v) if follows else 0.0


@inner()
def remember_bodies(number: Any, column: Any, h: Any, w: Any) -> Any:
    """Displacement and velocity of the bodies at a stage of a step of length h, into `column`."""
    work = w.work
    for which in range(BODIES):
        m2, W, drag = body(which, w)
        if m2 == 0.0:
            continue
        at = row(which, w)
        speed = at + WORK_COLUMNS
        quarter = 1 if number <= 2 else min(number - 1, 4)
        M, N = work[at + FADE + quarter - 1], work[speed + FADE + quarter - 1]
        x, rate, k, f, g = (
            work[at + NOW],
            work[speed + NOW],
            at + STATE_RATE,
            at + FADE,
            speed + FADE,
        )
        work[at + column] = stage(
            number, N * x + M * (rate + drag * x), 0.0,
            h * work[f], h * work[f + 1], h * work[f + 2], h * work[f + 3],
            work[k], work[k + 1], work[k + 2], work[k + 3], work[k + 4], work[k + 5],
        )  # fmt: skip
        work[speed + column] = stage(
            number, N * rate - W * M * x, h,
            h * work[g], h * work[g + 1], h * work[g + 2], h * work[g + 3],
            work[k], work[k + 1], work[k + 2], work[k + 3], work[k + 4], work[k + 5],
        )  # fmt: skip


@inner()
def keep_bodies(w: Any) -> Any:
    """Take the state at the end of a step as that at the start of the next."""
    for which in range(BODIES):
        at = row(which, w)
        w.work[at + NOW] = w.work[at + AHEAD]
        w.work[at + WORK_COLUMNS + NOW] = w.work[at + WORK_COLUMNS + AHEAD]


@inner()
def relax_bodies(column: Any, y: Any, dt: Any, touching: Any, gap: Any, w: Any) -> Any:
    """State, into `column`, after a time in which P stands still: in flight, or held by friction.

    In flight without a body of the frame y does not matter.
    """
    for which in range(BODIES):
        m2, W, drag = body(which, w)
        if m2 == 0.0:
            continue
        place = 0.0
        if acts(which, touching, w):
            place = y - gap if which == OBSTACLE else y
        at = row(which, w)
        M, N = impulse_response(0.5 * drag, W, dt)
        x, rate = w.work[at + NOW] - place, w.work[at + WORK_COLUMNS + NOW]
        w.work[at + column] = place + N * x + M * (rate + drag * x)
        w.work[at + WORK_COLUMNS + column] = N * rate - W * M * x


@inner()
def shift_bodies(y: Any, v: Any, column: Any, short: Any, flow: Any, w: Any) -> Any:
    """State, into STAGE, a short time after (or before) that in `column`; the mass is at y."""
    for which in range(BODIES):
        m2, W, drag = body(which, w)
        if m2 == 0.0:
            continue
        at = row(which, w)
        x, rate = w.work[at + column], w.work[at + WORK_COLUMNS + column]
        pull = W * x + drag * rate
        if acts(which, flow.touching == 1.0, w):
            pull -= W * (y - flow.gap if which == OBSTACLE else y) + drag * v
        w.work[at + STAGE] = x + short * rate
        w.work[at + WORK_COLUMNS + STAGE] = rate - short * pull


@inner()
def fastest_body(touching: Any, w: Any) -> Any:
    """Rate of the fastest body that acts, rad/s; 0 when none does."""
    fastest = 0.0
    for which in range(BODIES):
        if acts(which, touching, w):
            _, W, drag = body(which, w)
            fastest = max(fastest, math.sqrt(W) + 0.5 * drag)
    return fastest
