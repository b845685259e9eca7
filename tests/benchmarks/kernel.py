"""How long does one likelihood take? The floor, the plain recurrence, and our kernels, in one run.

    python tests/benchmarks/kernel.py

Nine recordings of 6,000 samples at the paper's Table 2 values, released from -6.5, -5 and -4 mm
(about 550 events). Answers are checked before anything is timed. Every round runs each subject a
few times in a row and keeps the fastest (caches warm, as in a fit); times are medians over the
rounds, on one core unless said otherwise, and ratios medians of the rounds' ratios. Writes
kernel.json beside this file.
"""

from __future__ import annotations

import datetime
import json
import platform
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

if __name__ == "__main__":  # imports go by the tests' folder, not by this one
    sys.path[0] = str(Path(__file__).resolve().parents[1])

import numba
import numpy as np
from benchmarks import recurrence

from bayesimpact.model.derivatives import grams, trajectories_and_derivatives
from bayesimpact.model.simulate import predictions, sums_of_squares

ROUNDS = 40
REPEATS = 5
BATCH = 16
MASS = 0.503


def provenance() -> dict[str, object]:
    """Machine, versions and commit of a measurement."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    names = [line.split(":")[1].strip() for line in lines if "model name" in line]
    git = ["git", "-C", str(Path(__file__).parent), "rev-parse", "--short", "HEAD"]
    commit = subprocess.run(git, capture_output=True, text=True, check=False).stdout.strip()
    return {
        "date": datetime.date.today().isoformat(),
        "commit": commit,
        "machine": f"{(names or [platform.processor()])[0]}, {len(names) or '?'} cores",
        "python": platform.python_version(),
        "numba": numba.__version__,
        "numpy": np.__version__,
    }


def campaign(count: int = 9, n: int = 6000, noise: float = 5e-6) -> tuple:
    """theta, its predictions, and the other arguments of `sums_of_squares`."""
    theta = [0.148, 808.556, 2.085, 1.1e-3, 5350.156, 4776.275, 2959.249]
    columns, constants = np.full((count, 11), -1), np.zeros((count, 11))
    for r in range(count):
        columns[r, :5] = [0, 1, 2, 3, 4 + 3 * r // count]
        columns[r, [5, 6, 10]] = len(theta) + np.arange(3)
        theta += [(-6.5e-3, -5e-3, -4e-3)[r % 3], 0.0, 1e-5]
    counts, intervals = np.full(count, n), np.full(count, 1e-3)
    values, codes = predictions([theta], columns, constants, MASS, counts, intervals, count * n)
    assert not codes.any()
    samples = values[0] + noise * np.random.default_rng(1).standard_normal(count * n)
    rest = (columns, constants, MASS, samples, np.arange(count) * n, counts, intervals)
    return np.array(theta), values[0], rest


def check(theta: np.ndarray, values: np.ndarray, rest: tuple) -> None:
    """The answers agree with each other, before any of them is timed."""
    samples = rest[3]
    ours, codes = sums_of_squares(theta[None], *rest)
    assert not codes.any()
    plain = recurrence.sums_of_squares(theta, *rest)
    np.testing.assert_allclose(ours[0], plain, rtol=1e-9)
    assert abs(recurrence.floor(samples, values) / ours.sum() - 1) < 1e-9
    found, _ = grams(theta, *rest)
    np.testing.assert_allclose(found[:, 11, 11], ours[0], rtol=1e-9)
    _, jacobian, _ = trajectories_and_derivatives(theta, *rest[:3], rest[5], rest[6], samples.size)
    both = np.column_stack([jacobian, samples - values])[: rest[5][0]]
    exact = both.T @ both
    scale = np.sqrt(np.outer(np.diag(exact), np.diag(exact))) + 1e-300
    assert np.all(np.abs(found[0] - exact) < 1e-9 * scale)


def rounds(
    subjects: dict[str, Callable[[], object]],
    count: int = ROUNDS,
    clock: Callable[[], float] = time.perf_counter,
) -> dict[str, np.ndarray]:
    """Seconds of every subject in every round; they take turns, so all see the same machine."""
    taken = {name: np.full(count, np.inf) for name in subjects}
    for subject in subjects.values():
        subject()
    for i in range(count):
        for name, subject in subjects.items():
            for _ in range(REPEATS):
                start = clock()
                subject()
                taken[name][i] = min(taken[name][i], clock() - start)
    return taken


def measure() -> dict[str, float]:
    """Times in microseconds per likelihood, and ratios."""
    theta, values, rest = campaign()
    check(theta, values, rest)
    many = np.tile(theta, (BATCH, 1))
    threads = numba.get_num_threads()
    numba.set_num_threads(1)
    taken = rounds(
        {
            "floor": lambda: recurrence.floor(rest[3], values),
            "recurrence": lambda: recurrence.sums_of_squares(theta, *rest),
            "sse": lambda: sums_of_squares(many, *rest),
            "sse_called_alone": lambda: sums_of_squares(theta[None], *rest),
            "with_derivatives": lambda: grams(many, *rest),
            "with_derivatives_called_alone": lambda: grams(theta, *rest),
        }
    )
    for name in ("sse", "with_derivatives"):
        taken[name] /= BATCH
    numba.set_num_threads(threads)
    result = {f"{name}_us": float(np.median(times) * 1e6) for name, times in taken.items()}
    result |= {f"{name}_us_least": float(times.min() * 1e6) for name, times in taken.items()}
    for name, over in (
        ("sse", "floor"),
        ("sse_called_alone", "floor"),
        ("recurrence", "sse"),
        ("with_derivatives", "sse"),
        ("with_derivatives_called_alone", "sse_called_alone"),
    ):
        result[f"{name}_over_{over}"] = float(np.median(taken[name] / taken[over]))
    return result | efficiency(threads) | scaling(threads)


def efficiency(threads: int) -> dict[str, float]:
    """Speed of a batch on all cores over that on one, per core.

    By the wall clock, which needs an idle machine; and by processor time, which shows what sharing
    out the work costs however busy the machine is.
    """
    theta, _, rest = campaign()
    many = np.tile(theta, (512, 1))

    def alone() -> None:
        numba.set_num_threads(1)
        sums_of_squares(many, *rest)

    def together() -> None:
        numba.set_num_threads(threads)
        sums_of_squares(many, *rest)

    wall = rounds({"alone": alone, "together": together}, 10)
    cpu = rounds({"alone": alone, "together": together}, 10, time.process_time)
    return {
        "threads": threads,
        "efficiency_of_threads": float(wall["alone"].min() / wall["together"].min() / threads),
        "efficiency_by_processor_time": float(cpu["alone"].min() / cpu["together"].min()),
    }


def scaling(threads: int) -> dict[str, float]:
    """Processor time in ns per sample against samples and recordings: flat if linear."""
    numba.set_num_threads(1)
    result = {}
    for count, n in ((9, 600), (9, 6000), (9, 60_000), (99, 6000), (999, 6000)):
        theta, values, rest = campaign(count, n)
        subjects = {
            "sse": lambda t=theta, r=rest: sums_of_squares(t[None], *r),
            "floor": lambda v=values, r=rest: recurrence.floor(r[3], v),
        }
        for name, times in rounds(subjects, 5, time.process_time).items():
            result[f"{name}_ns_per_sample_{count}x{n}"] = float(times.min() * 1e9 / (count * n))
    numba.set_num_threads(threads)
    return result


if __name__ == "__main__":
    kept = {**provenance(), **measure()}
    Path(__file__).with_suffix(".json").write_text(json.dumps(kept, indent=2) + "\n")
    print(json.dumps(kept, indent=2))
