"""The catalogue as plain records: what each effect's file says of it, for listings and reports."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Sequence
from dataclasses import dataclass

from bayesimpact.model.effects import EFFECTS
from bayesimpact.model.effects.effect import Effect, EffectParameter, Energy, Regime, Scope

#: The questions that every effect's file answers, in order: how its lines begin -> attribute.
HEADS = {
    "Equation": "definition",
    "At its null": "at_null",
    "Energy": "energy_note",
    "Valid": "validity",
    "Its absence shows": "absence",
    "Source": "source",
    "Status": "status",
}


@dataclass(frozen=True)
class CatalogueParameter:
    """One parameter of an effect as the catalogue lists it.

    Attributes
    ----------
    name : `<effect id>.<parameter>`, followed by [case] or [recording] where there are several
    unit : for recordings of a displacement
    null : value at which the effect vanishes; "-" for a shape; what all must equal for c2 and g
    lower, upper : physical bounds
    scope : one value for the campaign, per case or per recording
    """

    name: str
    unit: str
    null: str
    lower: float
    upper: float
    scope: Scope


@dataclass(frozen=True)
class CatalogueRow:
    """One effect of the catalogue, in words.

    Attributes
    ----------
    id, family, title, equation, regime, energy : as in `Effect`
    parameters : what would be estimated
    summary : what it is, one sentence
    definition : equation with units
    at_null, energy_note, validity, absence, source, status : the rest of the file's answers
    """

    id: str
    family: str
    title: str
    equation: str
    regime: Regime
    energy: Energy
    parameters: tuple[CatalogueParameter, ...]
    summary: str
    definition: str = ""
    at_null: str = ""
    energy_note: str = ""
    validity: str = ""
    absence: str = ""
    source: str = ""
    status: str = ""


def catalogue(effects: Sequence[Effect] = EFFECTS) -> list[CatalogueRow]:
    """The catalogue, one row per effect, in its order.

    The words come from the docstring of the effect's module; an effect of one's own without such a
    module has its title for a summary and empty words.
    """
    return [_row(effect) for effect in effects]


def _row(effect: Effect) -> CatalogueRow:
    summary, answers = _answers(effect)
    return CatalogueRow(
        id=effect.id,
        family=effect.family,
        title=effect.title,
        equation=effect.equation,
        regime=effect.regime,
        energy=effect.energy,
        parameters=tuple(_parameter(effect, p) for p in effect.parameters if p.fixed is None),
        summary=summary,
        **answers,
    )


def _parameter(effect: Effect, parameter: EffectParameter) -> CatalogueParameter:
    ending = "" if parameter.scope == "campaign" else f"[{parameter.scope}]"
    null = "-" if parameter.null is None else f"{parameter.null:g}"
    return CatalogueParameter(
        name=f"{effect.id}.{parameter.name}{ending}",
        unit=parameter.unit,
        null=f"all equal {parameter.replaces}" if parameter.replaces else null,
        lower=parameter.lower,
        upper=parameter.upper,
        scope=parameter.scope,
    )


def _answers(effect: Effect) -> tuple[str, dict[str, str]]:
    """Summary and answers from the docstring of the effect's module."""
    try:
        module = importlib.import_module(f"{__package__}.{effect.id}")
    except ModuleNotFoundError:
        return effect.title, {}
    summary, _, rest = inspect.cleandoc(module.__doc__ or "").partition("\n\n")
    answers: dict[str, str] = {}
    current = ""
    for line in rest.splitlines():
        head = next((h for h in HEADS if line.startswith(h)), None)
        if head is not None:
            current = HEADS[head]
            answers[current] = line.removeprefix(head).removeprefix(":").strip()
        elif current:
            answers[current] += " " + line.strip()
    return " ".join(summary.split()), answers
