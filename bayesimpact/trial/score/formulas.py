"""Is a formula that was named the force that was planted?

A formula is right when its terms are of the planted force's class: where it acts, and how it
depends on the speed. Numbers of its shape and powers of the displacement are not judged.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

FAMILY = "formula"

CLASSES: Mapping[str, tuple[str, str]] = {
    "detent": ("local", ""),
    "friction_pad": ("local", "sign(v)"),
    "damping_bump": ("local", "v"),
    "eddy_brake": ("local", "v"),
    "damping_drift": ("t", "v"),
    "contact_friction": ("contact", "sign(v)"),
    "contact_preload": ("contact", ""),
    "contact_bump": ("local", ""),  # of the indentation: beyond a gap, of the displacement
}
"""Place and dependence on the speed of every planted force that the grammar holds."""


def formula_class(text: str) -> tuple[str, str]:
    """Place and dependence on the speed of a term, from its text (`formula.grammar.Term.text`)."""
    text = text.removeprefix("force A ")
    if "in contact" in text:
        place = "contact"
    elif text.startswith(("exp(-((", "exp(-(y")) or "where |y" in text:
        place = "local"
    elif text.startswith("t "):
        place = "t"
    else:
        place = "beyond" if "where" in text else ""
    rest = re.sub(r"exp\(-\(\(?y[^^]*\^2\)|in contact.*|where.*", "", text)
    if "|v|" in rest and "exp(-|v|" not in rest:
        return place, "power of v"
    if "sign(v)" in rest:
        return place, "sign(v)"
    if "exp(-|v|" in rest or "/ (1 + (v/" in rest:
        return place, "fading v"
    found = re.search(r"(?<![a-z|])v(\^\d)?", rest)
    return place, found.group(0) if found else ""


def is_right(formulas: Sequence[Mapping[str, Any]], planted: Sequence[str]) -> bool:
    """Whether every term that was named is of the class of a planted force."""
    classes = {CLASSES[p] for p in planted if p in CLASSES}
    return bool(formulas) and all(formula_class(f["title"]) in classes for f in formulas)


def split(
    effects: Sequence[Mapping[str, Any]],
) -> tuple[list[str], list[Mapping[str, Any]]]:
    """Ids of the catalogue's effects of an answer, and its formulas."""
    formulas = [e for e in effects if e.get("family") == FAMILY]
    return [e["id"] for e in effects if e.get("family") != FAMILY], formulas
