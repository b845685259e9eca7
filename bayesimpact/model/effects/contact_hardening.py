"""An obstacle that stiffens (or softens) with the cube of the indentation.

Equation: k3 d^3 in contact, d = y - g, k3 in N/m3 (for angles N m/rad3).
At its null: k3 = 0 is the base model.
Energy: conserves; potential k3 d^4 / 4.
Valid: beams and plates at moderate deflection (stretching), k3 of either sign; not when the
contact area grows.
Its absence shows as contacts that are too long for deep impacts and right for shallow ones (k3 >
0).
Source: Duffing 1918; Nayfeh and Mook 1979, Nonlinear Oscillations, chapter 7 (beams that
stretch).
Status: energy conserved to rounding; compiled law against two independent integrators.
"""

from __future__ import annotations

from bayesimpact.model.effects.effect import Effect, EffectParameter, Law, Numbers


def force(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Elastic force k3 d^3, N."""
    return p[0] * d * d * d


EFFECT = Effect(
    id="contact_hardening",
    family="contact stiffness",
    title="cubic stiffness of the obstacle",
    equation="k3 d^3 in contact",
    regime="contact",
    energy="conserves",
    statement=(
        "The obstacle's stiffness changes with the square of the indentation; the force reaches "
        "{size} ({share} of the peak contact force)."
    ),
    parameters=(
        EffectParameter(
            "stiffness",
            "N/m3",
            scale=lambda s: 0.05 * s.contact_stiffness / s.indentation**2,
        ),
    ),
    law=Law(force, where="contact", polynomial=True, ignores_speed=True),
    needs_stop=True,
)
