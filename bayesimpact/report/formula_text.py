"""Formulas of learned forces as they are written on paper, and the letters of their numbers."""

from __future__ import annotations

import re

from bayesimpact.formula.law import PREFIX

LETTERS = {"size": "A", "place": "p", "width": "w", "fade": "u"}
"""Letters that `formula.grammar` gives to the parameters of a term."""

_POWER = re.compile(r"\^(\d+)(?![\d.])")
_RAISED = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")
_MINUS = re.compile(r"(?<=[(\s])-(?=[\s(|yd\d])")


def written(text: str) -> str:
    """A text with the formulas in it as "exp(−(y/w)²)" in place of "exp(-(y/w)^2)"."""
    if "^" not in text and "exp(" not in text and " y" not in text:
        return text
    raised = _POWER.sub(lambda m: m[1].translate(_RAISED), text)
    return _MINUS.sub("\N{MINUS SIGN}", raised)


def letter(name: str) -> str | None:
    """The letter that stands for a parameter of a formula; None for other parameters."""
    effect, _, own = name.partition(".")
    return LETTERS.get(own) if effect.startswith(PREFIX) else None


def in_words(ids: str) -> str:
    """Ids of effects, joined by " + ", as a label: titles are too long for one. A formula's id is
    left out, for it is no name.
    """
    parts = ids.split(" + ")
    return " + ".join("formula" if p.startswith(PREFIX) else p.replace("_", " ") for p in parts)
