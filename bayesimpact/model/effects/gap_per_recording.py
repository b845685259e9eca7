"""Every recording has a gap of its own.

Equation: g -> g[recording], m (for angles rad).
At its null: all equal is the base model.
Energy: conserves.
Valid: a rig that was touched between recordings: obstacle re-clamped, bolt deformed, temperature.
Its absence shows as contacts that begin too early in some recordings and too late in others, from
the first impact to the last.
Source: Tian et al., section 4, where the gap is allowed to differ between recordings.
Status: exact; runs in the closed-form simulator.
"""

from __future__ import annotations

from types import MappingProxyType

from bayesimpact.model.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    id="gap_per_recording",
    family="gap",
    title="a gap of its own for every recording",
    equation="g per recording",
    regime="entry",
    energy="conserves",
    statement=(
        "The gap differs between recordings, by up to {size} ({share} of the deepest indentation)."
    ),
    parameters=(
        EffectParameter(
            "g",
            "m",
            scale=lambda s: 0.05 * s.indentation,
            null=None,
            scope="recording",
            replaces="g",
            centre=lambda s: s.gap,
        ),
    ),
    binds=MappingProxyType({"g": "g"}),
    needs_stop=True,
    condition=lambda s: s.recordings > 1,
    size=lambda p, s: (max(p) - min(p), "m", (max(p) - min(p)) / s.indentation),
)
