"""A plain pendulum: gravity restores with the sine of the angle, not with the angle.

Equation: k1 sin(y) in place of k1 y, y in rad, k1 in N m/rad (the weight times the distance of the
centre of mass from the axis).
At its null: there is no parameter; as the angle goes to zero it is the base model.
Energy: conserves; potential k1 (1 - cos y) in all.
Valid: recordings of an angle, of a rigid pendulum on which nothing else restores; with a spring
beside gravity it is pendulum_with_spring.
Its absence shows as a frequency that falls with the amplitude, dw / w = -a^2 / 16 at first and
faster beyond a radian; as spring_cubic with k3 = -k1 / 6, as long as the amplitude is small.
Source: Huygens 1673, Horologium Oscillatorium; Nayfeh and Mook 1979, Nonlinear Oscillations,
chapter 2 (period 4 K(sin^2(a / 2)) / w).
Status: period checked against the elliptic integral up to 2.9 rad; compiled law against two
independent integrators.
"""

from __future__ import annotations

import math

from bayesimpact.model.effects.effect import Effect, Law, Numbers, Scales, Size


def force(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """What the sine adds to k1 y, N m; q[1] is k1."""
    return q[1] * (math.sin(y) - y)


def feature_length(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Angle over which a sine is a polynomial of low degree, rad."""
    return 0.06


def size(p: Numbers, s: Scales) -> Size:
    """What the sine lacks of the angle at the largest amplitude."""
    missing = s.amplitude - math.sin(s.amplitude)
    return s.stiffness * missing, "N", missing / s.amplitude


EFFECT = Effect(
    id="pendulum_sine",
    family="free stiffness",
    title="gravity pendulum",
    equation="k1 (sin y - y)",
    regime="free",
    energy="conserves",
    statement=(
        "The restoring torque is that of a pendulum, k1 sin(angle); it falls short of k1 times the "
        "angle by up to {size} ({share} of the peak elastic force)."
    ),
    law=Law(force, feature_length=feature_length, polynomial=True, ignores_speed=True),
    condition=lambda s: s.angle,
    size=size,
)
