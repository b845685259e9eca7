"""The free force's splines against SciPy's, compiled against Python, and in the simulator."""

from __future__ import annotations

import ctypes
import pickle

import numpy as np
import pytest
from effect_rigs import TestRig
from scipy.integrate import solve_ivp
from scipy.interpolate import BSpline

from bayesimpact.diagnosis.residual_force.learned import (
    DEPTHS,
    force,
    learned_contact,
    learned_drift,
    learned_force,
    spline_basis,
)
from bayesimpact.model.effects.effect import address
from bayesimpact.model.oscillator import build_oscillator
from bayesimpact.trial.rig.recordings import Release, Rig, motion

LOW, HIGH, KNOTS = -6.5e-3, 3.5e-3, 12
SPACING = (HIGH - LOW) / (KNOTS - 3)


def scipy_basis(y: np.ndarray) -> np.ndarray:
    knots = LOW + SPACING * np.arange(-3, KNOTS + 1)
    return np.stack([BSpline(knots, row, 3)(y) for row in np.eye(KNOTS)], axis=1)


def test_basis_is_that_of_cubic_splines():
    y = np.linspace(LOW, HIGH, 301)
    np.testing.assert_allclose(spline_basis(y, LOW, SPACING, KNOTS), scipy_basis(y), atol=1e-12)
    np.testing.assert_allclose(spline_basis(y, LOW, SPACING, KNOTS).sum(axis=1), 1.0)


def test_beyond_the_range_the_force_stays_what_it_was_at_the_end():
    outside = spline_basis(np.array([LOW - 1.0, HIGH + 1.0]), LOW, SPACING, KNOTS)
    np.testing.assert_array_equal(outside, spline_basis(np.array([LOW, HIGH]), LOW, SPACING, KNOTS))


def parameters(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.concatenate([[KNOTS, LOW, SPACING, 0.0], a, b])


def test_compiled_force_is_the_python_one_and_the_splines():
    rng = np.random.default_rng(0)
    a, b = rng.standard_normal((2, KNOTS))
    p = parameters(a, b)
    pointer = ctypes.POINTER(ctypes.c_double)
    compiled = ctypes.CFUNCTYPE(ctypes.c_double, *[ctypes.c_double] * 6, pointer, pointer)(
        address(force)
    )
    data = p.ctypes.data_as(pointer)
    for y in [LOW - 1e-3, LOW, 0.0, 0.3e-3, HIGH - 1e-9, HIGH, HIGH + 1e-3]:
        v = float(rng.standard_normal())
        row = spline_basis(np.array([y]), LOW, SPACING, KNOTS)[0]
        expected = row @ a + row @ b * v
        assert force(y, v, 0.0, 0.0, 0.0, 0.0, p, None) == pytest.approx(expected, rel=1e-12)
        found = compiled(y, v, 0.0, 0.0, 0.0, 0.0, data, data)
        assert found == pytest.approx(expected, rel=1e-12)


def coefficients_of_a_line() -> np.ndarray:
    """Coefficients whose spline is y itself: the Greville points."""
    return LOW + SPACING * np.arange(-1, KNOTS - 1)


def test_a_linear_force_is_a_change_of_stiffness_and_damping():
    """a(y) = 8 y, b = 0.02 in the general simulator against the base one with k1 + 8, c1 + 0.02."""
    rig = TestRig(duration=1.0)
    effect = learned_force(LOW, HIGH, 1.0, 1.0, KNOTS)
    values = {f"learned_force.a{i + 1}": 8 * c for i, c in enumerate(coefficients_of_a_line())}
    values |= {f"learned_force.b{i + 1}": 0.02 for i in range(KNOTS)}
    oscillator = build_oscillator(rig.campaign(), [effect])
    found = oscillator.predict(rig.theta(oscillator, values))
    base = build_oscillator(rig.campaign())
    theta = rig.theta(base, {"k1": rig.k1 + 8, "c1": rig.c1 + 0.02})
    for one, other in zip(found, base.predict(theta), strict=True):
        assert np.abs(one).max() <= -LOW  # inside the splines' range
        np.testing.assert_allclose(one, other, atol=1e-10)


def test_steps_resolve_the_knots():
    """A rough force, a hundredth of the elastic one, against SciPy: steps by size alone miss it."""
    rig, knots = TestRig(k2=(), y0=(-6e-3,), v0=(0.0,), duration=1.0), 24
    a, b = np.random.default_rng(1).standard_normal((2, knots)) * [[0.05], [0.05]]
    effect = learned_force(LOW, -LOW, 1.0, 1.0, knots)
    values = {f"learned_force.a{i + 1}": x for i, x in enumerate(a)}
    values |= {f"learned_force.b{i + 1}": x for i, x in enumerate(b)}
    p = np.concatenate([[knots, LOW, -2 * LOW / (knots - 3), 0.0], a, b])

    def right(t: float, x: np.ndarray) -> list[float]:
        added = force(x[0], x[1], 0.0, t, 0.0, 0.0, p, None)
        return [x[1], -(rig.c1 * x[1] + rig.k1 * x[0] + added) / rig.mass]

    oscillator = build_oscillator(rig.campaign(), [effect])
    found = oscillator.predict(rig.theta(oscillator, values))[0]
    times, start = np.arange(found.size) / rig.rate, [rig.y0[0], rig.v0[0]]
    exact = solve_ivp(
        right, (0, times[-1]), start, "DOP853", times, rtol=1e-9, atol=1e-13, max_step=1e-3
    ).y[0]
    assert np.abs(found - exact).max() < 1e-8


def test_its_priors_and_names():
    effect = learned_force(LOW, HIGH, 2e-3, 5e-2, KNOTS)
    free = [p for p in effect.parameters if p.fixed is None]
    assert [p.name for p in free[:2]] == ["a1", "a2"] and free[-1].name == f"b{KNOTS}"
    assert {p.scale(TestRig().scales()) for p in free[:KNOTS]} == {2e-3}
    assert {p.scale(TestRig().scales()) for p in free[KNOTS:]} == {5e-2}
    assert effect.family == "unknown"


def contact_values(a: np.ndarray, b: float) -> dict[str, float]:
    values = {f"learned_force.a{i + 1}": float(x) for i, x in enumerate(a)}
    return values | {f"learned_force.b{i + 1}": b for i in range(DEPTHS)}


def test_a_linear_force_in_contact_is_a_stiffer_obstacle():
    """a(d) = 40 d, b = 0.5 against the base model with k2 + 40, c2 + 0.5."""
    rig, depth = TestRig(duration=1.0), 4e-3
    line = 40 * depth / (DEPTHS - 3) * np.arange(-1, DEPTHS - 1)
    oscillator = build_oscillator(rig.campaign(), [learned_contact(depth, 1.0, 1.0)])
    found = oscillator.predict(rig.theta(oscillator, contact_values(line, 0.5)))
    base = build_oscillator(rig.campaign())
    stiffer = {f"k2[{i}]": k + 40 for i, k in enumerate(rig.k2)}
    theta = rig.theta(base, stiffer | {"c2": rig.c2 + 0.5})
    for one, other in zip(found, base.predict(theta), strict=True):
        assert rig.g < one.max() < rig.g + depth  # inside the splines' range
        np.testing.assert_allclose(one, other, atol=1e-10)


def test_a_constant_force_in_contact_is_the_independent_rigs_preload():
    rig, force = TestRig(duration=1.0), 0.05
    oscillator = build_oscillator(rig.campaign(), [learned_contact(3e-3, 1.0, 1.0)])
    values = contact_values(np.full(DEPTHS, force), 0.0)
    found = oscillator.predict(rig.theta(oscillator, values))[0]
    other = Rig(rig.mass, rig.c1, rig.k1, c2=rig.c2, g=rig.g, k2={"0": rig.k2[0]})
    release = Release("r0", "0", rig.y0[0], rig.v0[0])
    preload = {"contact_preload": {"force": force}}
    expected = motion(
        other, release, preload, rate=rig.rate, duration=rig.duration, rtol=1e-12, atol=1e-15
    ).displacement
    np.testing.assert_allclose(found, expected, atol=1e-9)


@pytest.mark.parametrize(
    "effect",
    [learned_force(LOW, HIGH, 0.3, 0.02), learned_drift(2.0, 6e-3, 0.3, 0.02),
     learned_contact(1e-3, 0.3, 0.02)],
)  # fmt: skip
def test_a_learned_force_can_be_pickled(effect):
    again = pickle.loads(pickle.dumps(effect))
    assert [(p.name, p.fixed, p.scale) for p in again.parameters] == [
        (p.name, p.fixed, p.scale) for p in effect.parameters
    ]
    assert (again.law, again.equation) == (effect.law, effect.equation)
    widths = {p.unit: p.scale(None) for p in again.parameters if p.fixed is None}
    assert widths == {"N": 0.3, "N s/m": 0.02}
