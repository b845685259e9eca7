"""A second stop on the side away from the first.

Equation: ks (y + gs) where y < -gs; ks in N/m, gs in m (for angles N m/rad, rad).
At its null: ks = 0 is the base model; gs then means nothing.
Energy: conserves; potential ks (y + gs)^2 / 2.
Valid: a frame, cable or end of a guide that is reached at large amplitude; elastic, without loss
of its own; the only stop where campaign.toml says that there is none.
Its absence shows in the first cycles only, as half-periods on that side which are too long.
Source: Shaw and Holmes 1983, J. Sound Vib. 90:129 (piecewise linear oscillators).
Status: period checked against the closed form, energy conserved to rounding; compiled law against
two independent integrators.
"""

from __future__ import annotations

import numpy as np

from bayesimpact.model.effects.effect import Effect, EffectParameter, Law, Numbers

GAPS = (0.2, 0.35, 0.5, 0.6, 0.7, 0.8, 0.87, 0.94)  # of the largest amplitude


def force(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Elastic force of the opposite stop, N."""
    return p[0] * (y + p[1]) if y < -p[1] else 0.0


def surface(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Where the opposite stop is reached."""
    return y + p[1]


EFFECT = Effect(
    id="opposite_stop",
    family="free stiffness",
    title="second stop on the other side",
    equation="ks (y + gs) where y < -gs",
    regime="free",
    energy="conserves",
    statement=(
        "Large displacements to the negative side meet an elastic stop; it adds up to {size} "
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
            grid=lambda s: np.array(GAPS) * s.amplitude,
        ),
    ),
    law=Law(force, surface=surface, polynomial=True, ignores_speed=True),
    replaces="second stop",  # a rig has one end of its travel on that side
)
