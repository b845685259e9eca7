"""The catalogue as lines of text; what an effect's file says further stands in its docstring."""

from __future__ import annotations

from bayesimpact.model.effects import UNTRIED
from bayesimpact.model.effects.effect import Effect, EffectParameter


def listing(effect: Effect) -> list[str]:
    """Id, title with equation and family, and the parameters that would be estimated."""
    lines = [effect.id, f"    {effect.title}: {effect.equation}   [{effect.family}]"]
    if effect.id in UNTRIED:
        lines.append("    not looked for but where much is missing, or in the place of its like")
    return lines + [f"    {_words(effect, p)}" for p in effect.parameters if p.fixed is None]


def _words(effect: Effect, parameter: EffectParameter) -> str:
    """Name, unit for recordings of a displacement, where the effect vanishes, how many it has."""
    several = parameter.scope != "campaign"
    null = f"all equal {parameter.replaces}" if parameter.replaces else parameter.null
    told = "" if null is None else f", vanishes at {null if parameter.replaces else f'{null:g}'}"
    told += f", one per {parameter.scope}" if several else ""
    ending = f"[{parameter.scope}]" if several else ""
    return f"{effect.id}.{parameter.name}{ending} ({parameter.unit}{told})"
