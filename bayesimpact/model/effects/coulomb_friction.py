"""Dry friction: a constant force against the motion, which holds the mass at rest while it can.

Equation: F sign(v); at v = 0 the mass sticks while the other forces are within [-F, F]; F in N
(for angles N m).
At its null: F = 0 is the base model.
Energy: dissipates, power -F |v|.
Valid: dry guides, bearings, cable drag; static and sliding friction equal, no pre-sliding creep.
Its absence shows as a decay that ends sooner than an exponential: the amplitude falls by 2 F / k1
in each half-period; equivalent damping 4 F / (pi w a).
Source: Coulomb 1785; Den Hartog 1931, Trans. ASME 53:107.
Status: amplitude per half-period and place of rest checked in closed form; compiled against two
independent integrators.
"""

from __future__ import annotations

from types import MappingProxyType

from bayesimpact.model.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    id="coulomb_friction",
    family="free damping",
    title="dry friction",
    equation="F sign(v), sticking",
    regime="free",
    energy="dissipates",
    statement="Dry friction of {size} ({share} of the peak elastic force) acts against the motion.",
    parameters=(EffectParameter("force", "N", scale=lambda s: 0.5 * s.damping_force, lower=0.0),),
    binds=MappingProxyType({"friction": "force"}),
    size=lambda p, s: (p[0], "N", p[0] / s.force),
)
