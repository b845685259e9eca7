"""A second obstacle behind the first, or an obstacle that stiffens at a certain depth.

Equation: ks (d - ds) where d > ds, d = y - g; ks in N/m, ds in m (for angles N m/rad, rad).
At its null: ks = 0 is the base model; ds then means nothing.
Energy: conserves; potential ks (d - ds)^2 / 2.
Valid: a gap behind the obstacle that closes, a second layer or washer; elastic, without loss of
its own.
Its absence shows in the deepest impacts only: the first cycles of a free decay.
Source: Shaw and Holmes 1983, J. Sound Vib. 90:129 (piecewise linear oscillators).
Status: energy conserved to rounding; compiled law against two independent integrators.
"""

from __future__ import annotations

import numpy as np

from bayesimpact.model.effects.effect import Effect, EffectParameter, Law, Numbers


def force(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Elastic force of the second stage, N."""
    return p[0] * (d - p[1]) if d > p[1] else 0.0


def surface(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Where the second stage is reached."""
    return d - p[1]


EFFECT = Effect(
    id="contact_second_stage",
    family="contact stiffness",
    title="second stage of the obstacle",
    equation="ks (d - ds) where d > ds",
    regime="contact",
    energy="conserves",
    statement=(
        "Deep impacts meet a second, stiffer stage of the obstacle; it adds up to {size} "
        "({share} of the peak contact force)."
    ),
    parameters=(
        EffectParameter("stiffness", "N/m", scale=lambda s: 0.2 * s.contact_stiffness, lower=0.0),
        EffectParameter(
            "depth",
            "m",
            scale=lambda s: 0.5 * s.indentation,
            lower=0.0,
            null=None,
            in_base=0.0,
            grid=lambda s: np.linspace(0.1, 0.9, 9) * s.indentation,
        ),
    ),
    law=Law(force, where="contact", surface=surface, polynomial=True, ignores_speed=True),
    needs_stop=True,
)
