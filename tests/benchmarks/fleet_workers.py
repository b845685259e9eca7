"""How well two workers share a fleet: `python tests/benchmarks/fleet_workers.py [CAMPAIGNS]`.

A fleet of CAMPAIGNS (200) small campaigns runs in one process, then on two local workers.
`efficiency` is the time of one over twice the time of two, start-up included; it means something
only where `others` is near zero, or at a lower priority. `processor_share` compares the processor
seconds, which other processes disturb less: what the cluster itself costs. The result goes to
fleet_workers.json.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from record import keep

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_fleet import write_fleet


def measure(campaigns: int) -> dict[str, Any]:
    """Seconds on the clock and of the processors, with one worker and with two."""
    taken = {}
    with tempfile.TemporaryDirectory() as name:
        file = write_fleet(Path(name), campaigns)
        for workers in (1, 2):
            arguments = ["fleet", str(file), "--quiet", "--out", f"{name}/{workers}"]
            taken[workers] = _timed([*arguments, "--workers", str(workers)])
    clock, processor = ({w: t[k] for w, t in taken.items()} for k in (0, 1))
    return {
        "campaigns": campaigns,
        "seconds": {str(w): round(s, 1) for w, s in clock.items()},
        "processor_seconds": {str(w): round(s, 1) for w, s in processor.items()},
        "efficiency": round(clock[1] / (2 * clock[2]), 3),
        "processor_share": round(processor[1] / processor[2], 3),
    }


def _timed(arguments: list[str]) -> tuple[float, float]:
    began, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [str(Path(sys.executable).with_name("bayesimpact")), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode not in (0, 3):
        raise RuntimeError(done.stderr)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return time.perf_counter() - began, spent


if __name__ == "__main__":
    keep(__file__, measure(int(sys.argv[1]) if len(sys.argv) > 1 else 200))
