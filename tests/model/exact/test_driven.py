"""The simulator under a measured input: against an independent integrator, and its derivatives."""

from __future__ import annotations

from dataclasses import replace

import mpmath
import numpy as np
import pytest
from driven_twin import Law, driven_motion

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.input import Input
from bayesimpact.data.recording import Recording
from bayesimpact.model.effects import EFFECTS
from bayesimpact.model.exact.driven import responses
from bayesimpact.model.exact.sensitivities.derivatives import grams, trajectories_and_derivatives
from bayesimpact.model.exact.simulate import predictions, sums_of_squares
from bayesimpact.model.oscillator import Oscillator, build_oscillator

VALUES = {
    "mass": 0.5, "c1": 0.3, "k1": 800.0, "c2": 2.0, "g": 1.1e-3, "k2": 5000.0,
    "y0": 1e-4, "v0": 0.02,
}  # fmt: skip
INTERVAL = 2e-3


def _force(kind: str, n: int = 400) -> np.ndarray:
    t = np.arange(n) * INTERVAL
    if kind == "sensitivity_pass":
        return 1.5 * np.sin(2 * np.pi * (2.0 * t + 6.0 * t**2))
    if kind == "steps":
        return 4.0 * (np.floor(t / 0.15) % 2)
    return 3.0 * np.random.default_rng(4).standard_normal(n)


def _oscillator(
    force: np.ndarray,
    *,
    stop: bool,
    effect: str = "",
    free: bool = True,
    interval: float = INTERVAL,
) -> Oscillator:
    recording = Recording(
        "a", "1" if stop else "", np.zeros(force.size), interval, input=Input(force, free=free)
    )
    effects = [e for e in EFFECTS if e.id == effect]
    return build_oscillator(Campaign("rig", VALUES["mass"], (recording,), stop=stop), effects)


def _theta(oscillator: Oscillator, **more: float) -> np.ndarray:
    known = {**VALUES, "input_gain": 1.0, "offset": 0.0, "sigma": 1.0, **more}
    names = oscillator.layout.names
    return np.array([known[n] if n in known else known[n.split("[")[0]] for n in names])


@pytest.mark.parametrize("kind", ["sensitivity_pass", "steps", "noise"])
@pytest.mark.parametrize("stop", [False, True])
def test_against_an_independent_integrator(kind: str, stop: bool) -> None:
    force = _force(kind)
    values = VALUES if stop else {k: v for k, v in VALUES.items() if k not in ("g", "c2", "k2")}
    exact, events = driven_motion(values, force, INTERVAL)
    oscillator = _oscillator(force, stop=stop)
    (found,) = oscillator.predict(_theta(oscillator))
    assert (events > 6) == stop
    np.testing.assert_allclose(found, exact, atol=1e-11)


def test_an_impact_within_one_sample() -> None:
    force = np.zeros(12)
    values = {**VALUES, "g": 1e-3, "k2": 4e7, "y0": 0.5e-3, "v0": 1.0}
    exact, events = driven_motion(values, force, INTERVAL)
    oscillator = _oscillator(force, stop=True)
    (found,) = oscillator.predict(_theta(oscillator, **values))
    assert events == 2
    np.testing.assert_allclose(found, exact, atol=1e-11)


LAWS: dict[str, tuple[dict[str, float], Law, bool]] = {
    "spring_cubic": ({"stiffness": 4e6}, lambda y, v, touching: 4e6 * y**3, False),
    "quadratic_drag": ({"coefficient": 3.0}, lambda y, v, touching: 3.0 * abs(v) * v, True),
    "contact_damping_indentation": (
        {"coefficient": 900.0},
        lambda y, v, touching: 900.0 * (y - VALUES["g"]) * v * touching,
        False,
    ),
}


@pytest.mark.parametrize("effect", ["spring_cubic", "quadratic_drag"])
@pytest.mark.parametrize("stop", [False, True])
@pytest.mark.parametrize("kind", ["sensitivity_pass", "noise"])
def test_with_an_added_force(effect: str, stop: bool, kind: str) -> None:
    own, law, corner = LAWS[effect]
    _compare(effect, own, law, stop=stop, kind=kind, corner=corner)


@pytest.mark.parametrize("kind", ["steps", "noise"])
def test_with_an_added_force_in_contact(kind: str) -> None:
    own, law, _ = LAWS["contact_damping_indentation"]
    _compare("contact_damping_indentation", own, law, stop=True, kind=kind, corner=False)


def _compare(
    effect: str, own: dict[str, float], law: Law, *, stop: bool, kind: str, corner: bool
) -> None:
    force = _force(kind)
    values = VALUES if stop else {k: v for k, v in VALUES.items() if k not in ("g", "c2", "k2")}
    exact, _ = driven_motion(values, force, INTERVAL, law, corner)
    oscillator = _oscillator(force, stop=stop, effect=effect)
    theta = _theta(oscillator, **{f"{effect}.{name}": value for name, value in own.items()})
    (found,) = oscillator.predict(theta)
    np.testing.assert_allclose(found, exact, atol=1e-9)


def test_dry_friction_holds_until_the_input_exceeds_it() -> None:
    force = np.concatenate([np.linspace(0.0, 2.0, 200), np.full(200, 2.0)])
    oscillator = _oscillator(force, stop=False, effect="coulomb_friction")
    theta = _theta(oscillator, **{"coulomb_friction.force": 1.0, "y0": 0.0, "v0": 0.0})
    (found,) = oscillator.predict(theta)
    held = force <= 1.0
    assert np.all(found[held] == 0.0) and np.all(found[~held][1:] > 0.0)
    values = {"mass": 0.5, "c1": 0.3, "k1": 800.0, "y0": 0.0, "v0": 0.0}
    freed = 199.0 * 0.5 * INTERVAL  # 2 N over 199 intervals reach 1 N there
    first = int(np.ceil(freed / INTERVAL))
    slope = 2.0 / 199.0 / INTERVAL
    start = first * INTERVAL - freed
    from scipy.integrate import solve_ivp

    lead = solve_ivp(
        lambda t, x: [x[1], (slope * t - 0.3 * x[1] - 800.0 * x[0]) / 0.5],
        (0.0, start), [0.0, 0.0], method="DOP853", rtol=1e-12, atol=1e-16,
    )  # fmt: skip
    values |= {"y0": float(lead.y[0, -1]), "v0": float(lead.y[1, -1])}
    exact, _ = driven_motion(values, force[first:] - 1.0, INTERVAL)
    moving = slice(first, first + 60)  # until it turns
    np.testing.assert_allclose(found[moving], exact[:60], atol=1e-9)


@pytest.mark.parametrize("stop", [False, True])
def test_both_simulators_agree(stop: bool) -> None:
    force = _force("noise", 3000)
    plain = _oscillator(force, stop=stop)
    added = _oscillator(force, stop=stop, effect="spring_cubic")
    (one,) = plain.predict(_theta(plain))
    (other,) = added.predict(_theta(added, **{"spring_cubic.stiffness": 0.0}))
    np.testing.assert_allclose(other, one, atol=1e-10)


@pytest.mark.parametrize("stop", [False, True])
def test_derivatives(stop: bool) -> None:
    force = _force("sensitivity_pass")
    oscillator = _oscillator(force, stop=stop)
    theta = _theta(oscillator, offset=2e-4)
    columns, constants = oscillator.layout.columns[:, :11], oscillator.layout.constants[:, :11]
    rest = (VALUES["mass"], [force.size], [INTERVAL], force.size, None, oscillator.inputs)
    values, jacobian, codes = trajectories_and_derivatives(theta, columns, constants, *rest)
    assert codes[0] == 0
    np.testing.assert_allclose(values, oscillator.predict(theta)[0], atol=1e-15)
    for slot, column in enumerate(columns[0]):
        if column < 0:
            assert not jacobian[:, slot].any()
            continue
        step = 1e-5 * max(abs(theta[column]), 1e-3)
        points = theta + step * np.array([-2.0, -1.0, 1.0, 2.0])[:, None] * (
            np.arange(theta.size) == column
        )
        a, b, c, d = predictions(points, columns, constants, *rest)[0]
        slope = (8 * (c - b) - (d - a)) / (12 * step)
        error = np.abs(slope - jacobian[:, slot]).max() / np.abs(slope).max()
        assert error < 2e-7, (slot, error)


def test_products_of_derivatives() -> None:
    force = _force("steps")
    oscillator = _oscillator(force, stop=True)
    theta = _theta(oscillator)
    columns, constants = oscillator.layout.columns[:, :11], oscillator.layout.constants[:, :11]
    data = 1e-3 * np.random.default_rng(0).standard_normal(force.size)
    one = (VALUES["mass"], data, [0], [force.size], [INTERVAL], None, oscillator.inputs)
    rest = (VALUES["mass"], [force.size], [INTERVAL], force.size, None, oscillator.inputs)
    values, jacobian, _ = trajectories_and_derivatives(theta, columns, constants, *rest)
    rows = np.column_stack([jacobian, data - values])
    found, _ = grams(theta, columns, constants, *one)
    np.testing.assert_allclose(found[0], rows.T @ rows, rtol=1e-9, atol=1e-15)
    sums, _ = sums_of_squares(theta[None], columns, constants, *one)
    assert sums[0, 0] == pytest.approx(float(np.sum((data - values) ** 2)), rel=1e-12)


def test_a_free_decay_beside_a_driven_recording() -> None:
    force = _force("sensitivity_pass")
    free = Recording("b", "1", np.zeros(300), INTERVAL)
    driven = _oscillator(force, stop=True).campaign.recordings[0]
    both = build_oscillator(Campaign("rig", VALUES["mass"], (free, driven)))
    alone = _oscillator(force, stop=True)
    first, second = both.predict(_theta(both))
    decay = build_oscillator(Campaign("rig", VALUES["mass"], (free,)))
    np.testing.assert_array_equal(second, alone.predict(_theta(alone))[0])
    np.testing.assert_array_equal(first, decay.predict(_theta(decay))[0])


def test_the_gain_is_an_unknown_only_where_it_is_free() -> None:
    force = _force("sensitivity_pass")
    known, free = (_oscillator(force, stop=False, free=free) for free in (False, True))
    assert "input_gain" in free.layout.names and "input_gain" not in known.layout.names
    (one,) = known.predict(_theta(known))
    doubled = replace(known.campaign.recordings[0], input=Input(0.5 * force, free=True))
    other = build_oscillator(replace(known.campaign, recordings=(doubled,)))
    (two,) = other.predict(_theta(other, input_gain=2.0))
    np.testing.assert_allclose(two, one, atol=1e-15)


@pytest.mark.parametrize(("beta", "K"), [(1e-4, 1e-5), (0.02, 0.2), (0.4, 3.0), (5.0, 0.7)])
@pytest.mark.parametrize("t", [1e-3, 0.4, 1.0, 3.0])
def test_responses_are_what_they_say(beta: float, K: float, t: float) -> None:
    # y' = v, v' = -K y - beta v + input, for the inputs 0 (S), 1 (B) and t (R), S (G), their
    # integrals (P, Q), as one linear system
    with mpmath.workdps(40):
        A = mpmath.zeros(10)
        b, k = mpmath.mpf(beta), mpmath.mpf(K)
        A[0, 1], A[1, 0], A[1, 1] = 1, -k, -b  # S, S'
        A[2, 0] = 1  # B is the integral of S
        A[3, 2] = 1  # R of B
        A[4, 5], A[5, 4], A[5, 5], A[5, 0] = 1, -k, -b, 1  # G, G'
        A[6, 4] = 1
        A[7, 6] = 1
        state = mpmath.expm(A * mpmath.mpf(t), method="taylor")[:, 1]
        exact = [float(state[i]) for i in (0, 1, 2, 3, 4, 5, 6, 7)]
    found = responses(beta, K, t)
    names = ("S", "D", "B", "R", "G", "H", "P", "Q")
    values = [getattr(found, name) for name in names]
    np.testing.assert_allclose(values, exact, rtol=1e-9)
