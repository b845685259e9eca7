"""How accurate is the simulator? 1,000 random systems against the 50-digit twin.

    python tests/benchmarks/accuracy.py [systems]

Writes accuracy.json beside this file. Displacement errors are relative to the largest displacement
of the recording (a displacement passes zero), event times to the time itself, or, where the speed
at the stop nearly vanishes, to the time that the amplitude takes at that speed: a graze is no
better defined. A few forced systems are chaotic: there one rounding of the parameters already moves
the motion by more than 1e-12. `rounding` is that movement, sum over q of |q dy/dq| eps / 2,
relative to the largest displacement (or, for times, the same through the events), and errors below
it are as good as exact.
"""

from __future__ import annotations

import sys
from dataclasses import asdict, dataclass
from pathlib import Path

if __name__ == "__main__":  # imports go by the tests' folder, not by this one
    sys.path[0] = str(Path(__file__).resolve().parents[1])

import naive
import numpy as np
import systems

from bayesimpact.model.exact.sensitivities.derivatives import find_events
from bayesimpact.model.exact.simulate import predictions, simulate
from bayesimpact.model.exact.tables import response_tables

SEED = 7
STEP = 1e-7  # relative, of every parameter


@dataclass(frozen=True)
class Accuracy:
    """Errors of one system; `events` is -1 when the twin has another number of them."""

    displacement: float
    time: float
    events: int
    rounding: float


def measure(system: systems.System) -> Accuracy:
    """Compare one system with its twin."""
    q, mass, interval, n = system.q, system.mass, system.interval, system.n
    every = systems.EVERY if n > 2 * systems.EVERY else 1  # the twin is slow: not every sample
    with naive.mp.workdps(80):
        twin = naive.twin(q, mass, naive.mp.mpf(interval) * every, (n - 1) // every + 1)
    motion = simulate(**system.arguments)
    events, code = find_events(
        q,
        mass,
        interval,
        n,
        np.empty(0),
        np.empty((64, 2)),
        response_tables(),
        np.empty((3, 0)),
        -1,
    )
    assert code == 0
    scale = float(max(abs(y) for y in twin.displacement)) or 1.0
    pairs = zip(motion.displacement[::every], twin.displacement, strict=True)
    displacement = max(abs(float(a - b)) for a, b in pairs) / scale
    late = 0.0
    if len(events) != len(twin.events):
        return Accuracy(displacement, np.inf, -1, 0.0)
    for found, (time, speed, _) in zip(events[:, 0] * interval, twin.events, strict=True):
        natural = max(float(time), scale / abs(float(speed)))
        late = max(late, abs(float(found - time)) / natural)
    steps = STEP * np.eye(11)
    shifted = q * np.concatenate([1.0 + steps, 1.0 - steps])
    columns, none = np.arange(11)[None], np.zeros((1, 11))
    up, down = np.split(predictions(shifted, columns, none, mass, [n], [interval], n)[0], 2)
    moved = np.abs(up - down).sum(0).max() / (2 * STEP)
    rounding = float(moved * np.finfo(float).eps / 2 / scale)
    return Accuracy(displacement, late, len(events), rounding)


def survey(count: int, seed: int = SEED) -> list[Accuracy]:
    """Measure `count` random systems, every third of them unforced and finely sampled."""
    rng = np.random.default_rng(seed)
    draws = (systems.draw_fine if i % 3 == 2 else systems.draw for i in range(count))
    return [measure(draw(rng)) for draw in draws]


def summary(found: list[Accuracy]) -> dict[str, float]:
    """The numbers that are kept: apart, those of chaotic systems (rounding above 1e-12)."""
    calm = [one for one in found if one.rounding <= 1e-12]
    wild = [one for one in found if one.rounding > 1e-12]
    return {
        "systems": len(found),
        "events": sum(one.events for one in found),
        "wrong_counts": sum(one.events < 0 for one in found),
        "largest_displacement_error": max(one.displacement for one in calm),
        "largest_time_error": max(one.time for one in calm),
        "chaotic_systems": len(wild),
        "largest_error_over_rounding_of_chaotic": max(
            (max(one.displacement, one.time) / one.rounding for one in wild), default=0.0
        ),
    }


if __name__ == "__main__":
    from benchmarks.record import keep

    result = survey(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
    keep(__file__, {**summary(result), "worst": asdict(max(result, key=lambda r: r.time))})
