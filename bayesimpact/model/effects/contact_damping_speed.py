"""Contact damping that grows with the square of the speed.

Equation: b |v| v in contact, b in N s2/m2 (for angles N m s2/rad2).
At its null: b = 0 is the base model.
Energy: dissipates for b > 0, power -b |v|^3.
Valid: squeezed or displaced fluid, losses at turbulent speeds; not for material damping.
Its absence shows as a loss per impact that grows faster than the square of the impact speed.
Source: Tian et al., section 4 (c2 may depend on the speed of the mass); Nayfeh and Mook 1979,
Nonlinear Oscillations, chapter 3 for the law.
Status: loss per impact checked against the closed form; compiled law against two independent
integrators.
"""

from __future__ import annotations

from bayesimpact.model.effects.effect import Effect, EffectParameter, Law, Numbers


def force(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Damping force b |v| v, N."""
    return p[0] * abs(v) * v


EFFECT = Effect(
    id="contact_damping_speed",
    family="contact damping",
    title="contact damping that grows with the speed",
    equation="b |v| v in contact",
    regime="contact",
    energy="dissipates",
    statement=(
        "The obstacle damps fast impacts more than slow ones; the force reaches {size} "
        "({share} of the peak contact force)."
    ),
    parameters=(
        EffectParameter(
            "coefficient",
            "N s2/m2",
            scale=lambda s: 0.05 * s.contact_force / s.impact_speed**2,
            lower=0.0,
        ),
    ),
    law=Law(force, where="contact", kink_at_turn=True, polynomial=True),
    needs_stop=True,
)
