"""Hunt and Crossley's contact: a power of the indentation, and a damping that grows with it.

Equation: k2 d (d / 1 mm)^(n - 1) (1 + chi v) in place of k2 d + c2 v (for angles d / 1 mrad); n
without unit, chi in s/m.
At its null: it has none, for c2 is gone: models are compared by their evidence. n = 1 is
contact_damping_indentation without a dashpot, chi = 0 contact_power_law without one.
Energy: dissipates k2 chi d^n v^2; for small chi the restitution is 1 - 2 chi v / 3.
Valid: bodies that meet without an impulse at impact, restitution near one; k2 is the secant
stiffness at 1 mm. It pulls for an instant where chi v < -1 on the way out. Where a unilateral
obstacle is left at d < 0 the law is continued as an odd function of d.
Its absence shows as a contact damping that is nothing at impact and grows with the depth, and as
contact times that depend on the impact speed.
Source: Hunt and Crossley 1975, J. Appl. Mech. 42:440.
Status: speed after an impact checked against the closed form; compiled law against two independent
integrators.
"""

from __future__ import annotations

import math
from types import MappingProxyType

import numpy as np

from bayesimpact.model.effects.effect import Effect, EffectParameter, Law, Numbers, Scales
from bayesimpact.model.power import power

LINEAR = 1e-3  # of critical damping against the obstacle: a scale where the base fit has no c2


def force(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """What the law has in excess of k2 d, N; q[4] is k2."""
    if d == 0.0:
        return 0.0
    return float(q[4] * d * (power(abs(d) * 1e3, p[0] - 1.0) * (1.0 + p[1] * v) - 1.0))


def equivalent(s: Scales) -> float:
    """Chi that takes in a contact of half the largest depth what c2 takes, s/m.

    For d = D sin(w t): c2 pi / 2 = chi k2 D 2 / 3.
    """
    dashpot = s.contact_damping + LINEAR * math.sqrt(s.contact_stiffness * s.mass)
    return 1.5 * math.pi * dashpot / (s.contact_stiffness * s.indentation)


EFFECT = Effect(
    id="hunt_crossley",
    family="contact stiffness",
    title="Hunt-Crossley contact",
    equation="k2 d (d / 1 mm)^(n - 1) (1 + chi v) in place of k2 d + c2 v",
    regime="contact",
    energy="dissipates",
    statement=(
        "The contact follows Hunt and Crossley's law in place of a spring and a dashpot; it "
        "differs from the spring by up to {size} ({share} of the peak contact force)."
    ),
    parameters=(
        EffectParameter(
            "exponent",
            "-",
            scale=lambda s: 1.5,
            lower=0.5,
            upper=4.0,
            null=None,
            grid=lambda s: np.array([0.8, 1.0, 1.25, 1.5, 2.0]),
        ),
        EffectParameter(
            "damping",
            "s/m",
            scale=equivalent,
            lower=0.0,
            null=None,
            grid=lambda s: equivalent(s) * np.array([0.3, 1.0, 3.0]),
        ),
    ),
    law=Law(force, where="contact", rough_at_touch=True),
    sets=MappingProxyType({"c2": 0.0}),
    replaces="k2 d",
    needs_stop=True,
)
