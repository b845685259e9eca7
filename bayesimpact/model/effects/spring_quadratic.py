"""A suspension that is stiffer on one side: force with the square of the displacement.

Equation: kq y^2, kq in N/m2 (for angles N m/rad2).
At its null: kq = 0 is the base model.
Energy: conserves; potential kq y^3 / 3.
Valid: moderate asymmetry (curved or preloaded leaf springs), |kq y| well below k1; of either
sign.
Its absence shows as a cycle whose centre moves by -kq a^2 / (2 k1) with amplitude a, and a second
harmonic.
Source: Nayfeh and Mook 1979, Nonlinear Oscillations, chapter 2.
Status: energy conserved to rounding; compiled law against two independent integrators.
"""

from __future__ import annotations

from bayesimpact.model.effects.effect import Effect, EffectParameter, Law, Numbers


def force(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Elastic force kq y^2, N."""
    return p[0] * y * y


EFFECT = Effect(
    id="spring_quadratic",
    family="free stiffness",
    title="quadratic stiffness of the suspension",
    equation="kq y^2",
    regime="free",
    energy="conserves",
    statement=(
        "The suspension is stiffer on one side than on the other; the quadratic force reaches "
        "{size} ({share} of the peak elastic force)."
    ),
    parameters=(
        EffectParameter("stiffness", "N/m2", scale=lambda s: 0.05 * s.stiffness / s.amplitude),
    ),
    law=Law(force, polynomial=True, ignores_speed=True),
)
