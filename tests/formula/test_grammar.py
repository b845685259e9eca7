"""Terms: written in three ways (NumPy, the compiled law, the file of an effect), and what they say
of themselves.
"""

from __future__ import annotations

import ctypes
import pickle
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bayesimpact.formula.grammar import NODE, ONE, Power, Term
from bayesimpact.formula.law import effect_id, effect_of, force, is_formula, law_of
from bayesimpact.formula.library import library, local_starts, neighbours
from bayesimpact.formula.write import effect_file
from bayesimpact.model.effects.effect import Effect, address
from bayesimpact.model.own_effects import USUAL, check_effects, load_effects
from bayesimpact.model.parameters import angular
from bayesimpact.model.units import Dimensions, dimensions, per_mass_unit, typeset

LOW, HIGH = -6e-3, 3e-3
LIBRARY = library(USUAL, LOW, HIGH)
SIZE, GAP = 0.7, 1.1e-3
SIGN, V, DRAG = Power(0.0, True), Power(1.0, True), Power(2.0, True)


def effect(term: Term, *, signed: bool = False) -> Effect:
    return effect_of(term, 1e-2, 6e-3, 0.24, signed=signed)


def states(count: int = 40) -> np.ndarray:
    """Displacement, velocity, indentation, time, (4, count)."""
    rng = np.random.default_rng(0)
    y, v, t = (
        rng.uniform(LOW, HIGH, count),
        rng.uniform(-0.24, 0.24, count),
        rng.uniform(0, 6, count),
    )
    return np.stack([y, v, y - GAP, t])


def numbers(term: Term, one: Effect) -> np.ndarray:
    """The compiled law's parameters in its own order."""
    own = [p.fixed if p.fixed is not None else term.shapes[p.name] for p in one.parameters[1:]]
    return np.array([SIZE, *own])


def called(law: Any, function: Any, p: Any, state: np.ndarray) -> float:
    """The force at one state; z is what the simulator would hand over."""
    y, v, d, t = map(float, state)
    z = float(np.sign(v))
    if law.jump_at_surface:
        side = float(np.sign(law.surface(y, v, d, t, 0.0, float(d > 0), p, None)))
        z = (z if side > 0.0 else 0.0) if law.jump_at_turn else side
    return float(function(y, v, d, t, z, float(d > 0), p, None))


def visited(term: Term) -> np.ndarray:
    """States at which the simulator calls the term's law."""
    found = states()
    return found[:, found[2] > 0] if term.region == "contact" else found


def test_the_library_has_every_term_once_and_says_so() -> None:
    assert 200 <= len(LIBRARY) <= 500
    assert len({effect_id(t) for t in LIBRARY}) == len(LIBRARY)
    assert len({t.text() for t in LIBRARY}) == len(LIBRARY)


def test_what_the_base_model_has_is_not_in_the_library() -> None:
    y, v, d, t = states()
    free = np.stack([np.ones_like(y), y, v, (d > 0) * d, (d > 0) * v])
    for term in LIBRARY:
        own = term.force(y, v, d, t)
        fitted = free.T @ np.linalg.lstsq(free.T, own, rcond=None)[0]
        assert np.abs(fitted - own).max() > 1e-6 * np.abs(own).max(), term.text()


def test_law_is_the_term_for_the_whole_library() -> None:
    for term in LIBRARY:
        one = effect(term, signed=True)
        law, p = law_of(term), numbers(term, one)
        found = [called(law, force, p, s) for s in visited(term).T]
        wanted = SIZE * term.force(*visited(term))
        np.testing.assert_allclose(found, wanted, rtol=1e-9, err_msg=term.text())


def test_compiled_law_is_the_python_one() -> None:
    pointer = ctypes.POINTER(ctypes.c_double)
    compiled = ctypes.CFUNCTYPE(ctypes.c_double, *[ctypes.c_double] * 6, pointer, pointer)(
        address(force)
    )
    for term in {t.kind: t for t in LIBRARY}.values():
        p = numbers(term, effect(term, signed=True))
        data = p.ctypes.data_as(pointer)
        law = law_of(term)
        for s in visited(term).T[:5]:
            mine = called(law, lambda *a, data=data: compiled(*a[:6], data, data), p, s)
            assert mine == pytest.approx(called(law, force, p, s), rel=1e-12), term.text()


def test_file_is_the_term_for_every_kind(tmp_path: Any) -> None:
    for term in {t.kind: t for t in LIBRARY}.values():
        names: dict[str, Any] = {}
        exec(effect_file([term], [effect(term, signed=True)], [SIZE], "."), names)
        law = names["FOUND"].law
        found = [called(law, law.force, [SIZE, *term.shapes.values()], s) for s in visited(term).T]
        np.testing.assert_allclose(
            found, SIZE * term.force(*visited(term)), rtol=1e-9, err_msg=term.text()
        )
        own, p = law_of(term), numbers(term, effect(term, signed=True))
        for flag in ("where", "jump_at_turn", "jump_at_surface", "kink_at_turn", "polynomial"):
            assert getattr(law, flag) == getattr(own, flag), term.text()
        for name in ("feature_length", "first_at_turn"):
            mine, its = getattr(law, name), getattr(own, name)
            assert (mine is None) == (its is None), term.text()
            if its is not None:
                z = (0.0,) * 6
                short = [SIZE, *term.shapes.values()]
                assert mine(*z, short, None) == pytest.approx(its(*z, p, None), rel=1e-5)


def test_file_of_three_terms_can_be_used(tmp_path: Any) -> None:
    terms = [
        Term("everywhere", ONE, SIGN),
        Term("bump", V, ONE, -1, 2e-3, 6e-4),
        Term("contact", Power(1.5, False), place=5e-4),
    ]
    file = tmp_path / "effect_found.py"
    file.write_text(effect_file(terms, [effect(t) for t in terms], [1.0, 2.0, 3.0], " and named"))
    own = load_effects(file)
    assert [e.id for e in own] == [effect_id(t) for t in terms]
    assert own[0].binds == {"friction": "size"}  # it sticks
    assert list(own[1].parameter("place").grid(USUAL)) == [2e-3]  # type: ignore[misc]


def test_effects_pass_the_checks_of_effects_of_ones_own_and_can_be_pickled() -> None:
    own = [effect(t) for t in {t.kind: t for t in LIBRARY}.values()]
    check_effects(own)
    assert all(is_formula(e) for e in own)
    again = pickle.loads(pickle.dumps(own[3]))
    assert again.id == own[3].id and again.law == own[3].law


@pytest.mark.parametrize(
    ("term", "text", "unit", "energy"),
    [
        (Term("everywhere", ONE, SIGN), "sign(v)", "N", "dissipates"),
        (Term("everywhere", ONE, DRAG), "|v| v", "N s2/m2", "dissipates"),
        (Term("everywhere", Power(3.0, True)), "y^3", "N/m3", "conserves"),
        (Term("everywhere", V, V), "y v", "N s/m2", "either"),
        (Term("everywhere", ONE, V, drift=1), "t v", "N/m", "dissipates"),
        (Term("everywhere", V, drift=1), "t y", "N/m/s", "either"),
        (
            Term("everywhere", ONE, V, fade=0.1, lorentzian=True),
            "v / (1 + (v/(0.1 m/s))^2)", "N s/m", "dissipates",
        ),
        (Term("everywhere", ONE, SIGN, fade=0.1), "sign(v) exp(-|v|/(0.1 m/s))", "N", "dissipates"),
        (Term("contact", Power(1.5, False)), "d^1.5 in contact", "N/m1.5", "conserves"),
        (
            Term("bump", V, ONE, -1, 2e-3, 5e-4),
            "exp(-((y + 2 mm)/0.5 mm)^2) (y + 2 mm)", "N/m", "conserves",
        ),
        (Term("box", ONE, V, 1, 2e-3, 5e-4), "v where |y - 2 mm| < 0.5 mm", "N s/m", "dissipates"),
        (
            Term("beyond", Power(1.0, False), side=-1, place=4e-3),
            "(-y - 4 mm) where y < -4 mm", "N/m", "conserves",
        ),
    ],
)  # fmt: skip
def test_a_term_says_what_it_is(term: Term, text: str, unit: str, energy: str) -> None:
    assert (term.text(), term.unit, term.energy) == (text, unit, energy)


def test_energy_is_as_stated_at_all_states() -> None:
    y, v, d, t = states(400)
    for term in LIBRARY:
        power = term.force(y, v, d, t) * v
        if term.energy == "dissipates":
            assert power.min() >= 0.0, term.text()
        if term.energy == "conserves":  # the same force at either direction
            np.testing.assert_array_equal(term.force(y, v, d, t), term.force(y, -v, d, t))


def test_the_drag_of_an_eddy_current_brake_has_its_maximum_at_the_critical_speed() -> None:
    brake = Term("everywhere", ONE, V, fade=0.2, lorentzian=True)
    v = np.linspace(0.0, 1.0, 1001)
    force = brake.force(0 * v, v, 0 * v, 0 * v)
    assert v[np.argmax(force)] == pytest.approx(0.2)
    assert force.max() == pytest.approx(0.1)
    assert force[-1] == pytest.approx(1.0 / 26.0)  # 2 F / (v / u + u / v) with F = u / 2
    faster = replace(brake, fade=0.1)
    assert brake.kind == faster.kind != replace(brake, lorentzian=False).kind


def test_longer_formulas_cost_more() -> None:
    sign, cubic = Term("everywhere", ONE, SIGN), Term("everywhere", Power(3.0, True))
    bump = Term("bump", V, ONE, -1, 2e-3, 5e-4)
    assert 0 < sign.length < cubic.length < bump.length
    assert sign.length / NODE == sign.nodes


def test_units_of_angles() -> None:
    assert angular(Term("everywhere", ONE, DRAG).unit) == "N m s2/rad2"


def test_neighbours_keep_the_kind_and_move_the_shape() -> None:
    bump = Term("bump", V, ONE, -1, 2e-3, 5e-4)
    around = neighbours(bump, 0.5, 6e-3)
    assert len(around) == 8 and all(t.kind == bump.kind and t != bump for t in around)
    assert {round(t.place, 6) for t in around} == {1.75e-3, 2e-3, 2.25e-3}
    assert all(t.region in ("bump", "box") for t in local_starts(LOW, HIGH))


def test_a_report_can_word_the_unit_of_every_term() -> None:
    """One of a power like 2.5 once ended a report."""
    units = {term.unit: term for term in LIBRARY}
    assert "N s/m2.5" in units
    for unit, term in units.items():
        force, speeds = dimensions(unit), term.speed.exponent
        lengths = term.position.exponent + speeds
        assert force == Dimensions(1.0, speeds - term.drift - 2.0, 1.0 - lengths)
        assert dimensions(angular(unit), angle=True) == force
        assert not re.search(r"[A-Za-z]\d", typeset(unit))
        turned = per_mass_unit(angular(unit), angle=True)
        assert turned.replace("rad", "m") == per_mass_unit(unit)
        assert dimensions(per_mass_unit(unit)) == replace(force, mass=0.0)
