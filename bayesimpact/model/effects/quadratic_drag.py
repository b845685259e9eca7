"""Quadratic drag: a force against the motion that grows with the square of the speed.

Equation: b |v| v on the left-hand side, b in N s2/m2 (for angles N m s2/rad2).
At its null: b = 0 is the base model.
Energy: dissipates for b > 0, power -b |v|^3.
Valid: separated flow at large Reynolds number (plates, hulls with bilge keels); not for creeping flow.
Its absence shows as damping that grows with amplitude: c_eq = 8 b w a / (3 pi) (harmonic balance).
Source: Ikeda, Himeno and Tanaka 1978 for ships; harmonic balance in Nayfeh and Mook 1979, section 3.3.
Status: equivalent damping checked against the closed form; compiled law against a naive twin.
"""

from __future__ import annotations

from bayesimpact.model.effects.effect import Effect, EffectParameter, Law


def force(y, v, d, t, z, touching, p, q):
    """Drag b |v| v, N."""
    return p[0] * abs(v) * v


def surface(y, v, d, t, z, touching, p, q):
    """The force has a kink in its slope where the motion turns."""
    return v


EFFECT = Effect(
    id="quadratic_drag",
    family="free damping",
    title="quadratic drag",
    equation="b |v| v",
    regime="free",
    energy="dissipates",
    statement="Drag grows with the square of the speed and reaches {size} ({share} of the peak elastic force).",
    parameters=(
        EffectParameter(
            "coefficient",
            "N s2/m2",
            scale=lambda s: 0.1 * (s.damping + 1e-3 * (s.stiffness * s.mass) ** 0.5) / s.speed,
            lower=0.0,
        ),
    ),
    law=Law(force, surface=surface),
)
