"""One step of the oscillator with added effects: exact linear flow, added forces by a Lawson Runge-Kutta method.

Within a step the linear part (mass, damping, stiffness, obstacle, dry friction) is propagated exactly; only
the added forces are integrated numerically, with the classical fourth-order method in the variables that
the exact flow carries along (Lawson 1967, "Generalized Runge-Kutta processes for stable systems with large
Lipschitz constants", SIAM J. Numer. Anal. 4:372). The error is therefore proportional to the added force:
an effect too small to see costs no accuracy.

Common arguments: `flow` = (mass kg, damping N s/m, stiffness N/m, equilibrium m) of the linear part; `half` =
its propagator over half the step; `scene` = (q, address of q, laws, work, gap, touching), where row MEMORY
of `work` holds the laws' own states at the start of a step and row AHEAD those at its end.
"""

from __future__ import annotations

import numpy as np

from bayesimpact.model.callback import call_law
from bayesimpact.model.compiled import compiled

# slots of q: bayesimpact.model.parameters.SLOTS
C1, K1, C2, G, K2, Y0, V0, FORCE, OMEGA, PHASE, OFFSET = range(11)
FRICTION, CONTACT_MASS, NO_TENSION, GAP_STEP = range(11, 15)
# columns of the table of laws
LAW_FORCE, LAW_RATE, LAW_SURFACE, LAW_CONTACT_ONLY, LAW_FIRST = range(5)
# rows of the work array: states of the laws, four rates, stage or result
MEMORY, RATE, AHEAD, WORK_ROWS = 0, 1, 5, 6


@compiled(forceinline=True)
def propagator(h, mass, damping, stiffness):
    """Matrix (a, b, c, e) of u' = v, mass v' = -damping v - stiffness u over a time h."""
    b = 0.5 * damping / mass
    w2 = stiffness / mass - b * b
    decay = np.exp(-b * h)
    x = w2 * h * h
    if abs(x) < 0.04:  # series: short steps and near-critical damping
        cosine = 1.0 - x / 2.0 * (
            1.0 - x / 12.0 * (1.0 - x / 30.0 * (1.0 - x / 56.0 * (1.0 - x / 90.0)))
        )
        sine = h * (
            1.0
            - x / 6.0 * (1.0 - x / 20.0 * (1.0 - x / 42.0 * (1.0 - x / 72.0 * (1.0 - x / 110.0))))
        )
    elif x > 0.0:
        w = np.sqrt(w2)
        cosine, sine = np.cos(w * h), np.sin(w * h) / w
    else:
        w = np.sqrt(-w2)
        cosine, sine = np.cosh(w * h), np.sinh(w * h) / w
    return (
        decay * (cosine + b * sine),
        decay * sine,
        -decay * stiffness / mass * sine,
        decay * (cosine - b * sine),
    )


@compiled(forceinline=True)
def laws_force(y, v, t, row, scene, contact_only):
    """Sum of the laws' forces, N; `contact_only` leaves out those that act everywhere."""
    _, base, laws, work, gap, touching = scene
    flag = 1.0 if touching else 0.0
    total = 0.0
    for i in range(laws.shape[0]):
        here = laws[i, LAW_CONTACT_ONLY] == 1
        if (here and touching) or not (here or contact_only):
            p = base + 8 * laws[i, LAW_FIRST]
            total += call_law(laws[i, LAW_FORCE], y, v, y - gap, t, work[row, i], flag, p, base)
    return total


@compiled(forceinline=True)
def push(y, v, t, row, scene):
    """Everything that the linear flow leaves out, N."""
    q = scene[0]
    force = -laws_force(y, v, t, row, scene, False)
    if q[FORCE] != 0.0:
        force += q[FORCE] * np.sin(q[OMEGA] * t + q[PHASE])
    return force


@compiled(forceinline=True)
def remember(y, v, t, row, stage, h, scene):
    """Rates of the laws' own states into row RATE + stage; the next stage's states, a time h on, into AHEAD."""
    _, base, laws, work, gap, touching = scene
    flag = 1.0 if touching else 0.0
    for i in range(laws.shape[0]):
        rate = 0.0
        if laws[i, LAW_RATE] != 0:
            p = base + 8 * laws[i, LAW_FIRST]
            rate = call_law(laws[i, LAW_RATE], y, v, y - gap, t, work[row, i], flag, p, base)
        work[RATE + stage, i] = rate
        work[AHEAD, i] = work[MEMORY, i] + h * rate


@compiled(forceinline=True)
def step(y, v, t, h, flow, half, plain, memory, scene):
    """Displacement and velocity a time h on; the laws' states then stand in row AHEAD of the work array."""
    mass, rest = flow[0], flow[3]
    a, b, c, e = half
    u = y - rest
    um, vm = a * u + b * v, c * u + e * v
    un, vn = a * um + b * vm, c * um + e * vm
    if plain:
        return un + rest, vn
    mid, row = 0.5 * h, AHEAD if memory else MEMORY
    n1 = push(y, v, t, MEMORY, scene) / mass
    if memory:
        remember(y, v, t, MEMORY, 0, mid, scene)
    y2, v2 = um + mid * b * n1 + rest, vm + mid * e * n1
    n2 = push(y2, v2, t + mid, row, scene) / mass
    if memory:
        remember(y2, v2, t + mid, row, 1, mid, scene)
    y3, v3 = um + rest, vm + mid * n2
    n3 = push(y3, v3, t + mid, row, scene) / mass
    if memory:
        remember(y3, v3, t + mid, row, 2, h, scene)
    y4, v4 = un + h * b * n3 + rest, vn + h * e * n3
    n4 = push(y4, v4, t + h, row, scene) / mass
    if memory:
        remember(y4, v4, t + h, row, 3, 0.0, scene)
        work = scene[3]
        for i in range(work.shape[1]):
            slope = (
                work[RATE, i] + 2.0 * (work[RATE + 1, i] + work[RATE + 2, i]) + work[RATE + 3, i]
            )
            work[AHEAD, i] = work[MEMORY, i] + h / 6.0 * slope
    b_full, e_full = a * b + b * e, c * b + e * e
    return (
        un + rest + h / 6.0 * (b_full * n1 + 2.0 * b * (n2 + n3)),
        vn + h / 6.0 * (e_full * n1 + 2.0 * e * (n2 + n3) + n4),
    )
