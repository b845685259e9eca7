"""Contact damping that grows with the indentation (Hunt and Crossley).

Equation: lam d v in contact, d = y - g, lam in N s/m2 (for angles N m s/rad2).
At its null: lam = 0 is the base model.
Energy: dissipates for lam > 0, power -lam d v^2.
Valid: compliant contacts in which the damping material is engaged gradually; not for a dashpot
that is already moving when contact begins.
Its absence shows as contact damping that grows with the depth of an impact; the force is
continuous at impact.
Source: Hunt and Crossley 1975, J. Appl. Mech. 42:440, Eq. 9 with n = 1; lam = 3 (1 - e) k2 / (2
v) for a restitution e near 1.
Status: loss per impact checked against the closed form for a light damping; compiled law against
two independent integrators.
"""

from __future__ import annotations

from bayesimpact.model.effects.effect import Effect, EffectParameter, Law, Numbers


def force(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Damping force lam d v, N."""
    return p[0] * d * v


EFFECT = Effect(
    id="contact_damping_indentation",
    family="contact damping",
    title="contact damping that grows with the indentation",
    equation="lam d v in contact",
    regime="contact",
    energy="dissipates",
    statement=(
        "The obstacle damps the more the deeper it is pressed; the force reaches {size} "
        "({share} of the peak contact force)."
    ),
    parameters=(
        EffectParameter(
            "coefficient",
            "N s/m2",
            scale=lambda s: 0.05 * s.contact_stiffness / s.impact_speed,
            lower=0.0,
        ),
    ),
    law=Law(force, where="contact", polynomial=True),
    needs_stop=True,
)
