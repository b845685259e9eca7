"""A contact force that grows with a power of the indentation, as Hertz's does.

Equation: k2 d (d / 1 mm)^(n - 1) in place of k2 d (for angles d / 1 mrad), n without unit.
At its null: n = 1 is the base model.
Energy: conserves; potential k2 (1 mm) (d / 1 mm)^(n + 1) (1 mm) / (n + 1).
Valid: bodies whose area of contact grows with the load (n = 3/2 for spheres); k2 is then the
secant stiffness at 1 mm. Where a unilateral obstacle is left at d < 0 the law is continued as an
odd function.
Its absence shows as contact times that depend on the impact speed.
Source: Hertz 1882, J. reine angew. Math. 92:156; Johnson 1985, Contact Mechanics, chapter 4.
Status: contact time of a pure power law checked against the closed form; compiled law against two
independent integrators.
"""

from __future__ import annotations

from bayesimpact.model.effects.effect import Effect, EffectParameter, Law, Numbers
from bayesimpact.model.power import power


def force(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """What the power law adds to k2 d, N; q[4] is k2."""
    return q[4] * d * (power(abs(d) * 1e3, p[0] - 1.0) - 1.0) if d != 0.0 else 0.0


EFFECT = Effect(
    id="contact_power_law",
    family="contact stiffness",
    title="power law of the contact force",
    equation="k2 d ((d / 1 mm)^(n - 1) - 1) in contact",
    regime="contact",
    energy="conserves",
    statement=(
        "The contact force grows with a power of the indentation other than one; it differs from "
        "the linear law by up to {size} ({share} of the peak contact force)."
    ),
    parameters=(EffectParameter("exponent", "-", scale=lambda s: 0.2, lower=0.5, null=1.0),),
    law=Law(force, where="contact", rough_at_touch=True, ignores_speed=True),
    replaces="k2 d",
    needs_stop=True,
)
