"""What the parameters of effects are called: in words, never by their ids."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bayesimpact.formula.law import is_formula_id
from bayesimpact.model.effects import EFFECTS
from bayesimpact.report.diagnosis.words import title_of

_INITIAL = {f"{e.id}.{p.name}" for e in EFFECTS for p in e.parameters if p.initial}


def split(name: str) -> tuple[str, str, str]:
    """Effect in words, own name, and case or recording with its brackets: each may be empty.

    "gap_wear.step" gives "a gap that grows at every impact", "step" and "".
    """
    base, bracket, key = name.partition("[")
    effect, dot, own = base.partition(".")
    if not dot:
        return "", in_words(base), bracket + key
    words = "formula" if is_formula_id(effect) else title_of(effect)
    return words, in_words(own), bracket + key


def in_words(name: str) -> str:
    """An identifier as words: "time_constant" becomes "time constant"."""
    return name.replace("_", " ")


def own_parameters(effect: Mapping[str, Any]) -> list[tuple[str, Mapping[str, Any]]]:
    """Parameters of an effect of diagnosis.json that tell what it is: not its states at the start
    of recordings. None of a fault, whose size is told as such.
    """
    if is_fault(effect):
        return []
    parameters = effect.get("parameters", {}).items()
    return [(n, p) for n, p in parameters if n.partition("[")[0] not in _INITIAL]


def of_recordings(effect: Mapping[str, Any]) -> str:
    """Of a fault its recording, to follow its title: " of r4"; "" for effects."""
    if not is_fault(effect):
        return ""
    recordings = (effect.get("location") or {}).get("recordings") or ()
    return f" of {', '.join(map(str, recordings))}" if recordings else ""


def is_fault(effect: Mapping[str, Any]) -> bool:
    """True for a fault of a recording, an entry of diagnosis.json's effects like any other."""
    return effect.get("family") == "recording"
