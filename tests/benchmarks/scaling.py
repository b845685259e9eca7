"""How does the cost of a likelihood grow with samples, recordings, impacts, batch and threads?

    python tests/benchmarks/scaling.py

Every series grows one thing and keeps the rest, on one thread; `slope` is that of log time against
log size: 1 is linear, less means that fixed costs are spread. Before a series is timed, its first
and last member are compared with the plain recurrence. Samples and recordings stand beside the
floor (a sum over two stored arrays), which shows what of a bend is the memory's. Impacts: the same
number of undamped samples spans ever more time; what remains of the cost without a stop is the
impacts'. Threads: the same batch on one and on all, by the wall clock, which needs an idle machine,
and by processor time, which shows what sharing out the work costs however busy the machine is.
Times are the fastest of several, in processor time but for the threads. Writes scaling.json beside
this file.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

if __name__ == "__main__":  # imports go by the tests' folder, not by this one
    sys.path[0] = str(Path(__file__).resolve().parents[1])

import numba
import numpy as np
from benchmarks import recurrence
from benchmarks.kernel import MASS, campaign
from benchmarks.record import keep, rounds, slope

from bayesimpact.model.exact.simulate import simulate, sums_of_squares

SAMPLES = (600, 2_000, 6_000, 20_000, 60_000)
RECORDINGS = (9, 30, 99, 300, 999)
INTERVALS = (0.125e-3, 0.25e-3, 0.5e-3, 1e-3, 2e-3)  # s
COARSE = 4e-3  # s: beyond what `bayesimpact.model.exact.return_time_prediction` takes
BATCHES = (1, 4, 16, 64, 256)
IMPACT_SAMPLES = 6_000


def agrees(theta: np.ndarray, rest: tuple) -> None:
    """Ours and the plain recurrence give the same sums of squares."""
    found, codes = sums_of_squares(theta[None], *rest)
    assert not codes.any()
    np.testing.assert_allclose(found[0], recurrence.sums_of_squares(theta, *rest), rtol=1e-8)


def least(subject: Callable[[], object]) -> float:
    """Processor time, s, of one call, at its fastest."""
    return float(rounds({"it": subject}, 4, 3, time.process_time)["it"].min())


def sizes(pairs: Sequence[tuple[int, int]]) -> dict[str, list[float]]:
    """Microseconds of one likelihood and of the floor for (recordings, samples of each)."""
    ours, floor = [], []
    for count, n in pairs:
        theta, values, rest = campaign(count, n)
        if (count, n) in (pairs[0], pairs[-1]):
            agrees(theta, rest)
        loops = max(1, 200_000 // (count * n))  # the processor's clock is coarse

        def likelihoods(theta=theta, rest=rest, loops=loops) -> None:
            for _ in range(loops):
                sums_of_squares(theta[None], *rest)

        def floors(values=values, rest=rest, loops=loops) -> None:
            for _ in range(loops):
                recurrence.floor(rest[3], values)

        ours.append(1e6 * least(likelihoods) / loops)
        floor.append(1e6 * least(floors) / loops)
    return {"us": ours, "floor_us": floor}


def grown(name: str, values: Sequence[int], measured: dict[str, list[float]]) -> dict[str, Any]:
    """A series with its slope."""
    return {name: list(values), **measured, "slope": slope(values, measured["us"])}


def undamped(interval: float, stop: bool) -> tuple[np.ndarray, tuple, int]:
    """theta, the rest of the arguments, and the impacts of one undamped recording."""
    gap, k2 = (1.1e-3, 5350.156) if stop else (np.inf, 0.0)
    q = np.array([0.0, 808.556, 0.0, gap, k2, -6.5e-3] + 5 * [0.0])
    columns = np.arange(11)[None]
    data, n = np.zeros(IMPACT_SAMPLES), IMPACT_SAMPLES
    rest = (columns, np.zeros((1, 11)), MASS, data, np.array([0]), np.array([n]))
    motion = simulate(
        mass=MASS, c1=0.0, k1=q[1], g=q[3], k2=q[4], y0=q[5], v0=0.0, interval=interval, n=n
    )
    return q, (*rest, np.array([interval])), len(motion.impacts)


def cost_of_impacts(interval: float) -> tuple[int, float, float]:
    """Impacts in IMPACT_SAMPLES samples; microseconds with the stop and without."""
    count, times = 0, []
    for stop in (False, True):
        q, rest, count = undamped(interval, stop)
        agrees(q, rest)
        many = np.tile(q, (32, 1))
        times.append(1e6 * least(lambda m=many, r=rest: sums_of_squares(m, *r)) / 32)
    return count, times[1], times[0]


def impacts() -> dict[str, Any]:
    """Cost of a recording of IMPACT_SAMPLES samples against the impacts in it."""
    counts, with_stop, without = zip(*map(cost_of_impacts, INTERVALS), strict=True)
    extra = np.subtract(with_stop, without)
    coarse = cost_of_impacts(COARSE)
    return {
        "impacts": list(counts),
        "us": list(with_stop),
        "without_stop_us": list(without),
        "slope": slope(counts, extra.tolist()),
        "ns_per_impact": float(1e3 * np.polyfit(counts, extra, 1)[0]),
        "ns_per_impact_sampled_coarsely": 1e3 * (coarse[1] - coarse[2]) / coarse[0],
    }


def batches() -> dict[str, Any]:
    """Cost of one call against the parameter vectors in it, on one thread."""
    theta, _, rest = campaign()
    agrees(theta, rest)
    many = [np.tile(theta, (size, 1)) for size in BATCHES]
    times = [1e6 * least(lambda m=m: sums_of_squares(m, *rest)) for m in many]
    return grown("vectors", BATCHES, {"us": times})


def threads(available: int) -> dict[str, Any]:
    """Speed of a batch on all threads over that on one, per thread."""
    theta, _, rest = campaign()
    many = np.tile(theta, (512, 1))

    def on(count: int) -> Callable[[], None]:
        def run() -> None:
            numba.set_num_threads(count)
            sums_of_squares(many, *rest)

        return run

    subjects = {"one": on(1), "all": on(available)}
    wall, cpu = rounds(subjects, 12, 2), rounds(subjects, 12, 2, time.process_time)
    ratios = wall["one"] / wall["all"] / available
    return {
        "threads": available,
        "us_on_one": float(np.median(wall["one"]) * 1e6 / len(many)),
        "us_on_all": float(np.median(wall["all"]) * 1e6 / len(many)),
        "efficiency": float(np.median(ratios)),
        "best_efficiency": float(wall["one"].min() / wall["all"].min() / available),
        "efficiency_by_processor_time": float(cpu["one"].min() / cpu["all"].min()),
    }


def measure() -> dict[str, Any]:
    """All series."""
    available = numba.get_num_threads()
    numba.set_num_threads(1)
    result = {
        "samples": grown("samples", SAMPLES, sizes([(9, n) for n in SAMPLES])),
        "recordings": grown("recordings", RECORDINGS, sizes([(r, 6_000) for r in RECORDINGS])),
        "impacts": impacts(),
        "batch": batches(),
        "threads": threads(available),
    }
    numba.set_num_threads(available)
    return result


if __name__ == "__main__":
    keep(__file__, measure())
