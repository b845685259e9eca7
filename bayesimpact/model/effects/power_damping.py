"""Damping by a power of the speed, somewhere between dry, viscous and turbulent, or beyond.

Equation: c |v|^n sign(v); c in N (s/m)^n, which is the force at 1 m/s (for angles at 1 rad/s), n
without unit.
At its null: c = 0 is the base model; n then means nothing. n = 1 is more of c1, n = 2 is
quadratic_drag, which is simpler and preferred, n -> 0 is coulomb_friction but does not stick.
Energy: dissipates, power -c |v|^(n + 1).
Valid: 0.25 < n < 5; n of a half to one for lubricated guides and rubber, 1.5 to 1.75 for flow in
narrow gaps (Blasius), 2 for wakes, 3 for losses in magnets and at large amplitude. Below 0.1 um/s
it is continued as a viscous law. With an exponent below one the motion ends in a creep to rest,
y' = -(k1 y / c)^(1 / n), which slows down so much that the mass seems to hang.
Its absence shows as a damping that changes with amplitude as a^(n - 1): c_eq = c (w a)^(n - 1)
times 2 Gamma(n / 2 + 1) / (sqrt(pi) Gamma(n / 2 + 3 / 2)).
Source: Lazan 1968, Damping of Materials and Members, chapter 2; Elliott, Ghandchi Tehrani and
Langley 2015, Phil. Trans. R. Soc. A 373:20140402.
Status: equivalent damping checked against the closed form for n of 0.5, 1.5 and 3; compiled law
against two independent integrators.
"""

from __future__ import annotations

import numpy as np

from bayesimpact.model.effects.effect import Effect, EffectParameter, Law, Numbers
from bayesimpact.model.power import power

# m/s (rad/s); below it the law is viscous. Then the mass creeps home instead of hanging: a part of
# a micrometre off within a recording, less than probes resolve
SLOW = 1e-7


def force(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Damping force c |v|^n sign(v), N."""
    return float(p[0] * power(v * v + SLOW * SLOW, 0.5 * (p[1] - 1.0)) * v)


def first_at_turn(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Shortest step at a turning point over the usual one: 1 from a square on.

    Up to a line the error of that step, as its length to the power n + 1, is the same for every n.
    """
    return float(min(1.0, power(1e-6, min(1.0, 2.0 - p[1]) / (1.0 + p[1]))))


EFFECT = Effect(
    id="power_damping",
    family="free damping",
    title="damping by a power of the speed",
    equation="c |v|^n sign(v)",
    regime="free",
    energy="dissipates",
    statement=(
        "Damping follows a power of the speed other than one and reaches {size} "
        "({share} of the peak elastic force)."
    ),
    parameters=(
        EffectParameter(
            "coefficient",
            "N at 1 m/s",  # for any exponent; its unit N (s/m)^n would depend on n
            # between the linear law's and the quadratic one's
            scale=lambda s: 0.5 * s.damping_force / s.speed**1.5,
            lower=0.0,
        ),
        EffectParameter(
            "exponent",
            "-",
            scale=lambda s: 1.5,
            lower=0.25,
            upper=5.0,
            null=None,
            in_base=1.0,
            # next to 0, 1 and 2 stand dry friction, c1 and quadratic drag
            grid=lambda s: np.array([0.3, 0.5, 0.7, 1.5, 2.5, 3.0, 4.0]),
        ),
    ),
    law=Law(force, kink_at_turn=True, first_at_turn=first_at_turn),
    prefer="quadratic_drag",
)
