"""What the parts of the general simulator share: arrays of a recording, and calls of its laws."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from bayesimpact.model.jit.callback import call_law
from bayesimpact.model.jit.compiled import inner
from bayesimpact.model.law_table import LAW_COLUMNS, LAW_FIRST, LAW_TRAVEL

# slots of q: bayesimpact.model.parameters.SLOTS
C1, K1, C2, G, K2, Y0, V0, FORCE, OMEGA, PHASE, OFFSET = range(11)
FRICTION, CONTACT_MASS, NO_TENSION, GAP_STEP = range(11, 15)
SECOND_FREQUENCY, SECOND_DAMPING, SECOND_GAIN = range(15, 18)
OBSTACLE_MASS, OBSTACLE_FREQUENCY, OBSTACLE_DAMPING = range(18, 21)
FRAME_RATIO, FRAME_FREQUENCY, FRAME_DAMPING, ADHESION, RESTITUTION = range(21, 26)
# columns of the work array, one row per law and two per body of `resonator`: a law's state at the
# start of a step, at a stage and at the end; the rates of six stages; exp(-lambda h / 4), lambda,
# alpha, x_u, x_v; where the motion last turned, and which way it goes since, for a state that
# follows the path (the state there stands in NOW, STAGE and AHEAD)
NOW, STAGE, AHEAD, STATE_RATE = 0, 1, 2, 3
FADE, LAMBDA, ALPHA, X_U, X_V, TURNED, WAY, WORK_COLUMNS = range(9, 17)


class Context(NamedTuple):
    """What stays the same throughout a recording; arrays as pointers, see `callback.floats_at`."""

    mass: Any  # kg
    interval: Any  # s
    n: Any  # samples
    order: Any  # of the time derivative of the displacement that is written: 0, 1 or 2
    out: Any  # (n,) displacements, m, or m/s, m/s2
    tables: Any  # (2, LONGEST_STRIDE, 2) S and D of flight and of contact, see `dense`
    keys: Any  # (2, 2) b and K for which they hold
    size: Any  # number of laws L
    q: Any  # (Q,) slots, then the laws' parameters
    base: Any  # address of q
    laws: Any  # (L, LAW_COLUMNS)
    acting: Any  # (L,) the laws that act in the present kind of motion come first
    work: Any  # (L + resonator.ROWS, WORK_COLUMNS)
    s: Any  # what holds between events, see `contact_state`
    wave: Any  # (n,) measured input at the samples, N; as `driven.Wave` has it:
    shown: Any  # (n,) what accelerations hold, N
    carried: Any  # (n,) what it adds to readings
    driven: Any  # True when there is one
    peak: Any  # its largest size, N


class Flow(NamedTuple):
    """A linear flow, y'' = -2 b y' - K (y - rest), and what is added to it."""

    inverse: Any  # 1 / moving mass, 1/kg
    b: Any  # 1/s
    K: Any  # 1/s2
    rest: Any  # m
    slope: Any  # stiffness of laws that is counted into K, N/m
    level: Any  # and their force at y = v = 0, counted into rest, N
    drag: Any  # damping of laws that is counted into b, N s/m
    gap: Any  # m
    touching: Any  # 1.0 or 0.0
    count: Any  # number of acting laws
    memory: Any  # True when a law has a state
    plain: Any  # True when nothing is added
    placed: Any  # True when no added force depends on the velocity
    forced: Any  # True when the slots' force acts
    turns: Any  # True when a force has a kink or jump at v = 0
    rough: Any  # True when a force is not smooth at impact
    first_at_turn: Any  # shortest step where the motion turns, over the usual one
    linearizes: Any  # True when the damping of a creeping mass may be counted into b
    bodies: Any  # True when a body of `resonator` acts
    joint: Any  # True when nothing else is added, so that `joint` is exact
    hop: Any  # usual length of its steps, s


@inner(forceinline=True)
def law_value(
    law: Any,
    column: Any,
    y: Any,
    v: Any,
    t: Any,
    z: Any,
    gap: Any,
    touching: Any,
    w: Any,
) -> Any:
    """Value of one of a law's functions; z is its state, or that where the motion last turned."""
    row, p = LAW_COLUMNS * law, w.base + 8 * w.laws[LAW_COLUMNS * law + LAW_FIRST]
    d, travel = y - gap, w.laws[row + LAW_TRAVEL]
    if travel != 0:
        gone, way = y - w.work[WORK_COLUMNS * law + TURNED], w.work[WORK_COLUMNS * law + WAY]
        z = call_law(travel, gone, way, d, t, z, touching, p, w.base)
    return call_law(w.laws[row + column], y, v, d, t, z, touching, p, w.base)


@inner(forceinline=True)
def forcing(t: Any, w: Any) -> Any:
    """The slots' force, N: harmonic, or the measured input, which is linear between samples."""
    q = w.q
    if not w.driven:
        return q[FORCE] * np.sin(q[OMEGA] * t + q[PHASE])
    place = t / w.interval
    i = min(max(int(place), 0), w.n - 2)
    share = place - i
    return q[FORCE] * ((1.0 - share) * w.wave[i] + share * w.wave[i + 1])


@inner(forceinline=True)
def strength(w: Any) -> Any:
    """Largest size of the slots' force, N."""
    return abs(w.q[FORCE]) * (w.peak if w.driven else 1.0)
