"""The gap grows by the same step at every impact.

Equation: g of the i-th contact (from 0) is g + i step; step in m per impact (for angles rad per
impact).
At its null: step = 0 is the base model.
Energy: dissipates nothing by itself: the gap changes while the obstacle is unloaded.
Valid: plastic flattening, wear or seating of a bolt at loads that change little; every recording
starts anew.
Its absence shows as contacts that begin ever later, in proportion to the number of impacts so far.
Source: Tian et al., section 4 (plastic deformation of the bolt); Archard 1953, J. Appl. Phys.
24:981.
Status: exact between events; compiled against two independent integrators.
"""

from __future__ import annotations

from types import MappingProxyType

from bayesimpact.model.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    id="gap_wear",
    family="gap",
    title="a gap that grows at every impact",
    equation="g -> g + step after every contact",
    regime="entry",
    energy="conserves",
    statement=(
        "The gap widens at every impact, by {size} in all ({share} of the deepest indentation)."
    ),
    parameters=(
        EffectParameter(
            "step", "m", scale=lambda s: 0.05 * s.indentation / max(s.impacts, 1), lower=0.0
        ),
    ),
    binds=MappingProxyType({"gap_step": "step"}),
    needs_stop=True,
    condition=lambda s: s.impacts > 1,
    size=lambda p, s: (p[0] * s.impacts, "m", p[0] * s.impacts / s.indentation),
)
