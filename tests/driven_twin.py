"""A driven oscillator integrated by SciPy's DOP853, one sample and one event after the other."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

Law = Callable[[float, float, bool], float]
TIGHT = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14}
QUANTITIES = ("displacement", "velocity", "acceleration")


def no_law(y: float, v: float, touching: bool) -> float:
    """Nothing is added."""
    return 0.0


def driven_motion(
    values: dict[str, float],
    force: np.ndarray,
    interval: float,
    law: Law = no_law,
    corner: bool = False,
) -> tuple[np.ndarray, int]:
    """Displacement (n,), m, and number of events, as `driven_states`."""
    states, events = driven_states(values, force, interval, law, corner)
    return states[0], events


def driven_states(
    values: dict[str, float],
    force: np.ndarray,
    interval: float,
    law: Law = no_law,
    corner: bool = False,
) -> tuple[np.ndarray, int]:
    """Displacement, velocity and acceleration (3, n), SI, and number of events.

    The force (n,) is linear between samples; of an acceleration that jumps at a sample, what
    follows is given.

    values : mass, c1, k1, c2, g, k2, y0, v0, SI; without g there is no stop
    law : an added force on the left-hand side, N, of displacement, velocity and contact
    corner : the law has a kink or a jump at v = 0, on which steps then end
    """
    m, c1, k1 = values["mass"], values["c1"], values["k1"]
    gap, c2, k2 = values.get("g", np.inf), values.get("c2", 0.0), values.get("k2", 0.0)
    state, touching = np.array([values["y0"], values["v0"]]), values["y0"] > gap
    out, events = np.empty((3, force.size)), 0
    sense = float(np.sign(values["v0"])) or 1.0
    # shorter than any contact: its half period is pi / sqrt((k1 + k2) / m)
    longest = min(interval / 3, 0.2 / np.sqrt((k1 + k2) / m))

    def acceleration(push: float, y: float, v: float) -> float:
        pull = push - c1 * v - k1 * y
        if touching:
            pull -= c2 * v + k2 * (y - gap)
        return (pull - law(y, v, touching)) / m

    out[:, 0] = *state, acceleration(force[0], *state)
    for i in range(force.size - 1):
        begin, now, slope = 0.0, force[i], (force[i + 1] - force[i]) / interval
        while begin < interval:

            def rate(t: float, x: np.ndarray) -> list[float]:
                way = sense * abs(x[1]) if corner else x[1]  # noqa: B023
                return [x[1], acceleration(now + slope * t, x[0], way)]  # noqa: B023

            def at_gap(t: float, x: np.ndarray) -> float:
                return float(x[0] - gap) if np.isfinite(gap) else -1.0

            def turns(t: float, x: np.ndarray) -> float:
                return float(x[1]) if corner else 1.0

            at_gap.terminal = turns.terminal = True  # type: ignore[attr-defined]
            at_gap.direction = -1.0 if touching else 1.0  # type: ignore[attr-defined]
            turns.direction = -sense  # type: ignore[attr-defined]
            found = solve_ivp(
                rate, (begin, interval), state, events=(at_gap, turns),
                max_step=longest, **TIGHT,
            )  # fmt: skip
            state, begin = found.y[:, -1].copy(), float(found.t[-1])
            if found.status == 0:
                break
            events += 1
            if found.t_events[0].size:
                state[0], touching = gap, not touching
            else:
                state[1], sense = 0.0, -sense
        out[:, i + 1] = *state, acceleration(force[i + 1], *state)
    return out, events
