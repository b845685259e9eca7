"""Relaxation of the obstacle: a spring in series with a dashpot beside the elastic stop.

Equation: force z in contact, z' = kz v - z / tau; in flight no force, z' = -z / tau; kz in N/m,
tau in s (for angles kz in N m/rad).
At its null: kz = 0 is the base model; tau then means nothing.
Energy: dissipates for kz > 0: the branch's spring stores z^2 / (2 kz) and its dashpot takes z^2 /
(kz tau).
Valid: polymers, bolted and glued joints with one dominant relaxation time; not for creep over
hours.
Its absence shows as a contact damping that depends on how long the contact lasts, so on the
obstacle.
Source: Zener 1948, Elasticity and Anelasticity of Metals, chapter 5 (standard linear solid).
Status: limits tau -> 0 (dashpot kz tau) and tau -> inf (spring kz) checked; compiled law against
two independent integrators.
"""

from __future__ import annotations

import numpy as np

from bayesimpact.model.effects.effect import Effect, EffectParameter, Law, Numbers, Scales, Size


def force(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Force of the branch, N."""
    return z


def rate(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Growth of the branch's force, N/s."""
    return touching * p[0] * v - z / p[1]


def size(p: Numbers, s: Scales) -> Size:
    """Peak force of the branch: of a spring when it is slow, of a dashpot when it is fast."""
    peak = p[0] * min(s.indentation, p[1] * s.impact_speed)
    return peak, "N", peak / s.contact_force


EFFECT = Effect(
    id="contact_relaxation",
    family="contact inertia or memory",
    title="relaxation of the obstacle",
    equation="force z in contact, z' = kz v - z / tau; z' = -z / tau in flight",
    regime="contact",
    energy="dissipates",
    statement=(
        "The obstacle relaxes: a Maxwell branch adds {size} ({share} of the peak contact force)."
    ),
    parameters=(
        EffectParameter("stiffness", "N/m", scale=lambda s: 0.5 * s.contact_stiffness, lower=0.0),
        EffectParameter(
            "time",
            "s",
            scale=lambda s: 0.3 / s.contact_rate,
            lower=0.0,
            null=None,
            grid=lambda s: np.geomspace(0.03, 3.0, 9) / s.contact_rate,
        ),
    ),
    law=Law(force, where="contact", rate=rate),
    needs_stop=True,
    size=size,
)
