"""Every obstacle has a damping of its own.

Equation: c2 -> c2[case], N s/m (for angles N m s/rad).
At its null: all equal is the base model.
Energy: dissipates, as c2 does.
Valid: obstacles of different material, clamping or size.
Its absence shows as a loss per impact that is wrong by a constant factor for each obstacle.
Source: Tian et al., section 4, where one c2 serves all beams for want of data.
Status: exact; runs in the closed-form simulator.
"""

from __future__ import annotations

from types import MappingProxyType

from bayesimpact.model.effects.effect import Effect, EffectParameter, Numbers, Scales, Size


def size(p: Numbers, scales: Scales) -> Size:
    """Range of the obstacles' c2, and its share of their mean."""
    difference, total = max(p) - min(p), sum(p)
    return difference, "N s/m", difference * len(p) / total if total > 0 else 0.0


EFFECT = Effect(
    id="contact_damping_per_case",
    family="contact damping",
    title="a damping of its own for every obstacle",
    equation="c2 [v] in contact, c2 per case",
    regime="contact",
    energy="dissipates",
    statement=(
        "The obstacles damp differently: their c2 differ by up to {size} ({share} of their mean)."
    ),
    parameters=(
        EffectParameter(
            "c2",
            "N s/m",
            scale=lambda s: 0.3 * s.contact_damping + 1e-3 * s.mass * s.contact_rate,
            lower=0.0,
            null=None,
            scope="case",
            replaces="c2",
            centre=lambda s: s.contact_damping,
        ),
    ),
    binds=MappingProxyType({"c2": "c2"}),
    needs_stop=True,
    condition=lambda s: s.cases > 1,
    size=size,
)
