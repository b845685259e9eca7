"""A loss in the instant of impact: the mass goes on with a share of its speed.

Equation: v+ = r v at every contact onset from outside, r without unit; the contact then goes
on as in the base model.
At its null: r = 1 is the base model.
Energy: dissipates (1 - r^2) m v^2 / 2 at impact.
Valid: a thin hard layer or a light part that is hit before the obstacle yields, much faster than
the contact; not where what is hit moves along (obstacle_mass).
Its absence shows as a constant restitution: the same relative loss at every impact, whatever its
speed and the obstacle.
Source: Newton 1687, Principia, scholium to the laws of motion; Goldsmith 1960, Impact, chapter 1.
Status: speed after an impact checked in closed form; compiled against two independent integrators.
Asked for by large misfits and in the place of what else an obstacle does: no trials yet.
"""

from __future__ import annotations

from types import MappingProxyType

from bayesimpact.model.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    id="obstacle_restitution",
    family="contact inertia or memory",
    title="loss in the instant of impact",
    equation="v+ = r v at impact",
    regime="entry",
    energy="dissipates",
    statement=(
        "The mass loses {size} of its speed in the instant of impact ({share} of its energy)."
    ),
    parameters=(
        EffectParameter("coefficient", "-", scale=lambda s: 0.05, lower=0.0, upper=1.0, null=1.0),
    ),
    binds=MappingProxyType({"restitution": "coefficient"}),
    needs_stop=True,
    size=lambda p, s: (100.0 * (1.0 - p[0]), "%", 1.0 - p[0] ** 2),
)
