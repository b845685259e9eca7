"""Steps where the motion turns under a force that is not smooth there, and where it creeps.

Under a root of the speed a mass that has no more inertia creeps home: its speed settles so fast
that steps of an explicit method would have to be thousands of times shorter than the motion needs.
There the damping of the laws at that speed is counted into the linear flow, anew for every step, as
exponential Rosenbrock methods do (Hochbruck and Ostermann 2010, Acta Numerica 19:209).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from bayesimpact.model.general.contact_state import GAP, MODE, TOUCHING
from bayesimpact.model.general.context import NOW, WORK_COLUMNS, law_value
from bayesimpact.model.general.step import added_force
from bayesimpact.model.jit.compiled import inner
from bayesimpact.model.law_table import LAW_COLUMNS, LAW_FORCE, LAW_TURN

# where a force is not smooth at a turning point, for times in units of the longest step: step over
# the 3/4th power of the time since then, or until then; not much longer than the time itself
SINCE_TURN, UNTIL_TURN, MOST_SINCE, MOST_UNTIL = 0.8, 0.46, 1.0, 0.5
# a mass that creeps under a root of its speed: longest step times the rate at which its speed
# settles, by the difference of the force over that share of the speed (of a mass nearly AT_REST,
# m/s, over that). Beyond it that damping is counted into the flow, anew for every step
STIFF, NEARBY, AT_REST = 1.5, 1.0 / 16.0, 1e-11


@inner()
def sum_of_laws(y: Any, v: Any, t: Any, count: Any, rooted: Any, w: Any) -> Any:
    """Force of the laws that act, or of those that are not smooth where the motion turns, N."""
    total, touching = 0.0, 1.0 if w.s[MODE] == TOUCHING else 0.0
    for k in range(count):
        law = w.acting[k]
        if not rooted or w.laws[LAW_COLUMNS * law + LAW_TURN] != 0:
            z = w.work[WORK_COLUMNS * law + NOW]
            total += law_value(law, LAW_FORCE, y, v, t, z, w.s[GAP], touching, w)
    return total


@inner(forceinline=True)
def small_change(v: Any) -> Any:
    """Of a speed, for a difference of forces, m/s."""
    return NEARBY * v if abs(v) > AT_REST else AT_REST


@inner()
def rooted_damping(y: Any, v: Any, t: Any, count: Any, w: Any) -> Any:
    """Damping at this speed of the laws that are not smooth where the motion turns, N s/m; 0 where
    they drive the motion.
    """
    change = small_change(v)
    faster = sum_of_laws(y, v + change, t, count, True, w)
    return max(0.0, (faster - sum_of_laws(y, v, t, count, True, w)) / change)


@inner(forceinline=True)
def graded(v: Any, pull: Any, longest: Any, first_at_turn: Any) -> Any:
    """Longest step near a turning point at which a force is not smooth.

    `pull` is minus the acceleration: v / pull is the time since the turning point, or minus that to
    the next.
    """
    if pull == 0.0:
        return longest
    away = abs(v / (pull * longest))
    root = np.sqrt(away)
    share, most = (SINCE_TURN, MOST_SINCE) if v * pull < 0.0 else (UNTIL_TURN, MOST_UNTIL)
    return longest * min(1.0, max(first_at_turn, min(share * root * np.sqrt(root), most * away)))


@inner(forceinline=True)
def settling_rate(y: Any, v: Any, t: Any, n0: Any, flow: Any, w: Any) -> Any:
    """Rate at which the forces that the flow leaves out make the speed settle, or drive it, 1/s; 0
    where the flow has their damping.
    """
    if flow.first_at_turn >= 1.0 or flow.placed or flow.drag > 0.0:
        return 0.0
    change = small_change(v)
    return abs(flow.inverse * (n0 - added_force(y, v + change, t, NOW, flow, w)) / change)


@inner(forceinline=True)
def is_outdated(rate: Any, y: Any, v: Any, n0: Any, longest: Any, flow: Any) -> Any:
    """Whether a step has ended of a flow with the damping of a speed, or a mass creeps that its
    flow lets swing.

    What is left out of a flow that settles faster than a step lasts has to be nothing: of a force
    that stays, the method would make many times what it does. At the speed that a flow is chosen
    for it is.
    """
    if not flow.linearizes or flow.drag > 0.0:
        return flow.linearizes
    return (
        rate * longest > STIFF
        and rate * graded(v, pull_at(y, v, n0, flow), longest, flow.first_at_turn) > 2.0 * STIFF
    )


@inner(forceinline=True)
def pull_at(y: Any, v: Any, n0: Any, flow: Any) -> Any:
    """Minus the acceleration, m/s2; n0 is `added_force`."""
    return 2.0 * flow.b * v + flow.K * (y - flow.rest) - flow.inverse * n0
