"""Formulas that were named, judged by their class."""

from __future__ import annotations

import numpy as np
import pytest

from bayesimpact.formula.library import library
from bayesimpact.model.own_effects import USUAL
from bayesimpact.trial.score.answers import names_the_force
from bayesimpact.trial.score.formulas import formula_class, is_right

LIBRARY = library(USUAL, -6e-3, 3e-3)


def test_every_term_of_the_library_has_its_place_and_speed() -> None:
    places = {"bump": "local", "box": "local", "contact": "contact", "beyond": "beyond"}
    for term in LIBRARY:
        place, speed = formula_class(term.text())
        wanted = "t" if term.drift and term.region == "everywhere" else places.get(term.region, "")
        assert place == wanted, term.text()
        v = np.array([0.1, 0.2])
        values = term.of_speed(v)
        if speed == "":
            assert term.speed.is_one, term.text()
        elif speed == "sign(v)":
            assert term.speed.exponent == 0.0, term.text()
        elif speed == "v":
            np.testing.assert_allclose(values, v, err_msg=term.text())


@pytest.mark.parametrize(
    ("text", "planted", "right"),
    [
        ("exp(-((y + 2 mm)/0.5 mm)^2) (y + 2 mm)", "detent", True),
        ("exp(-((y + 2 mm)/0.5 mm)^2) v", "detent", False),
        ("exp(-((y + 2 mm)/0.5 mm)^2) v", "damping_bump", True),
        ("v where |y + 2 mm| < 0.5 mm", "eddy_brake", True),
        ("sign(v) in contact", "contact_friction", True),
        ("d sign(v)", "contact_friction", False),
        ("v exp(-|v|/(0.1 m/s))", "eddy_brake", False),
        ("v / (1 + (v/(0.1 m/s))^2)", "eddy_brake", False),
        ("t v", "damping_drift", True),
        ("|v| v", "damping_drift", False),
        ("in contact", "contact_preload", True),
        ("in contact", "knock", False),
    ],
)
def test_class_decides(text: str, planted: str, right: bool) -> None:
    effect = {"id": "formula_x", "title": text, "family": "formula"}
    assert is_right([effect], [planted]) is right
    truth = {"kind": "outside", "planted": [{"id": planted}]}
    answer = {"verdict": "named", "effects": [effect]}
    assert names_the_force(truth, answer) is right
    assert not names_the_force({**truth, "kind": "single"}, answer)
    wrong = {"id": "spring_cubic", "title": "cubic", "family": "free stiffness"}
    assert not names_the_force(truth, {**answer, "effects": [effect, wrong]})
