"""Modes of the obstacle and of the frame against matrix exponentials, limits and energy."""

from __future__ import annotations

import numpy as np
import pytest
from effect_rigs import BY_ID, TestRig, moved
from scipy.linalg import expm
from scipy.optimize import brentq

TWO_PI = 2 * np.pi


def one(name: str, rig: TestRig, **numbers: float) -> np.ndarray:
    return moved([BY_ID[name]], {f"{name}.{key}": value for key, value in numbers.items()}, rig)


@pytest.mark.parametrize(("frequency", "damping"), [(25.0, 0.02), (70.0, 0.0), (16.5, 1.3)])
def test_two_contacts_and_the_flights_around_them(frequency, damping):
    """y, y', x, x', 1 by matrices: x rings on in flight and is met again at the second touch."""
    rig = TestRig(y0=(0.0,), v0=(0.25,), k2=(5350.0,), duration=0.25, rate=4000.0)
    mass, w = 0.04, TWO_PI * frequency
    y = one("obstacle_mode", rig, mass=mass, frequency=frequency, damping=damping)
    W, drag = w * w, 2 * damping * w
    free, pressed = np.zeros((5, 5)), np.zeros((5, 5))
    for rates in (free, pressed):
        rates[0, 1] = rates[2, 3] = 1.0
        rates[1, :2] = -rig.k1 / rig.mass, -rig.c1 / rig.mass
        rates[3, 2:4] = -W, -drag
    pressed[3, [0, 1, 4]] += W, drag, -W * rig.g
    pressed[1, [0, 1, 4]] -= np.array([rig.k2[0], rig.c2, -rig.k2[0] * rig.g]) / rig.mass
    pressed[1] += mass / rig.mass * np.array([-W, -drag, W, drag, W * rig.g])
    state, t, rates = np.array([rig.y0[0], rig.v0[0], 0.0, 0.0, 1.0]), 0.0, free
    times, expected, contacts = np.arange(rig.count) / rig.rate, [], 0
    while len(expected) < rig.count:
        later, step, sign = 2e-3, expm(rates * 2e-4), 1.0 if rates is free else -1.0
        ahead = expm(rates * later) @ state
        while sign * (ahead[0] - rig.g) <= 0:
            later, ahead = later + 2e-4, step @ ahead

        def height(s: float, rates: np.ndarray = rates, state: np.ndarray = state) -> float:
            return float((expm(rates * s) @ state)[0] - rig.g)

        wait = brentq(height, later - 2e-4, later, xtol=1e-16)
        inside = times[len(expected) :]
        inside = inside[inside < t + wait]
        expected += [(expm(rates * (s - t)) @ state)[0] for s in inside]
        state, t = expm(rates * wait) @ state, t + wait
        contacts += rates is free
        rates = pressed if rates is free else free
    assert contacts >= 2
    assert np.abs(state[2]) > 1e-6 or damping > 1
    np.testing.assert_allclose(y, expected, rtol=0, atol=1e-12)


def test_a_heavy_slow_mass_is_a_spring_to_the_ground():
    """It does not move: force m2 w^2 d + 2 z w m2 v."""
    rig, mass, frequency, damping = TestRig(duration=1.0), 1e7, 1e-3, 8e-6
    w = TWO_PI * frequency
    limit = TestRig(
        duration=1.0,
        c2=rig.c2 + 2 * damping * w * mass,
        k2=tuple(k + mass * w * w for k in rig.k2),
    )
    y = one("obstacle_mode", rig, mass=mass, frequency=frequency, damping=damping)
    assert np.abs(moved([], {}, limit) - moved([], {}, rig)).max() > 1e-5
    np.testing.assert_allclose(y, moved([], {}, limit), rtol=0, atol=1e-8)


@pytest.mark.parametrize(
    ("frequency", "damping"), [(12.0, 0.02), (6.38, 0.0), (2.0, 0.3), (90.0, 1.2)]
)
def test_the_frame_in_coordinates_of_the_room(frequency, damping):
    """Two bodies, frame X and mass y + X, no obstacle: X, X', Y, Y' by one matrix."""
    rig, ratio = TestRig(k2=(), y0=(-5e-3,), v0=(0.02,), duration=3.0), 0.08
    W, drag = (TWO_PI * frequency) ** 2, 2 * damping * TWO_PI * frequency
    y = one("base_motion", rig, frequency=frequency, damping=damping, mass_ratio=ratio)
    between = np.array([-rig.k1, -rig.c1, rig.k1, rig.c1]) / rig.mass
    rates = np.zeros((4, 4))
    rates[0, 1] = rates[2, 3] = 1.0
    rates[1] = ratio * between + np.array([-W, -drag, 0.0, 0.0])
    rates[3] = -between
    step, state = expm(rates / rig.rate), np.array([0.0, 0.0, rig.y0[0], rig.v0[0]])
    expected = []
    for _ in range(rig.count):
        expected.append(state[2] - state[0])
        state = step @ state
    np.testing.assert_allclose(y, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", ["obstacle_mode", "base_motion"])
@pytest.mark.parametrize("frequency", [5.0, 13.0, 40.0])
def test_a_mode_gives_back_no_more_than_it_took(name, frequency):
    """Without any damper no swing gets beyond the release; with one in the mode all of it goes."""
    size = {"obstacle_mode": {"mass": 0.1}, "base_motion": {"mass_ratio": 0.2}}[name]
    rig = TestRig(c1=0.0, c2=0.0, k2=(5350.0,), y0=(-6.5e-3,), v0=(0.0,), duration=4.0)
    free = one(name, rig, frequency=frequency, damping=0.0, **size)
    assert free.min() > rig.y0[0] * (1 + 1e-6)
    assert np.abs(free - moved([], {}, rig)).max() > 1e-4
    damped = one(name, rig, frequency=frequency, damping=0.3, **size)
    assert damped[-1000:].min() > 0.97 * free.min()
    assert damped[-1000:].min() > damped[:1000].min()
