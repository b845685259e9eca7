"""One step of the oscillator with added effects.

Within a step the linear part (mass, damping, stiffness, obstacle, dry friction) is propagated
exactly; only the added forces are integrated numerically, see `method`. The error is therefore
proportional to the added force: an effect too small to see costs no accuracy.
"""

from __future__ import annotations

from typing import Any

from bayesimpact.model.general.context import AHEAD, NOW, STAGE, WORK_COLUMNS, forcing, law_value
from bayesimpact.model.general.joint import joint_step
from bayesimpact.model.general.memory import begin_memory, remember, state_rate
from bayesimpact.model.general.method import place_stage, stage
from bayesimpact.model.general.resonator import bodies_force
from bayesimpact.model.jit.compiled import inner
from bayesimpact.model.law_table import LAW_FORCE


@inner(forceinline=True)
def added_force(y: Any, v: Any, t: Any, column: Any, flow: Any, w: Any) -> Any:
    """Force that the linear flow leaves out, N; the laws' states stand in `column`."""
    force = flow.level + flow.slope * y + flow.drag * v
    if flow.count > 0:  # most often there is one: kept out of the loop's chain of dependences
        law = w.acting[0]
        z = w.work[WORK_COLUMNS * law + column]
        force -= law_value(law, LAW_FORCE, y, v, t, z, flow.gap, flow.touching, w)
        for k in range(1, flow.count):
            law = w.acting[k]
            z = w.work[WORK_COLUMNS * law + column]
            force -= law_value(law, LAW_FORCE, y, v, t, z, flow.gap, flow.touching, w)
    if flow.bodies:
        force += bodies_force(column, flow.touching == 1.0, w)
    return force + forcing(t, w) if flow.forced else force


@inner(forceinline=True)
def step(y: Any, v: Any, t: Any, n0: Any, at: Any, flow: Any, w: Any) -> Any:
    """Displacement, velocity and `added_force` a time `at.h` on; laws' states then stand in AHEAD.

    n0 is `added_force` at the start; `at` are the `Quarters` of the step.
    """
    if flow.joint:
        y_end, v_end = joint_step(y, v, at.h, flow, w)
        return y_end, v_end, added_force(y_end, v_end, t + at.h, AHEAD, flow, w)
    u, rest, h = y - flow.rest, flow.rest, at.h
    m, Ku = v + 2.0 * flow.b * u, flow.K * u
    y_end, v_end = rest + at.D4 * u + at.S4 * m, at.D4 * v - at.S4 * Ku
    if flow.plain:
        return y_end, v_end, 0.0
    ya, yb = rest + at.D1 * u + at.S1 * m, rest + at.D2 * u + at.S2 * m
    yc = rest + at.D3 * u + at.S3 * m
    if flow.placed:
        return place_step(ya, yb, yc, y_end, v, v_end, t, n0, at, flow, w)
    F1, F2, F3, F4 = at.F1, at.F2, at.F3, at.F4
    G0, G1, G2, G3, G4 = at.G0, at.G1, at.G2, at.G3, at.G4
    column = STAGE if flow.memory else NOW
    va, vb, vc = at.D1 * v - at.S1 * Ku, at.D2 * v - at.S2 * Ku, at.D3 * v - at.S3 * Ku
    if flow.memory:
        begin_memory(y, v, t, n0, h, flow, w)

    y1 = stage(1, ya, 0.0, F1, F2, F3, F4, n0, 0.0, 0.0, 0.0, 0.0, 0.0)
    v1 = stage(1, va, G0, G1, G2, G3, G4, n0, 0.0, 0.0, 0.0, 0.0, 0.0)
    n1 = stage_force(1, y, v, y1, v1, t + 0.25 * h, column, h, flow, w)
    y2 = stage(2, ya, 0.0, F1, F2, F3, F4, n0, n1, 0.0, 0.0, 0.0, 0.0)
    v2 = stage(2, va, G0, G1, G2, G3, G4, n0, n1, 0.0, 0.0, 0.0, 0.0)
    n2 = stage_force(2, y, v, y2, v2, t + 0.25 * h, column, h, flow, w)
    y3 = stage(3, yb, 0.0, F1, F2, F3, F4, n0, n1, n2, 0.0, 0.0, 0.0)
    v3 = stage(3, vb, G0, G1, G2, G3, G4, n0, n1, n2, 0.0, 0.0, 0.0)
    n3 = stage_force(3, y, v, y3, v3, t + 0.5 * h, column, h, flow, w)
    y4 = stage(4, yc, 0.0, F1, F2, F3, F4, n0, n1, n2, n3, 0.0, 0.0)
    v4 = stage(4, vc, G0, G1, G2, G3, G4, n0, n1, n2, n3, 0.0, 0.0)
    n4 = stage_force(4, y, v, y4, v4, t + 0.75 * h, column, h, flow, w)
    y5 = stage(5, y_end, 0.0, F1, F2, F3, F4, n0, n1, n2, n3, n4, 0.0)
    v5 = stage(5, v_end, G0, G1, G2, G3, G4, n0, n1, n2, n3, n4, 0.0)
    n5 = stage_force(5, y, v, y5, v5, t + h, column, h, flow, w)
    y6 = stage(6, y_end, 0.0, F1, F2, F3, F4, n0, n1, n2, n3, n4, n5)
    v6 = stage(6, v_end, G0, G1, G2, G3, G4, n0, n1, n2, n3, n4, n5)
    if flow.memory:
        remember(6, AHEAD, y, v, y6, v6, h, flow, w)
    return y6, v6, added_force(y6, v6, t + h, AHEAD if flow.memory else NOW, flow, w)


@inner(forceinline=True)
def place_step(
    ya: Any, yb: Any, yc: Any, y_end: Any, v: Any, v_end: Any, t: Any, n0: Any,
    at: Any, flow: Any, w: Any,
) -> Any:  # fmt: skip
    """`step` where no added force depends on the velocity.

    ya, yb, yc, y_end and v_end are what the flow alone gives after one, two, three and four
    quarters.
    """
    F1, F2, F3, F4, h = at.F1, at.F2, at.F3, at.F4, at.h
    y1 = place_stage(1, ya, 0.0, F1, F2, F3, F4, n0, 0.0, 0.0, 0.0, 0.0)
    n1 = added_force(y1, v, t + 0.25 * h, NOW, flow, w)
    y2 = place_stage(2, yb, 0.0, F1, F2, F3, F4, n0, n1, 0.0, 0.0, 0.0)
    n2 = added_force(y2, v, t + 0.5 * h, NOW, flow, w)
    y3 = place_stage(3, yc, 0.0, F1, F2, F3, F4, n0, n1, n2, 0.0, 0.0)
    n3 = added_force(y3, v, t + 0.75 * h, NOW, flow, w)
    y4 = place_stage(4, y_end, 0.0, F1, F2, F3, F4, n0, n1, n2, n3, 0.0)
    n4 = added_force(y4, v, t + h, NOW, flow, w)
    v4 = place_stage(4, v_end, at.G0, at.G1, at.G2, at.G3, at.G4, n0, n1, n2, n3, n4)
    return y4, v4, n4


@inner(forceinline=True)
def stage_force(
    number: Any, y: Any, v: Any, ys: Any, vs: Any, t: Any, column: Any, h: Any, flow: Any, w: Any
) -> Any:
    """`added_force` at a stage (ys, vs) of a step from (y, v), and rates of the laws' states."""
    if flow.memory:
        remember(number, STAGE, y, v, ys, vs, h, flow, w)
    n = added_force(ys, vs, t, column, flow, w)
    if flow.memory:
        state_rate(number, ys, vs, t, STAGE, n, flow, w)
    return n
