"""Velocities and accelerations under a measured input, of both simulators, against DOP853."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from driven_twin import QUANTITIES, driven_states
from scipy.integrate import solve_ivp
from test_driven import INTERVAL, LAWS, VALUES, _force, _theta

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.input import Input
from bayesimpact.data.recording import Recording
from bayesimpact.model.effects import EFFECTS
from bayesimpact.model.exact.sensitivities.derivatives import grams, trajectories_and_derivatives
from bayesimpact.model.exact.simulate import predictions, sums_of_squares
from bayesimpact.model.oscillator import Oscillator, build_oscillator

FREE = {name: VALUES[name] for name in ("mass", "c1", "k1", "y0", "v0")}
DERIVED = QUANTITIES[1:]
KINDS = ("sensitivity_pass", "steps", "noise")


def _oscillator(given: Input, quantity: Any, *, stop: bool, effect: str = "") -> Oscillator:
    samples, case = np.zeros(given.samples.size), "1" if stop else ""
    recording = Recording("a", case, samples, INTERVAL, quantity=quantity, input=given)
    effects = [e for e in EFFECTS if e.id == effect]
    return build_oscillator(Campaign("rig", VALUES["mass"], (recording,), stop=stop), effects)


def _arguments(oscillator: Oscillator) -> tuple[Any, ...]:
    columns, constants = oscillator.layout.columns[:, :11], oscillator.layout.constants[:, :11]
    return columns, constants, VALUES["mass"]


@pytest.mark.parametrize("quantity", DERIVED)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("stop", [False, True])
def test_against_an_independent_integrator(quantity: str, kind: str, stop: bool) -> None:
    force = _force(kind)
    states, events = driven_states(VALUES if stop else FREE, force, INTERVAL)
    exact = states[QUANTITIES.index(quantity)]
    oscillator = _oscillator(Input(force, free=True), quantity, stop=stop)
    (found,) = oscillator.predict(_theta(oscillator))
    assert (events > 6) == stop
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-11 * np.ptp(exact))
    data = exact + 1e-3
    sums, _ = sums_of_squares(
        _theta(oscillator)[None], *_arguments(oscillator), data, [0], [force.size], [INTERVAL],
        oscillator.orders, oscillator.inputs,
    )  # fmt: skip
    assert sums[0, 0] == pytest.approx(force.size * 1e-6, rel=1e-6)


def test_an_impact_within_one_sample() -> None:
    force = np.zeros(12)
    values = {**VALUES, "g": 1e-3, "k2": 4e7, "y0": 0.5e-3, "v0": 1.0}
    states, events = driven_states(values, force, INTERVAL)
    assert events == 2
    for quantity, exact in zip(QUANTITIES, states, strict=True):
        oscillator = _oscillator(Input(force, free=True), quantity, stop=True)
        (found,) = oscillator.predict(_theta(oscillator, **values))
        np.testing.assert_allclose(found, exact, rtol=0, atol=1e-9 * np.ptp(exact))


def test_an_acceleration_jumps_with_the_damping_of_the_contact() -> None:
    """Just before and just after a release of the contact under a constant force."""
    force = np.full(2, 3.0)
    beside = {}
    for side in (-1.0, 1.0):
        values = {**VALUES, "y0": VALUES["g"] + side * 1e-12, "v0": -side * 0.05}
        oscillator = _oscillator(Input(force, free=True), "acceleration", stop=True)
        beside[side] = float(oscillator.predict(_theta(oscillator, **values))[0][0])
    pushed = 3.0 - 0.3 * 0.05 - 800.0 * 1.1e-3
    assert beside[-1.0] == pytest.approx(pushed / 0.5, rel=1e-6)
    pulled = 3.0 + (0.3 + 2.0) * 0.05 - 800.0 * 1.1e-3
    assert beside[1.0] == pytest.approx(pulled / 0.5, rel=1e-6)


@pytest.mark.parametrize("quantity", DERIVED)
@pytest.mark.parametrize("kind", ["sensitivity_pass", "noise"])
@pytest.mark.parametrize(
    ("effect", "stop"),
    [
        ("spring_cubic", False),
        ("spring_cubic", True),
        ("quadratic_drag", True),
        ("contact_damping_indentation", True),
    ],
)
def test_with_an_added_force(quantity: str, kind: str, effect: str, stop: bool) -> None:
    force, (own, law, corner) = _force(kind), LAWS[effect]
    states, _ = driven_states(VALUES if stop else FREE, force, INTERVAL, law, corner)
    exact = states[QUANTITIES.index(quantity)]
    oscillator = _oscillator(Input(force, free=True), quantity, stop=stop, effect=effect)
    theta = _theta(oscillator, **{f"{effect}.{name}": value for name, value in own.items()})
    (found,) = oscillator.predict(theta)
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-8 * np.ptp(exact))


@pytest.mark.parametrize("absolute", [False, True])
@pytest.mark.parametrize("hold", [False, True])
@pytest.mark.parametrize("quantity", QUANTITIES)
def test_both_simulators_agree(quantity: str, hold: bool, absolute: bool) -> None:
    base = 1e-3 * np.cumsum(_force("sensitivity_pass", 600)) / 60
    given = Input(base, "base_m", free=True, band_limited=hold, absolute=absolute)
    plain = _oscillator(given, quantity, stop=True)
    added = _oscillator(given, quantity, stop=True, effect="spring_cubic")
    (one,) = plain.predict(_theta(plain))
    (other,) = added.predict(_theta(added, **{"spring_cubic.stiffness": 0.0}))
    np.testing.assert_allclose(other, one, rtol=0, atol=1e-8 * np.ptp(one))


@pytest.mark.parametrize("absolute", [False, True])
@pytest.mark.parametrize("quantity", QUANTITIES)
def test_the_base_is_added_where_the_motion_in_space_is_read(quantity: str, absolute: bool) -> None:
    """Against the motion in space itself, integrated without any relative coordinate."""
    times = np.arange(400) * INTERVAL
    w = np.array([23.0, 41.0])
    size = np.array([1.1e-3, 0.4e-3])

    def base(t: Any, order: int = 0) -> Any:
        angle = np.multiply.outer(t, w) + 0.5 * np.pi * order
        return np.sin(angle) @ (size * w**order)

    def rate(t: float, x: np.ndarray) -> list[float]:
        pull = 0.3 * (x[1] - base(t, 1)) + 800.0 * (x[0] - base(t))
        return [x[1], -pull / 0.5]

    start = [1e-4, 0.02 + base(0.0, 1)]
    place = solve_ivp(
        rate, (0.0, times[-1]), start, "DOP853", times, rtol=1e-11, atol=1e-13, max_step=INTERVAL
    ).y
    states = np.stack([*place, [rate(t, x)[1] for t, x in zip(times, place.T, strict=True)]])
    order = QUANTITIES.index(quantity)
    exact = states[order] - (0.0 if absolute else base(times, order))
    given = Input(base(times), "base_m", free=True, absolute=absolute)
    oscillator = _oscillator(given, quantity, stop=False)
    theta = _theta(oscillator)
    (found,) = oscillator.predict(theta)
    # lines between samples 16 intervals apart on the base's faster part
    np.testing.assert_allclose(found, exact, rtol=0, atol=2e-3 * np.ptp(exact))
    inside = oscillator.displacements(theta)[0]
    np.testing.assert_allclose(inside, states[0] - base(times), rtol=0, atol=1e-5)


def test_an_acceleration_holds_a_band_limited_force_as_its_samples_say() -> None:
    """Lines through sharpened samples move the mass; at a sample the sample itself acts."""
    times = np.arange(500) * INTERVAL
    w = 2 * np.pi * np.array([31.0, 97.0, 140.0])  # up to 3.6 samples a period

    def force(t: Any) -> Any:
        return np.sin(np.multiply.outer(t, w) + np.arange(3.0)).sum(axis=-1)

    def rate(t: float, x: np.ndarray) -> list[float]:
        return [x[1], (force(t) - 0.3 * x[1] - 800.0 * x[0]) / 0.5]

    place = solve_ivp(
        rate, (0.0, times[-1]), [1e-4, 0.02], "DOP853", times, rtol=1e-11, atol=1e-13,
        max_step=INTERVAL,
    ).y  # fmt: skip
    exact = np.array([rate(t, x)[1] for t, x in zip(times, place.T, strict=True)])
    root = -0.3 / 2 / 0.5 + 1j * np.sqrt(800.0 / 0.5 - (0.3 / 2 / 0.5) ** 2)
    free = np.exp(root * times)[50:-50]  # what the ends, mirrored for the filter, set going
    errors = {}
    for hold in (False, True):
        given = Input(force(times), free=True, band_limited=hold)
        oscillator = _oscillator(given, "acceleration", stop=False)
        error = (oscillator.predict(_theta(oscillator))[0] - exact)[50:-50]
        basis = np.column_stack([free.real, free.imag])
        left = error - basis @ np.linalg.lstsq(basis, error, rcond=None)[0]
        errors[hold] = np.ptp(left) / np.ptp(exact)
    assert errors[True] < 5e-5 and errors[True] < 0.2 * errors[False], errors
    shown = Input(force(times), band_limited=True)
    sharpening = shown.force(0.5, INTERVAL) - shown.samples
    assert np.ptp(sharpening) / 0.5 > 0.1 * np.ptp(exact)  # what the held force would err by


@pytest.mark.parametrize("kind", ["force_N", "base_m_s2"])
def test_dry_friction_holds_an_accelerometer_on_the_base(kind: Any) -> None:
    """A mass that sticks has no acceleration of its own, whatever is drawn between samples."""
    push = 0.4 * np.sin(0.9 * np.arange(200))
    absolute = kind != "force_N"
    given = Input(push, kind, free=True, band_limited=True, absolute=absolute)
    oscillator = _oscillator(given, "acceleration", stop=False, effect="coulomb_friction")
    theta = _theta(oscillator, **{"coulomb_friction.force": 2.0, "y0": 0.0, "v0": 0.0})
    (found,) = oscillator.predict(theta)
    np.testing.assert_array_equal(found, push if absolute else 0.0)


@pytest.mark.parametrize("absolute", [False, True])
@pytest.mark.parametrize("quantity", QUANTITIES)
@pytest.mark.parametrize("kind", ["sensitivity_pass", "steps"])
@pytest.mark.parametrize("stop", [False, True])
def test_derivatives(quantity: str, kind: str, stop: bool, absolute: bool) -> None:
    given = Input(_force(kind), free=True, band_limited=kind == "steps")
    if absolute:
        base = np.cumsum(np.cumsum(given.samples - given.samples.mean())) * INTERVAL**2 * 2
        given = replace(given, samples=base, kind="base_m", absolute=True)
    oscillator = _oscillator(given, quantity, stop=stop)
    theta, n = _theta(oscillator, offset=2e-4), given.samples.size
    columns, *rest = _arguments(oscillator)
    rest = [*rest, [n], [INTERVAL], n, oscillator.orders, oscillator.inputs]
    values, jacobian, codes = trajectories_and_derivatives(theta, columns, *rest)
    assert codes[0] == 0
    (read,) = oscillator.predict(theta)
    np.testing.assert_allclose(values, read, rtol=0, atol=1e-13 * np.ptp(read))
    for slot, column in enumerate(columns[0]):
        if column < 0:
            assert not jacobian[:, slot].any()
            continue
        size = abs(theta[column])
        step = 1e-6 * max(size, 1e-3) if column != oscillator.layout.index("offset[a]") else 1.0
        points = theta + step * np.array([-2.0, -1.0, 1.0, 2.0])[:, None] * (
            np.arange(theta.size) == column
        )
        a, b, c, d = predictions(points, columns, *rest)[0]
        slope = (8 * (c - b) - (d - a)) / (12 * step)
        error = np.abs(slope - jacobian[:, slot]) / np.abs(slope).max()
        # a difference across a contact's onset beside a sample is none
        assert np.sort(error)[-3] < 1e-6, (slot, error.max())
    data = read + 1e-3 * np.ptp(read) * np.random.default_rng(0).standard_normal(n)
    found, _ = grams(
        theta, *_arguments(oscillator), data, [0], [n], [INTERVAL], oscillator.orders,
        oscillator.inputs,
    )  # fmt: skip
    rows = np.column_stack([jacobian, data - values])
    size = np.sqrt(np.maximum(np.diag(rows.T @ rows), 1e-300))
    np.testing.assert_allclose(
        found[0] / np.outer(size, size), rows.T @ rows / np.outer(size, size), atol=1e-9
    )
