"""Formulas of learned forces as a report writes them."""

from __future__ import annotations

import pytest
from diagnosed import diagnosed

from bayesimpact.formula.grammar import Power, Term
from bayesimpact.formula.law import effect_of
from bayesimpact.report.diagnosis.formula_text import LETTERS, letter, written
from bayesimpact.report.diagnosis.view import FORMULAS, diagnosis_view
from bayesimpact.report.figures.style import full_symbol
from bayesimpact.report.latex import symbol as latex_symbol
from bayesimpact.report.tables import symbol

BUMP = Term("bump", Power(1.0, True), Power(0.0, False), side=-1, place=1.47e-3, width=5.1e-4)


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("A exp(-((y + p)/w)^2) (y + p)", "A exp(\N{MINUS SIGN}((y + p)/w)²) (y + p)"),
        ("B |v|^1.5 sign(v) - A y^10", "B |v|^1.5 sign(v) \N{MINUS SIGN} A y¹⁰"),
        ("a gap - of its own", "a gap - of its own"),
    ],
)
def test_powers_are_raised_and_signs_are_signs(text: str, shown: str) -> None:
    assert written(text) == shown


def test_letters_are_those_of_the_formula() -> None:
    effect = effect_of(BUMP, 1.0, 0.01, 1.0, signed=True)
    free = [p.name for p in effect.parameters if p.fixed is None]
    letters = [letter(f"{effect.id}.{name}") for name in free]
    assert letters == ["A", "p", "w"] and LETTERS["fade"] == "u"
    assert all(str(x) in effect.title for x in letters)
    name = f"{effect.id}.place"
    assert symbol(name).striptags() == "formula: p"
    assert full_symbol(name, 24) == "formula: $p$" and latex_symbol(name) == "formula: $p$"
    assert letter("gap_wear.step") is None and letter("k2[1]") is None


def test_unlikely_formulas_are_counted_not_shown() -> None:
    rows = [{"formula": f"A y^{k}", "probability": 0.5**k, "log_odds": 1.0} for k in range(1, 20)]
    view = diagnosis_view(diagnosed(formulas=rows))
    assert view is not None and len(view["formulas"]) == 9 and view["formulas_left"] == 10
    short = diagnosis_view(diagnosed(formulas=[{**row, "probability": 0.0} for row in rows]))
    assert short is not None and len(short["formulas"]) == FORMULAS
