"""Peer: scipy.integrate.solve_ivp, from one terminal event to the next."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from benchmarks.bundled import Array, Problem
from scipy.integrate import solve_ivp


def solver(problem: Problem, method: str, tolerance: float) -> Callable[[], Array]:
    """A simulation of the problem: () -> (n,) displacement, m; `tolerance` is relative."""
    times, gap = problem.times, problem.gap
    settings = {"method": method, "rtol": tolerance, "atol": tolerance * problem.scale}

    def crossing(t, state, *_):
        return state[0] - gap

    def slope(t, state, damping, stiffness, push):
        return state[1], push - damping * state[1] - stiffness * state[0]

    crossing.terminal = True

    def simulate() -> Array:
        out = np.empty(times.size)
        t, state, contact, done = 0.0, np.array(problem.start), problem.start[0] > gap, 0
        while done < times.size:
            crossing.direction = -1.0 if contact else 1.0
            found = solve_ivp(
                slope, (t, times[-1]), state, t_eval=times[done:], events=crossing,
                args=problem.regime(contact), **settings,
            )  # fmt: skip
            assert found.success
            count = len(found.t)
            if count:
                out[done : done + count] = found.y[0]
            done += count
            if done < times.size:
                t, state = found.t_events[0][0], found.y_events[0][0]
                state[0], contact = gap, not contact
        return out

    return simulate
