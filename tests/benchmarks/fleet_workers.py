"""How well two workers share a fleet: `python tests/benchmarks/fleet_workers.py [CAMPAIGNS]`.

A fleet of CAMPAIGNS (60) small campaigns runs in one process and on two local workers, twice each,
in turns. `efficiency` is the time of one over twice the time of two, start-up included, from the
faster runs; it means something only where `others` is near zero. `processor_share` compares the
processor seconds, which other processes disturb less: what the cluster itself costs. The result
goes to fleet_workers.json.
"""

from __future__ import annotations

import resource
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from record import keep

sys.path.insert(0, str(Path(__file__).parents[1]))
from kills import run
from small_fleet import write_fleet

TURNS = 2


def measure(campaigns: int) -> dict[str, Any]:
    """Seconds on the clock and of the processors, with one worker and with two."""
    taken: dict[int, list[tuple[float, float]]] = {1: [], 2: []}
    with tempfile.TemporaryDirectory() as name:
        file = write_fleet(Path(name), campaigns)
        for turn in range(TURNS):
            for workers, runs in taken.items():
                out = Path(name) / f"{workers}-{turn}"
                runs.append(_timed(["fleet", str(file), "--quiet", "--out", str(out),
                                    "--workers", str(workers)]))  # fmt: skip
    clock, processor = ({w: min(r[k] for r in runs) for w, runs in taken.items()} for k in (0, 1))
    return {
        "campaigns": campaigns,
        "seconds": {str(w): round(s, 1) for w, s in clock.items()},
        "processor_seconds": {str(w): round(s, 1) for w, s in processor.items()},
        "efficiency": round(clock[1] / (2 * clock[2]), 3),
        "processor_share": round(processor[1] / processor[2], 3),
    }


def _timed(arguments: list[str]) -> tuple[float, float]:
    began, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    code, said = run(arguments)
    if code not in (0, 3):
        raise RuntimeError(said)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return time.perf_counter() - began, spent


if __name__ == "__main__":
    keep(__file__, measure(int(sys.argv[1]) if len(sys.argv) > 1 else 60))
