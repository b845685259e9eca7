"""Laws with a state of their own, z' = rate(y, v, z).

With the linear part alpha v - lambda z of the rate, z = zeta + x_u (y - rest) + x_v v, where zeta
decays exactly and is only driven by what is left. So a relaxation time far below the step is no
difficulty: z then follows v, like a dashpot.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from bayesimpact.model.general.context import (
    AHEAD,
    ALPHA,
    FADE,
    LAMBDA,
    NOW,
    STATE_RATE,
    WORK_COLUMNS,
    X_U,
    X_V,
    law_value,
)
from bayesimpact.model.general.method import stage
from bayesimpact.model.general.resonator import (
    begin_step,
    body_rates,
    keep_bodies,
    relax_bodies,
    remember_bodies,
)
from bayesimpact.model.jit.compiled import inner
from bayesimpact.model.law_table import LAW_COLUMNS, LAW_RATE


@inner()
def split_memory(y: Any, v: Any, t: Any, flow: Any, w: Any) -> Any:
    """Linear part of the rates of the laws' states, by differences; returns the largest lambda."""
    work, gap, touching, fastest = w.work, flow.gap, flow.touching, 0.0
    for law in range(w.size):
        if w.laws[LAW_COLUMNS * law + LAW_RATE] == 0:
            continue
        at = WORK_COLUMNS * law
        z = work[at + NOW]
        more = law_value(law, LAW_RATE, y, v, t, z + 1.0, gap, touching, w)
        less = law_value(law, LAW_RATE, y, v, t, z - 1.0, gap, touching, w)
        decay = max(0.5 * (less - more), 0.0)
        more = law_value(law, LAW_RATE, y, v + 1.0, t, z, gap, touching, w)
        less = law_value(law, LAW_RATE, y, v - 1.0, t, z, gap, touching, w)
        alpha = 0.5 * (more - less)
        scale = flow.K + decay * (decay - 2.0 * flow.b)
        if not scale > 1e-3 * (flow.K + decay * decay):  # lambda is a rate of the flow itself
            alpha, scale = 0.0, 1.0
        work[at + LAMBDA], work[at + ALPHA] = decay, alpha
        work[at + X_U], work[at + X_V] = alpha * flow.K / scale, alpha * decay / scale
        fastest = max(fastest, decay)
    return fastest


@inner()
def begin_memory(y: Any, v: Any, t: Any, n: Any, h: Any, flow: Any, w: Any) -> Any:
    """Decay over a quarter of a step of length h, and the rates at its start."""
    for law in range(w.size):
        at = WORK_COLUMNS * law
        w.work[at + FADE] = np.exp(-0.25 * h * w.work[at + LAMBDA])
    begin_step(h, w)
    state_rate(0, y, v, t, NOW, n, flow, w)


@inner()
def state_rate(number: Any, y: Any, v: Any, t: Any, column: Any, n: Any, flow: Any, w: Any) -> Any:
    """What moves zeta at a stage beside its decay; n is `added_force` there."""
    work = w.work
    for law in range(w.size):
        if w.laws[LAW_COLUMNS * law + LAW_RATE] != 0:
            at = WORK_COLUMNS * law
            z = work[at + column]
            rate = law_value(law, LAW_RATE, y, v, t, z, flow.gap, flow.touching, w)
            linear = work[at + ALPHA] * v - work[at + LAMBDA] * z
            work[at + STATE_RATE + number] = rate - linear - work[at + X_V] * n * flow.inverse
    body_rates(number, y, v, flow, w)


@inner()
def remember(
    number: Any, column: Any, y: Any, v: Any, ys: Any, vs: Any, h: Any, flow: Any, w: Any
) -> Any:
    """The laws' states at a stage (ys, vs) of a step of length h from (y, v), into `column`."""
    work = w.work
    for law in range(w.size):
        if w.laws[LAW_COLUMNS * law + LAW_RATE] != 0:
            at = WORK_COLUMNS * law
            e1, x_u, x_v, k = work[at + FADE], work[at + X_U], work[at + X_V], at + STATE_RATE
            e2 = e1 * e1
            e3, e4 = e2 * e1, e2 * e2
            decay = e1 if number <= 2 else (e2 if number == 3 else (e3 if number == 4 else e4))
            zeta = work[at + NOW] - x_u * (y - flow.rest) - x_v * v
            work[at + column] = stage(
                number, decay * zeta + x_u * (ys - flow.rest) + x_v * vs,
                h, h * e1, h * e2, h * e3, h * e4,
                work[k], work[k + 1], work[k + 2], work[k + 3], work[k + 4], work[k + 5],
            )  # fmt: skip
    remember_bodies(number, column, h, w)


@inner(forceinline=True)
def keep_memory(w: Any) -> Any:
    """Take the laws' states at the end of a step as those at the start of the next."""
    for law in range(w.size):
        if w.laws[LAW_COLUMNS * law + LAW_RATE] != 0:
            w.work[WORK_COLUMNS * law + NOW] = w.work[WORK_COLUMNS * law + AHEAD]
    keep_bodies(w)


@inner()
def relax(y: Any, v: Any, t: Any, dt: Any, flow: Any, w: Any) -> Any:
    """The laws' states after a flight of dt in which none of them acts."""
    for law in range(w.size):
        relax_one(law, NOW, y, v, t, dt, flow, w)
    relax_bodies(NOW, y, dt, flow.touching == 1.0, flow.gap, w)


@inner(forceinline=True)
def relax_one(law: Any, column: Any, y: Any, v: Any, t: Any, dt: Any, flow: Any, w: Any) -> Any:
    """State of a law, into `column`, after a time in which only itself changes its rate."""
    if w.laws[LAW_COLUMNS * law + LAW_RATE] != 0:
        z, gap, touching = w.work[WORK_COLUMNS * law + NOW], flow.gap, flow.touching
        rate = law_value(law, LAW_RATE, y, v, t, z, gap, touching, w)
        decay = rate - law_value(law, LAW_RATE, y, v, t, z + 1.0, gap, touching, w)
        time = -np.expm1(-decay * dt) / decay if decay > 0.0 else dt
        w.work[WORK_COLUMNS * law + column] = z + rate * time
