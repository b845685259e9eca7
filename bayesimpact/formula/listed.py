"""Which terms of the grammar are laws of the catalogue, all but their names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from bayesimpact.formula.grammar import ONE, Power, Term
from bayesimpact.formula.library import DRAG, LINEAR, SIGN, V

DEEP = Power(1.0, False)  # of an indentation

LISTED: Mapping[Term, str] = {
    Term("everywhere", ONE, SIGN): "coulomb_friction",
    Term("everywhere", ONE, DRAG): "quadratic_drag",
    Term("everywhere", Power(2.0, False)): "spring_quadratic",
    Term("everywhere", Power(3.0, True)): "spring_cubic",
    Term("everywhere", Power(5.0, True)): "spring_quintic",
    Term("everywhere", LINEAR, drift=1): "stiffness_drift",
    Term("contact", Power(3.0, False)): "contact_hardening",
    Term("contact", DEEP, drift=1): "contact_stiffness_drift",
    Term("contact", DEEP, V): "contact_damping_indentation",
    Term("contact", ONE, DRAG): "contact_damping_speed",
}
STAGES: Mapping[Term, str] = {
    Term("contact", DEEP, place=1.0): "contact_second_stage",
    Term("beyond", DEEP, side=-1, place=1.0): "opposite_stop",
}
"""With a place of any size."""


def listed_as(term: Term) -> str | None:
    """Id of the effect of the catalogue that a term is; None for a force that it does not list."""
    if term.place > 0.0 and term.width == 0.0:
        return STAGES.get(replace(term, place=1.0))
    return LISTED.get(term)
