"""Motions that begin anew at given samples, in given states."""

from __future__ import annotations

import numpy as np
import pytest
from effect_rigs import BY_ID, MOVING, TestRig, typical

from bayesimpact.model.effects import Effect
from bayesimpact.model.exact.simulate import simulate
from bayesimpact.model.oscillator import build_oscillator
from bayesimpact.response.measured_motion import lowest_points

RIG = TestRig(duration=3.0)
PLAIN = TestRig(duration=3.0, k2=(), y0=(-6.5e-3,), v0=(0.01,))
PERIOD = 2 * np.pi * (RIG.mass / RIG.k1) ** 0.5
NUMBERS = {"c1": RIG.c1, "k1": RIG.k1, "c2": RIG.c2, "g": RIG.g, "k2": RIG.k2[0]}


def states(y: np.ndarray, v: np.ndarray) -> np.ndarray:
    at = lowest_points(y, 1 / RIG.rate, PERIOD, 1e-6)
    return np.column_stack([at, y[at], v[at]])


def test_each_part_is_a_motion_of_its_own() -> None:
    o = build_oscillator(RIG.campaign())
    theta = RIG.theta(o, {})[None]
    restarts = np.array([[401.0, -5e-3, 0.02], [1000.0, 2e-3, -0.03], [1777.0, RIG.g, 0.1]])
    found = o.predict_restarted(0, theta, restarts)[0]
    ends = [*restarts[:, 0].astype(int), RIG.count]
    first = simulate(mass=RIG.mass, **NUMBERS, y0=RIG.y0[0], v0=0.0, interval=1e-3, n=401)
    np.testing.assert_allclose(found[:401], first.displacement, atol=1e-10)
    for (_, y0, v0), begin, end in zip(restarts, ends[:-1], ends[1:], strict=True):
        part = simulate(
            mass=RIG.mass, **NUMBERS, y0=y0, v0=v0, interval=1e-3, n=end - begin
        ).displacement
        np.testing.assert_allclose(found[begin:end], part, atol=1e-10)


def rig_of(effect: Effect) -> TestRig:
    return PLAIN if effect.id.startswith("pendulum") else RIG


# an input delay needs an input; beside a second mode the probe reads more than the displacement
OTHERS = {"input_delay", "second_mode"}


@pytest.mark.parametrize("effect", [e for e in MOVING if e.id not in OTHERS], ids=lambda e: e.id)
def test_in_the_state_that_it_had_the_motion_goes_on(effect: Effect) -> None:
    """Time, states of laws and of bodies and the number of impacts are not begun anew."""
    rig = rig_of(effect)
    o = build_oscillator(rig.campaign(), [effect])
    theta = rig.theta(o, typical(effect, rig))[None]
    rows, q = np.zeros(1, dtype=np.int64), o.layout.slots(theta)[:, 0]
    y, v = (o.motions_of(rows, q, np.array([order]))[0] for order in (0, 1))
    restarts = states(y, v)
    assert len(restarts) > 12
    whole = o.predict(theta)[0][0]
    np.testing.assert_allclose(o.predict_restarted(0, theta, restarts)[0], whole, atol=2e-7)


@pytest.mark.parametrize("effect_id", ["base_motion", "presliding_friction"])
def test_states_beside_the_mass_jump_with_it(effect_id: str) -> None:
    """Where the mass is put elsewhere, a frame or bristles that follow it are not pulled."""
    effect = BY_ID[effect_id]
    o = build_oscillator(PLAIN.campaign(), [effect])
    theta = PLAIN.theta(o, typical(effect, PLAIN))[None]
    rows, q = np.zeros(1, dtype=np.int64), o.layout.slots(theta)[:, 0]
    y, v = (o.motions_of(rows, q, np.array([order]))[0] for order in (0, 1))
    jump = np.array([[1000.0, y[1000] + 1e-3, v[1000]]])
    moved = o.predict_restarted(0, theta, jump)[0]
    same = o.predict_restarted(0, theta, jump - np.array([0.0, 1e-3, 0.0]))[0]
    # at first only the mass's own spring feels the jump
    pull = 1e-3 * (1.0 - 0.5 * PLAIN.k1 / PLAIN.mass * (1e-3 * np.arange(8)) ** 2)
    np.testing.assert_allclose((moved - same)[1000:1008], pull, atol=2e-6)


def test_without_restarts_nothing_changes() -> None:
    o = build_oscillator(RIG.campaign(), [BY_ID["quadratic_drag"]])
    theta = RIG.theta(o, {"quadratic_drag.coefficient": 0.4})[None]
    np.testing.assert_array_equal(
        o.predict_restarted(1, theta, np.empty((0, 3)))[0], o.predict(theta)[1][0]
    )


def test_lowest_points_are_one_per_period_and_none_in_noise() -> None:
    t = np.arange(4000) * 1e-3
    y = -np.exp(-0.8 * t) * np.cos(2 * np.pi * 5 * t)
    noise = 0.02 * np.random.default_rng(0).standard_normal(t.size)
    found = lowest_points(y, 1e-3, 0.2, 1e-4)
    np.testing.assert_allclose(t[found], 0.2 * np.arange(1, 20), atol=2e-3)
    late = t[lowest_points(y + noise, 1e-3, 0.2, 0.02)]
    assert late.max() < 3.9 and np.diff(late).min() > 0.1
    assert lowest_points(noise, 1e-3, 0.2, 0.02).size <= 2
