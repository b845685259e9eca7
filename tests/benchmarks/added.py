"""What does an added effect cost, and how exact is it? Work against precision, effect by effect.

    python tests/benchmarks/added.py

Nine recordings of 6,000 samples at the paper's values, one effect at a time at its plausible size
(the width of its prior), on one thread. Numba takes the step sizes as constants when it compiles,
so each scale of the steps is a process of its own, compiled anew: 1 is what the package uses. The
error is the largest difference to steps a quarter as long; `halving` that of 1 against 1/2. The
plain recurrence of the base model takes its turn among the effects, for the machine's speed changes
from one quarter of an hour to the next. Then all pairs of effects, with the package's steps and
half of them. Writes added.json beside this file.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from itertools import combinations
from pathlib import Path
from typing import Any

if __name__ == "__main__":  # imports go by the tests' folder, not by this one
    sys.path[0] = str(Path(__file__).resolve().parents[1])

import numpy as np
from benchmarks import kernel, recurrence
from benchmarks.record import keep, rounds
from effect_rigs import MOVING, TestRig, typical

from bayesimpact.model.general import flows
from bayesimpact.model.oscillator import build_oscillator

SCALES = (2.0, 1.0, 0.5, 0.25)  # of all step sizes
STEPS = ("MAX_ANGLE", "MAX_ANGLE_OF_TIME", "RAMP")
GRADED = ("SINCE", "UNTIL", "SINCE_TURN", "UNTIL_TURN")  # over a time's 3/4th power
ROUNDS, REPEATS = 11, 3
PAIRED = (1.0, 0.5)  # scales with which pairs of effects are simulated too
PLAIN, PLUS = "plain recurrence", " + "
RIG = TestRig(
    k2=np.repeat([5350.156, 4776.275, 2959.249], 3),
    y0=np.tile([-6.5e-3, -5e-3, -4e-3], 3),
    v0=np.zeros(9),
)


def resolved(together: int) -> Iterator[tuple[str, Callable[[], np.ndarray]]]:
    """Sets of so many effects that need the general path: names, and what simulates them."""
    for effects in combinations(MOVING, together):
        oscillator = build_oscillator(RIG.campaign(), effects)
        if not oscillator.is_base:
            values = {k: v for effect in effects for k, v in typical(effect, RIG).items()}
            slots = oscillator.layout.slots(RIG.theta(oscillator, values)[None])[0]
            name = PLUS.join(effect.id for effect in effects)
            yield name, partial(oscillator.motions_of, np.arange(9), slots)


def child(scale: float, file: str) -> None:
    """Simulate and time every effect with scaled steps; motions and seconds into a file."""
    import numba

    numba.set_num_threads(1)
    for name in STEPS:
        setattr(flows, name, scale * getattr(flows, name))
    for name in GRADED:
        setattr(flows, name, scale**0.75 * getattr(flows, name))
    theta, _, rest = kernel.campaign()
    subjects: dict[str, Callable[[], Any]] = {
        PLAIN: lambda: recurrence.sums_of_squares(theta, *rest)
    }
    subjects |= resolved(1)
    if scale in PAIRED:
        subjects |= resolved(2)
    result: dict[str, Any] = {f"{effect}.y": run() for effect, run in subjects.items()}
    for effect, taken in rounds(subjects, ROUNDS, REPEATS).items():
        result[f"{effect}.s"] = np.median(taken)
    np.savez(file, **result)


def measure() -> dict[str, Any]:
    """Nanoseconds per sample and errors, m, of every effect and scale."""
    runs = {}
    with tempfile.TemporaryDirectory() as folder:
        for scale in SCALES:
            file = str(Path(folder) / f"{scale}.npz")
            cache = {"NUMBA_CACHE_DIR": str(Path(folder) / f"cache{scale}")}
            command = [sys.executable, str(Path(__file__)), str(scale), file]
            subprocess.run(command, check=True, env={**os.environ, **cache})
            with np.load(file) as stored:
                runs[scale] = {name: stored[name] for name in stored.files}
    samples = 9 * RIG.count
    finest = runs[min(SCALES)]

    def apart(one: dict[str, Any], other: dict[str, Any], effect: str) -> float:
        return float(np.abs(one[f"{effect}.y"] - other[f"{effect}.y"]).max())

    def cost(effect: str, scales: tuple[float, ...] = SCALES) -> list[float]:
        return [float(runs[scale][f"{effect}.s"]) / samples * 1e9 for scale in scales]

    def halving(effect: str) -> float:
        return apart(runs[1.0], runs[0.5], effect)

    names = [name[:-2] for name in runs[1.0] if name.endswith(".y") and name[:-2] != PLAIN]
    return {
        "samples": samples,
        "scales": list(SCALES),
        "recurrence_ns_per_sample": cost(PLAIN),
        "effects": {
            effect: {
                "ns_per_sample": cost(effect),
                "error_m": [apart(runs[s], finest, effect) for s in SCALES[:-1]],
                "halving_m": halving(effect),
            }
            for effect in names
            if PLUS not in effect
        },
        "pairs": {
            pair: {"ns_per_sample": cost(pair, (1.0,))[0], "halving_m": halving(pair)}
            for pair in names
            if PLUS in pair
        },
    }


def main() -> None:
    """One scale when called with it, else all."""
    if len(sys.argv) == 3:
        child(float(sys.argv[1]), sys.argv[2])
    else:
        keep(__file__, measure())


if __name__ == "__main__":
    main()
