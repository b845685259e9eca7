"""A second spring on the free side, met after a clearance, with a damper beside it.

Equation: kp (y + gp) + cp v where y < -gp; kp in N/m, gp in m, cp in N s/m (for angles N m/rad,
rad, N m s/rad).
At its null: kp = 0 with cp = 0 is the base model; gp then means nothing. cp = 0 is opposite_stop,
which is simpler and preferred.
Energy: dissipates cp v^2 beyond the clearance; the spring's potential is kp (y + gp)^2 / 2.
Valid: a bumper, a cable or a guide that is met at large amplitude and takes energy; a linear pair
of spring and damper, which may pull for a moment when it is left.
Its absence shows in the first cycles only, as half-periods on that side which are too long and a
loss that ends with them.
Source: Shaw and Holmes 1983, J. Sound Vib. 90:129 (piecewise linear oscillators).
Status: motion beyond the clearance checked in closed form; compiled law against two independent
integrators.
"""

from __future__ import annotations

import numpy as np

from bayesimpact.model.effects.effect import Effect, EffectParameter, Law, Numbers
from bayesimpact.model.effects.opposite_stop import GAPS


def force(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Force of the second spring and its damper, N; z is the side of the clearance's end."""
    return p[0] * (y + p[1]) + p[2] * v if z < 0.0 else 0.0


def surface(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Where the clearance ends."""
    return y + p[1]


EFFECT = Effect(
    id="spring_piecewise",
    family="free stiffness",
    title="second spring after a clearance, with damping",
    equation="kp (y + gp) + cp v where y < -gp",
    regime="free",
    energy="dissipates",
    statement=(
        "Large displacements to the negative side meet a second spring and damper, which add up to "
        "{size} "
        "({share} of the peak elastic force)."
    ),
    parameters=(
        EffectParameter("stiffness", "N/m", scale=lambda s: 0.5 * s.stiffness, lower=0.0),
        EffectParameter(
            "gap",
            "m",
            scale=lambda s: 0.7 * s.amplitude,
            lower=0.0,
            null=None,
            # opposite_stop's: of two laws that differ by a damper the one with the finer grid wins
            grid=lambda s: np.array(GAPS) * s.amplitude,
        ),
        EffectParameter(
            "damping",
            "N s/m",
            scale=lambda s: 0.1 * (s.stiffness * s.mass) ** 0.5,
            lower=0.0,
        ),
    ),
    law=Law(force, surface=surface, jump_at_surface=True, polynomial=True),
    replaces="second stop",  # a rig has one end of its travel on that side
    prefer="opposite_stop",
)
