"""How fast is a long recording under a measured input? 131,072 samples, with a stop and without.

    python tests/benchmarks/driven.py

Filtered noise drives the rig for 215 s, sampled at 610 Hz, as the public Silverbox record is. Timed
are the mode from the raw recording (global search included; everything compiled before) and one
likelihood, beside a decay of that length: its plain recurrence (`recurrence.py`), our likelihood of
it, and the sum of squared differences of two stored arrays, below which nothing can be. The mode is
checked against the truth first. Likelihoods are medians of CPU time over rounds, on one core.
Writes driven.json.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

if __name__ == "__main__":  # imports go by the tests' folder, not by this one
    sys.path[0] = str(Path(__file__).resolve().parents[1])

import numba
import numpy as np
from benchmarks import recurrence
from benchmarks.record import keep, rounds

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.input import Input
from bayesimpact.data.recording import Recording
from bayesimpact.inference.identify import identify
from bayesimpact.model.exact.simulate import sums_of_squares
from bayesimpact.model.oscillator import Oscillator, build_oscillator

SAMPLES, INTERVAL, NOISE = 131_072, 1 / 610.3515625, 5e-6
RIG = {"mass": 0.503, "c1": 0.6, "k1": 808.556, "c2": 2.085, "g": 1.1e-3, "k2[1]": 5350.156}
START = {"y0[a]": 1e-4, "v0[a]": 0.01, "offset[a]": 2e-5, "sigma": NOISE}
RELEASE = {**START, "y0[a]": -6.5e-3, "v0[a]": 0.0}
BATCH = 4


def oscillator(force: np.ndarray | None, stop: bool, samples: np.ndarray) -> Oscillator:
    """Of one recording, driven by a force or released."""
    given = None if force is None else Input(force)
    recording = Recording("a", "1" if stop else "", samples, INTERVAL, input=given)
    return build_oscillator(Campaign("long", RIG["mass"], (recording,), stop=stop))


def recorded(driven: bool, stop: bool, count: int = SAMPLES) -> tuple[Oscillator, np.ndarray]:
    """A recording with noise, and the true parameters."""
    rng = np.random.default_rng(5)
    force = np.convolve(6.0 * rng.standard_normal(count), np.ones(5) / 5, "same")
    given = force if driven else None
    empty = oscillator(given, stop, np.zeros(count))
    values = RIG | (START if driven else RELEASE)
    theta = np.array([values[name] for name in empty.layout.names])
    (clean,) = empty.predict(theta)
    return oscillator(given, stop, clean + NOISE * rng.standard_normal(count)), theta


def arguments(o: Oscillator) -> tuple[Any, ...]:
    """Of `sums_of_squares`, but for the parameters."""
    columns, constants = o.layout.columns[:, :11], o.layout.constants[:, :11]
    return (
        np.ascontiguousarray(columns), np.ascontiguousarray(constants), o.campaign.mass, o.samples,
        o.starts, o.counts, o.intervals, None, o.inputs,
    )  # fmt: skip


def found_mode(o: Oscillator, theta: np.ndarray) -> float:
    """Seconds from a raw recording to its mode, which holds the truth."""
    began = time.perf_counter()
    fit = identify(o.campaign, rng=np.random.default_rng(0)).fit
    seconds = time.perf_counter() - began
    away = np.abs(fit.mode - theta) / fit.sd
    assert fit.converged and away.max() < 5.0, dict(zip(fit.names, away, strict=True))
    return seconds


def measure(samples: int = SAMPLES, **turns: int) -> dict[str, Any]:
    """Seconds, microseconds and ratios, with a stop and without."""
    result: dict[str, Any] = {"samples": samples}
    threads = numba.get_num_threads()
    for stop in (True, False):
        (driven, theta), (free, released) = (recorded(d, stop, samples) for d in (True, False))
        found_mode(recorded(True, stop, 4096)[0], theta)  # compiles
        seconds = found_mode(driven, theta)
        ours, plain = arguments(driven), arguments(free)
        many, alone = np.tile(theta, (BATCH, 1)), np.tile(released, (BATCH, 1))
        (stored,) = free.predict(released)
        numba.set_num_threads(1)
        taken = rounds(
            {
                "floor": lambda: recurrence.floor(free.samples, stored),  # noqa: B023
                "recurrence": lambda: recurrence.sums_of_squares(released, *plain[:7]),  # noqa: B023
                "decay": lambda: sums_of_squares(alone, *plain),  # noqa: B023
                "driven": lambda: sums_of_squares(many, *ours),  # noqa: B023
            },
            clock=time.process_time,
            **turns,
        )
        numba.set_num_threads(threads)
        taken["decay"] /= BATCH
        taken["driven"] /= BATCH
        row = {f"{name}_us": float(np.median(t) * 1e6) for name, t in taken.items()}
        for name in ("floor", "recurrence", "decay"):
            row[f"driven_over_{name}"] = float(np.median(taken["driven"] / taken[name]))
        result["stop" if stop else "no_stop"] = {"mode_s": seconds, **row}
    return result


if __name__ == "__main__":
    keep(__file__, measure())
