"""Adhesion: the obstacle holds the mass with a pull that must be overcome on leaving.

Equation: contact begins at y = g without a pull and ends when k2 d + c2 v = -F, in place of y = g;
F in N (for angles N m). The obstacle follows the mass beyond y = g until then.
At its null: F = 0 is contact_no_tension, which is simpler and preferred.
Energy: dissipates F^2 / (2 k2) per contact: what the stretched obstacle keeps when it lets go.
Valid: soft or wetted contacts, grease, magnets at the stop; the pull does not depend on how fast or
how hard the contact was, and the obstacle is at rest again before the next one.
Its absence shows as contacts that last too short, and a loss per contact that does not depend on
the impact speed.
Source: Johnson, Kendall and Roberts 1971, Proc. R. Soc. A 324:301 (pull-off force); Johnson 1985,
Contact Mechanics, chapter 5.
Status: energy of an impact checked in closed form; compiled against two independent integrators.
"""

from __future__ import annotations

from types import MappingProxyType

from bayesimpact.model.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    id="adhesion",
    family="contact inertia or memory",
    title="adhesion of the obstacle",
    equation="contact ends when k2 d + c2 v = -F",
    regime="exit",
    energy="dissipates",
    statement=(
        "The obstacle sticks to the mass: a pull of {size} ({share} of the peak contact force) "
        "must be overcome on leaving."
    ),
    parameters=(EffectParameter("force", "N", scale=lambda s: 0.05 * s.contact_force, lower=0.0),),
    binds=MappingProxyType({"adhesion": "force"}),
    sets=MappingProxyType({"no_tension": 1.0}),
    needs_stop=True,
    prefer="contact_no_tension",
    size=lambda p, s: (p[0], "N", p[0] / s.contact_force),
)
