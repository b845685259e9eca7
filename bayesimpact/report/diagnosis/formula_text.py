"""Formulas of learned forces as they are written on paper, and the letters of their numbers."""

from __future__ import annotations

import re

from markupsafe import Markup, escape

from bayesimpact.formula.law import is_formula_id
from bayesimpact.report.diagnosis.words import title_of

LETTERS = {"size": "A", "place": "p", "width": "w", "fade": "u"}
"""Letters that `formula.grammar` gives to the parameters of a term."""

_POWER = re.compile(r"\^(\d+)(?![\d.])")
_RAISED = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")
_MINUS = re.compile(r"(?<=[(\s])-(?=[\s(|yd\d])")
_ROOT = re.compile(r"\^(\d*\.\d+)")
_LETTER = re.compile(r"(?<![\w&#;])([A-Cpwuyvdt])(?!\w)")


def written(text: str) -> str:
    """A text with the formulas in it as "exp(−(y/w)²)" in place of "exp(-(y/w)^2)"."""
    if "^" not in text and "exp(" not in text and " y" not in text:
        return text
    raised = _POWER.sub(lambda m: m[1].translate(_RAISED), text)
    return _MINUS.sub("\N{MINUS SIGN}", raised)


def raised(text: str) -> Markup:
    """A text with formulas in it for HTML: as `written`, and "^1.5" raised too."""
    return Markup(_ROOT.sub(r"<sup>\1</sup>", str(escape(written(text)))))


def typeset_formula(text: str) -> Markup:
    """A formula for HTML: "A |v|^1.5 sign(v)" with italic letters and a raised 1.5."""
    return Markup(_LETTER.sub(r"<i>\1</i>", str(raised(text))))


def latex_formula(text: str) -> str:
    """A formula in LaTeX's mathematics, in place of its id."""
    powers = re.sub(r"\^([\d.]+)", r"^{\1}", text)
    named = re.sub(r"\b([a-z]{2,})\b", r"\\mathrm{\1}", powers)
    return "$" + named.replace(" ", r"\,") + "$"


def effect_title(effect_id: str, title: str = "") -> str:
    """What an effect is called, in HTML: a formula typeset, else words."""
    if not is_formula_id(effect_id):
        return written(title or title_of(effect_id))
    title = title or effect_id.replace("_", " ")
    return Markup("force {}").format(typeset_formula(title.removeprefix("force ")))


def letter(name: str) -> str | None:
    """The letter that stands for a parameter of a formula; None for other parameters."""
    effect, _, own = name.partition(".")
    return LETTERS.get(own) if is_formula_id(effect) else None
