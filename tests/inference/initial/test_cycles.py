"""One cycle in closed form against SciPy's integrator with events."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bayesimpact.inference.initial.cycles import cycle

BASE = {"mass": 0.503, "c1": 0.148, "k1": 808.556, "c2": 2.085, "g": 1.1e-3, "k2": 5350.156}


def integrated(depth: float, mass: float, c1: float, k1: float, c2: float, g: float, k2: float):
    """Length, next depth and height by DOP853, stopped at every event."""

    def leg(start: float, state: list[float], on: bool, event):
        def force(_t, s):
            stop = c2 * s[1] + k2 * (s[0] - g) if on else 0.0
            return [s[1], -(c1 * s[1] + k1 * s[0] + stop) / mass]

        return solve_ivp(
            force, (start, start + 50), state, "DOP853", events=event, rtol=1e-12, atol=1e-16
        )

    def crossing(direction: int, value):
        def event(_t, s):
            return value(s)

        event.terminal, event.direction = True, direction
        return event

    height = g
    flight = leg(0.0, [-depth, 0.0], False, [crossing(1, lambda s: s[0] - g)])
    rise = leg(flight.t[-1], flight.y[:, -1], True, [crossing(-1, lambda s: s[1])])
    height = rise.y[0, -1]
    fall = leg(rise.t[-1], rise.y[:, -1], True, [crossing(-1, lambda s: s[0] - g)])
    back = leg(fall.t[-1], fall.y[:, -1], False, [crossing(1, lambda s: s[1])])
    return back.t[-1], -back.y[0, -1], height


@pytest.mark.parametrize(
    "changed",
    [
        {},
        {"g": 0.0},
        {"g": -1e-3},
        {"c1": 0.0, "c2": 0.0},
        {"k2": 3e5},
        {"c2": 150.0},  # overdamped on the stop
        {"c2": 2 * np.sqrt(0.503 * (808.556 + 5350.156)) - 0.148},  # critical
        {"k2": -600.0, "c2": -0.1, "g": 3e-3},  # softer beyond g, as a mirrored preloaded rig
    ],
)
def test_agrees_with_an_integrator(changed: dict[str, float]) -> None:
    p = BASE | changed
    length, after, height = integrated(6.5e-3, **p)
    end = cycle(np.array([6.5e-3]), **p)
    assert end.impact[0]
    assert end.length[0] == pytest.approx(length, rel=1e-7)
    assert end.depth[0] == pytest.approx(after, rel=1e-7)
    assert end.height[0] == pytest.approx(height, rel=1e-7)


def test_without_touch_it_is_a_free_decay() -> None:
    p = BASE | {"g": 6.6e-3}
    end = cycle(np.array([6.5e-3]), **p)
    b = p["c1"] / (2 * p["mass"])
    w = np.sqrt(p["k1"] / p["mass"] - b**2)
    assert not end.impact[0]
    assert end.length[0] == pytest.approx(2 * np.pi / w, rel=1e-12)
    assert end.depth[0] == pytest.approx(6.5e-3 * np.exp(-2 * np.pi * b / w), rel=1e-12)


@pytest.mark.parametrize("c2", [60.0, 200.0])  # under- and overdamped on the stop
def test_a_mass_that_stays_on_the_stop_has_no_cycle(c2: float) -> None:
    end = cycle(np.array([1e-3]), 1.0, 0.1, 100.0, c2, -9e-4, 3000.0)
    assert np.isnan(end.length[0])


def test_arrays_are_cycles() -> None:
    depth = np.array([2e-3, 4e-3, 6e-3])
    together = cycle(depth, 0.503, 0.148, 808.556, 2.085, 1.1e-3, np.array([5e3, 4e3, 3e3]))
    for i, (d, k2) in enumerate(zip(depth, (5e3, 4e3, 3e3), strict=True)):
        alone = cycle(np.array([d]), 0.503, 0.148, 808.556, 2.085, 1.1e-3, k2)
        assert together.length[i] == pytest.approx(alone.length[0], rel=1e-13)
        assert together.height[i] == pytest.approx(alone.height[0], rel=1e-13)
