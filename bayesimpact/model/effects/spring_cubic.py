"""A suspension that hardens or softens with amplitude: force with the cube of the displacement.

Equation: k3 y^3, k3 in N/m3 (for angles N m/rad3).
At its null: k3 = 0 is the base model.
Energy: conserves; potential k3 y^4 / 4.
Valid: moderate amplitudes; k3 > 0 for springs that stretch, k3 < 0 for a pendulum (k3 / k1 = -1/6
per rad2).
Its absence shows as a frequency that depends on amplitude: dw / w = 3 k3 a^2 / (8 k1).
Source: Duffing 1918; Nayfeh and Mook 1979, Nonlinear Oscillations, chapter 2.
Status: shift of the frequency checked against the closed form, energy conserved to rounding;
compiled law against two independent integrators.
"""

from __future__ import annotations

from bayesimpact.model.effects.effect import Effect, EffectParameter, Law, Numbers


def force(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Elastic force k3 y^3, N."""
    return p[0] * y * y * y


EFFECT = Effect(
    id="spring_cubic",
    family="free stiffness",
    title="cubic stiffness of the suspension",
    equation="k3 y^3",
    regime="free",
    energy="conserves",
    statement=(
        "The suspension's stiffness changes with the square of the displacement; the cubic force "
        "reaches {size} ({share} of the peak elastic force)."
    ),
    parameters=(
        EffectParameter("stiffness", "N/m3", scale=lambda s: 0.05 * s.stiffness / s.amplitude**2),
    ),
    law=Law(force, polynomial=True, ignores_speed=True),
)
