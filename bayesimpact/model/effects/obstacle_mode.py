"""The obstacle has a mode of its own: a mass on a spring and a damper inside it, which rings.

Equation: in contact the obstacle pushes with m2 (w^2 (d - x) + 2 z w (v - x')) more, N, where
x'' = w^2 (p - x) + 2 z w (p' - x'), p = d in contact and 0 in flight; w = 2 pi f in rad/s, z
without unit, m2 in kg (for angles kg m2); x = x' = 0 at a recording's first sample.
At its null: m2 = 0 is the base model; frequency and damping then mean nothing.
Energy: dissipates: what the mode stores it keeps and gives back at the next contact, less what its
damper takes.
Valid: a beam or plate as the stop, m2 being the effective mass and f the frequency of its first
mode with the place of contact held; k2 stays the static stiffness, contact still begins and ends
at y = g. A mass at the very place of contact is obstacle_mass.
Its absence shows as a contact force that oscillates and depends on how the last contact ended.
Source: Craig and Bampton 1968, AIAA Journal 6:1313 (fixed-interface modes and effective masses).
Status: matrix exponential of every stretch and the static limit checked; compiled against two
independent integrators.
"""

from __future__ import annotations

import math
from types import MappingProxyType

import numpy as np

from bayesimpact.model.effects.effect import Effect, EffectParameter, damping_ratio

EFFECT = Effect(
    id="obstacle_mode",
    family="contact inertia or memory",
    title="mode of the obstacle",
    equation=(
        "m2 (w^2 (d - x) + 2 z w (v - x')) in contact, x'' = w^2 (p - x) + 2 z w (p' - x'), "
        "p = d in contact, 0 in flight"
    ),
    regime="contact",
    energy="dissipates",
    statement=(
        "A mass of {size} ({share} of the oscillator's) rings on a spring of its own inside the "
        "obstacle."
    ),
    parameters=(
        EffectParameter("mass", "kg", scale=lambda s: 0.05 * s.mass, lower=0.0),
        EffectParameter(
            "frequency",
            "Hz",
            scale=lambda s: 3.0 * s.contact_rate / (2.0 * math.pi),
            lower=0.0,
            null=None,
            grid=lambda s: np.geomspace(0.8, 12.0, 32) * s.contact_rate / (2.0 * math.pi),
        ),
        damping_ratio(0.03),
    ),
    binds=MappingProxyType(
        {"obstacle_mass": "mass", "obstacle_frequency": "frequency", "obstacle_damping": "damping"}
    ),
    needs_stop=True,
    size=lambda p, s: (p[0], "kg", p[0] / s.mass),
)
