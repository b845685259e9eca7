"""How long does one simulation take, as accurate as ours, with other people's integrators?

    python tests/benchmarks/peers.py

One bundled recording at the mode (6,000 samples, 35 contacts). The reference is our exact
simulator, which `accuracy.py` compares with 50 digits. Every integrator runs at tolerances from
1e-6 to 1e-13; of those that come within 1e-9 m of the reference everywhere, the fastest is timed
again, in turns with ours. All on one core; compilation is not counted. Peers that are not
installed (`pip install ".[bench]"`) are recorded as absent. Writes peers.json beside this file.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

if __name__ == "__main__":  # imports go by the tests' folder, not by this one
    sys.path[0] = str(Path(__file__).resolve().parents[1])

import numpy as np
from benchmarks import recurrence
from benchmarks.bundled import Array, Problem, problem
from benchmarks.record import keep, present, rounds

from bayesimpact.model.exact.simulate import Q, simulate, trajectory

ACCURACY = 1e-9  # m
TOLERANCES = 10.0 ** -np.arange(6, 14)
PEERS = {  # name: module with `solver`, library, method
    "scipy RK45": ("solvers_scipy", "scipy", "RK45"),
    "scipy DOP853": ("solvers_scipy", "scipy", "DOP853"),
    "scipy LSODA": ("solvers_scipy", "scipy", "LSODA"),
    "numbalsoda LSODA, no events": ("solvers_numbalsoda", "numbalsoda", "LSODA"),
    "numbalsoda DOP853": ("solvers_numbalsoda", "numbalsoda", "DOP853"),
    "diffrax Tsit5": ("solvers_diffrax", "diffrax", "Tsit5"),
}

Simulation = Callable[[], Array]


def ours(given: Problem) -> Simulation:
    """Our simulator: () -> (n,) displacement, m."""
    out = np.empty(given.n)

    def run() -> Array:
        trajectory(given.q, given.mass, given.interval, out)
        return out

    return run


def plain(given: Problem) -> Simulation:
    """The plain numba recurrence: () -> (n,) displacement, m."""
    data, out = np.zeros(given.n), np.empty(given.n)

    def run() -> Array:
        recurrence.sum_of_squares(given.q, given.mass, given.interval, data, out)
        return out

    return run


def error(simulation: Simulation, reference: Array) -> float:
    """Largest error of a simulation, m; inf where it failed."""
    try:
        return float(np.max(np.abs(simulation() - reference)))
    except AssertionError:
        return np.inf


def curve(name: str, given: Problem, reference: Array) -> list[dict[str, float]]:
    """Work against precision: tolerance, error in m and seconds, from loose to tight."""
    module, _, method = PEERS[name]
    solver = importlib.import_module(f"benchmarks.{module}").solver
    points = []
    for tolerance in TOLERANCES:
        simulation = solver(given, method, float(tolerance))
        reached = error(simulation, reference)
        if np.isfinite(reached):
            seconds = float(np.median(rounds({name: simulation}, 2, 1)[name]))
            point = {"tolerance": float(tolerance), "error_m": reached, "seconds": seconds}
            points.append(point)
    return points


def fastest(points: list[dict[str, float]]) -> dict[str, float] | None:
    """The fastest point within ACCURACY, None when there is none."""
    good = [point for point in points if point["error_m"] <= ACCURACY]
    return min(good, key=lambda point: point["seconds"], default=None)


def compare(given: Problem, names: list[str]) -> dict[str, Any]:
    """Curves of the peers; then all that are accurate enough, in turns with ours."""
    reference = given.exact()
    curves = {name: curve(name, given, reference) for name in names}
    chosen = {name: fastest(points) for name, points in curves.items()}
    subjects = {"ours": ours(given), "plain recurrence": plain(given)}
    for name, point in chosen.items():
        if point is not None:
            module, _, method = PEERS[name]
            solver = importlib.import_module(f"benchmarks.{module}").solver
            subjects[name] = solver(given, method, point["tolerance"])
    errors = {name: error(simulation, reference) for name, simulation in subjects.items()}
    assert max(errors.values()) <= ACCURACY, errors
    taken = rounds(subjects, 5, 4)
    rows = {
        name: {
            "error_m": errors[name] if name != "ours" else None,
            "us": float(np.median(seconds) * 1e6),
            "over_ours": float(np.median(seconds / taken["ours"])),
            "tolerance": (chosen.get(name) or {}).get("tolerance"),
        }
        for name, seconds in taken.items()
    }
    return {"peers": rows, "curves": curves}


def measure() -> dict[str, Any]:
    """Everything that is kept."""
    given = problem()
    named = dict(zip(Q[:-1], given.q[:-1], strict=True))  # all but the offset
    motion = simulate(mass=given.mass, interval=given.interval, n=given.n, **named)
    found = [name for name, (_, library, _) in PEERS.items() if present(library)]
    return {
        "samples": given.n,
        "contacts": len(motion.impacts),
        "accuracy_m": ACCURACY,
        "absent": sorted(set(PEERS) - set(found)),
        **compare(given, found),
    }


if __name__ == "__main__":
    keep(__file__, measure(), ("scipy", "numbalsoda", "diffrax", "jax"))
