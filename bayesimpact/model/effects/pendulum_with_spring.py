"""A pendulum with a spring beside gravity: a part of k1 restores with the sine of the angle.

Equation: K (sin y - y), y in rad, K in N m/rad: the share of gravity in k1, the rest is a spring.
At its null: K = 0 is the base model, K = k1 is pendulum_sine, which is simpler and preferred.
Energy: conserves; potential K (1 - cos y - y^2 / 2).
Valid: recordings of an angle; a clock's suspension spring, an elastic cable, a balanced arm
(K below k1), an inverted pendulum held up by a spring (K below zero is not offered).
Its absence shows as that of pendulum_sine does, but weaker.
Source: Nayfeh and Mook 1979, Nonlinear Oscillations, chapter 2; Baker and Blackburn 2005, The
Pendulum, chapter 3.
Status: energy conserved to rounding; compiled law against two independent integrators.
"""

from __future__ import annotations

import math

from bayesimpact.model.effects.effect import Effect, EffectParameter, Law, Numbers
from bayesimpact.model.effects.pendulum_sine import feature_length


def force(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """What gravity's sine adds to a torque of K y, N m."""
    return p[0] * (math.sin(y) - y)


EFFECT = Effect(
    id="pendulum_with_spring",
    family="free stiffness",
    title="gravity pendulum with a spring",
    equation="K (sin y - y)",
    regime="free",
    energy="conserves",
    statement=(
        "A part of the restoring torque is gravity's and follows the sine of the angle; it falls "
        "short of a linear one by up to {size} ({share} of the peak elastic force)."
    ),
    parameters=(EffectParameter("stiffness", "N/m", scale=lambda s: s.stiffness, lower=0.0),),
    law=Law(force, feature_length=feature_length, polynomial=True, ignores_speed=True),
    prefer="pendulum_sine",
    condition=lambda s: s.angle,
)
