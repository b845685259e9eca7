"""The obstacle has a mass: it is picked up at impact and left when its force vanishes.

Equation: v+ = m v / (m + m2) at impact; in contact the moving mass is m + m2; contact ends when m2
y'' + c2 v + k2 d = 0; m2 in kg (for angles kg m2). Every contact finds the obstacle at rest at y =
g.
At its null: m2 = 0 is contact_no_tension, which is simpler and preferred.
Energy: dissipates m m2 v^2 / (2 (m + m2)) at impact; what the obstacle carries off at release is
lost too.
Valid: an obstacle whose own vibration dies out between impacts, m2 below about a tenth of m
(0.243 rho A L for the tip of a uniform cantilever); not for an obstacle that rings.
Its absence shows as a constant restitution: the same relative loss at every impact, whatever its
speed.
Source: Goldsmith 1960, Impact, chapter 1 (perfectly inelastic impact).
Status: momentum at impact checked in closed form; compiled against two independent integrators.
"""

from __future__ import annotations

from types import MappingProxyType

from bayesimpact.model.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    id="obstacle_mass",
    family="contact inertia or memory",
    title="mass of the obstacle",
    equation=(
        "v+ = m v / (m + m2) at impact, mass m + m2 in contact, free when m2 y'' + c2 v + k2 d = 0"
    ),
    regime="entry",
    energy="dissipates",
    statement="The obstacle carries a mass of {size} ({share} of the oscillator's).",
    parameters=(EffectParameter("mass", "kg", scale=lambda s: 0.05 * s.mass, lower=0.0),),
    binds=MappingProxyType({"contact_mass": "mass"}),
    sets=MappingProxyType({"no_tension": 1.0}),
    needs_stop=True,
    prefer="contact_no_tension",
    size=lambda p, s: (p[0], "kg", p[0] / s.mass),
)
