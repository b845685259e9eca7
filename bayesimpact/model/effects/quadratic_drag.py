"""Quadratic drag: a force against the motion that grows with the square of the speed.

Equation: b |v| v, b in N s2/m2 (for angles N m s2/rad2).
At its null: b = 0 is the base model.
Energy: dissipates for b > 0, power -b |v|^3.
Valid: separated flow at large Reynolds number (plates, hulls with bilge keels); not for creeping
flow.
Its absence shows as damping that grows with amplitude: c_eq = 8 b w a / (3 pi) (harmonic
balance).
Source: Ikeda, Himeno and Tanaka 1978 for ships; Nayfeh and Mook 1979, Nonlinear Oscillations,
chapter 3.
Status: equivalent damping checked against the closed form; compiled law against two independent
integrators.
"""

from __future__ import annotations

from bayesimpact.model.effects.effect import Effect, EffectParameter, Law, Numbers


def force(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Drag b |v| v, N."""
    return p[0] * abs(v) * v


EFFECT = Effect(
    id="quadratic_drag",
    family="free damping",
    title="quadratic drag",
    equation="b |v| v",
    regime="free",
    energy="dissipates",
    statement=(
        "Drag grows with the square of the speed and reaches {size} "
        "({share} of the peak elastic force)."
    ),
    parameters=(
        EffectParameter(
            "coefficient", "N s2/m2", scale=lambda s: 0.5 * s.damping_force / s.speed**2, lower=0.0
        ),
    ),
    law=Law(force, kink_at_turn=True, polynomial=True),
)
