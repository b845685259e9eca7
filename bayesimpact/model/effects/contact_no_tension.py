"""The obstacle cannot pull: contact ends when its force has fallen to zero, before y = g.

Equation: contact ends when k2 d + c2 v (with all that other effects add in contact) = 0, not when
y = g.
At its null: without the effect; the base model lets the dashpot pull back to y = g.
Energy: dissipates as c2 does, a little less: the pull of the dashpot is missing.
Valid: obstacles that are touched, not fastened, and light enough to follow only by their own
spring.
Its absence shows as contacts that last about c2 / k2 too long, and as a loss per impact that is
too large by a factor which depends on the obstacle.
Source: Hunt and Crossley 1975, J. Appl. Mech. 42:440 (tension of the spring-dashpot contact as
its flaw); Brogliato 1999, Nonsmooth Mechanics, chapter 2.
Status: instant of release checked against the closed form; compiled against two independent
integrators.
"""

from __future__ import annotations

from types import MappingProxyType

from bayesimpact.model.effects.effect import Effect

EFFECT = Effect(
    id="contact_no_tension",
    family="release",
    title="the obstacle cannot pull",
    equation="contact ends when k2 d + c2 v = 0",
    regime="exit",
    energy="dissipates",
    statement=(
        "The obstacle cannot pull: contact ends when its force vanishes, not at the gap; the base "
        "model's pull is {size} ({share} of the peak contact force)."
    ),
    sets=MappingProxyType({"no_tension": 1.0}),
    needs_stop=True,
    size=lambda p, s: (
        s.contact_damping * s.impact_speed,
        "N",
        s.contact_damping * s.impact_speed / s.contact_force,
    ),
)
