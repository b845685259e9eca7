"""How long does one likelihood take? The floor, the plain recurrence, and our kernels, in one run.

    python tests/benchmarks/kernel.py

Nine recordings of 6,000 samples at the paper's Table 2 values, released from -6.5, -5 and -4 mm
(about 550 events). Answers are checked before anything is timed. Every round runs each subject a
few times in a row and keeps the fastest (caches warm, as in a fit); times are medians over the
rounds, on one core, and ratios medians of the rounds' ratios. Writes
kernel.json beside this file.
"""

from __future__ import annotations

import sys
from pathlib import Path

if __name__ == "__main__":  # imports go by the tests' folder, not by this one
    sys.path[0] = str(Path(__file__).resolve().parents[1])

import numba
import numpy as np
from benchmarks import recurrence
from benchmarks.record import keep, rounds

from bayesimpact.model.exact.sensitivities.derivatives import grams, trajectories_and_derivatives
from bayesimpact.model.exact.simulate import predictions, sums_of_squares

BATCH = 16
MASS = 0.503


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
    return result


if __name__ == "__main__":
    keep(__file__, measure())
