"""A suspension whose stiffness changes with the fourth power of the displacement.

Equation: k5 y^5, k5 in N/m5 (for angles N m/rad5).
At its null: k5 = 0 is the base model.
Energy: conserves; potential k5 y^6 / 6.
Valid: the next term beyond spring_cubic of a symmetric spring, or the first of one whose cubic
term vanishes (magnetic springs, buckled guides); for k5 < 0 the amplitude must stay below
(k1 / -k5)^(1/4).
Its absence shows as a frequency that hardly changes at small amplitude and strongly at large:
dw / w = 5 k5 a^4 / (16 k1), while a cubic spring's grows with a^2.
Source: Nayfeh and Mook 1979, Nonlinear Oscillations, chapter 2; Kovacic and Brennan 2011, The
Duffing Equation, chapter 2.
Status: shift of the frequency checked against the harmonic balance, period against quadrature;
compiled law against two independent integrators.
"""

from __future__ import annotations

import math

from bayesimpact.model.effects.effect import Effect, EffectParameter, Law, Numbers


def force(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Elastic force k5 y^5, N."""
    square = y * y
    return p[0] * square * square * y


def feature_length(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """A share of the displacement at which the quintic force is as large as the linear one, m."""
    return 0.06 * math.sqrt(math.sqrt(q[1] / max(abs(p[0]), 1e-300)))


EFFECT = Effect(
    id="spring_quintic",
    family="free stiffness",
    title="quintic stiffness of the suspension",
    equation="k5 y^5",
    regime="free",
    energy="conserves",
    statement=(
        "The suspension's stiffness changes with the fourth power of the displacement; the quintic "
        "force reaches {size} ({share} of the peak elastic force)."
    ),
    parameters=(
        EffectParameter("stiffness", "N/m5", scale=lambda s: 0.05 * s.stiffness / s.amplitude**4),
    ),
    law=Law(force, feature_length=feature_length, polynomial=True, ignores_speed=True),
)
