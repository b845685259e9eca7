"""Peer: numbalsoda, compiled. DOP853 from event to event; LSODA has none, and steps over the kink.

numbalsoda comes as source and needs a Fortran compiler to install.
"""

from __future__ import annotations

from collections.abc import Callable

import numba
import numpy as np
from benchmarks.bundled import Array, Problem
from numbalsoda import lsoda, lsoda_sig, solve_ivp

MOST_STEPS = 10_000_000


@numba.cfunc(lsoda_sig)
def slope(t, state, change, p):
    """p : damping, stiffness and push away from the stop, the same in contact, the gap."""
    first = 3 if state[0] > p[6] else 0
    change[0] = state[1]
    change[1] = p[first + 2] - p[first] * state[1] - p[first + 1] * state[0]


@numba.cfunc(lsoda_sig)
def slope_of_regime(t, state, change, p):
    """p : damping, stiffness, push of the regime, the gap."""
    change[0] = state[1]
    change[1] = p[2] - p[0] * state[1] - p[1] * state[0]


@numba.cfunc(lsoda_sig)
def crossing(t, state, value, p):
    """Displacement above the stop, m."""
    value[0] = state[0] - p[3]


SLOPE, SLOPE_OF_REGIME, CROSSING = slope.address, slope_of_regime.address, crossing.address


@numba.njit
def march(regimes, gap, start, times, rtol, atol, out):
    """Displacement, m, at `times` (n,) into `out` (n,); regimes (2, 3): away, in contact."""
    t, state, contact, done = 0.0, start.copy(), start[0] > gap, 0
    p = np.empty(4)
    p[3] = gap
    while done < times.size:
        p[:3] = regimes[1] if contact else regimes[0]
        span = np.array([t, times[-1]])
        found = solve_ivp(
            SLOPE_OF_REGIME, span, state, times[done:], "DOP853", 1, CROSSING, p.ctypes.data,
            0.0, 0.0, rtol, atol,
        )  # fmt: skip
        count = found.t.size
        if not found.success or count + found.event_found == 0:
            return False
        out[done : done + count] = found.y[:, 0]
        done += count
        if done < times.size:
            t, state, contact = found.t_event, found.y_event.copy(), not contact
            state[0] = gap
    return True


def solver(problem: Problem, method: str, tolerance: float) -> Callable[[], Array]:
    """A simulation of the problem: () -> (n,) displacement, m; `tolerance` is relative.

    numbalsoda takes one absolute tolerance for all components: that of the displacement.
    """
    times, start = problem.times, np.array(problem.start)
    regimes = np.array([problem.regime(False), problem.regime(True)])
    atol = tolerance * float(problem.scale[0])
    flat = np.append(regimes.ravel(), problem.gap)

    def events() -> Array:
        out = np.empty(times.size)
        assert march(regimes, problem.gap, start, times, tolerance, atol, out)
        return out

    def over_the_kink() -> Array:
        states, success = lsoda(SLOPE, start, times, flat, tolerance, atol, MOST_STEPS)
        assert success
        return states[:, 0]

    return {"DOP853": events, "LSODA": over_the_kink}[method]
