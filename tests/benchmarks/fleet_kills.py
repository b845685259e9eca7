"""A fleet killed again and again: `python tests/benchmarks/fleet_kills.py [CAMPAIGNS [KILLS]]`.

A fleet of CAMPAIGNS (200) small campaigns runs once undisturbed, and once killed with SIGKILL KILLS
(20) times at random moments, and then to its end. The tables and all else that both left are
compared bit for bit, but for dates and seconds. The counts go to fleet_kills.json.
"""

from __future__ import annotations

import signal
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from record import keep

sys.path.insert(0, str(Path(__file__).parents[1]))
from kills import run, state, unfinished
from small_fleet import write_fleet

TABLES = ("fleet.csv", "fleet.parquet")
PARTS = 1.8  # longest part, times undisturbed time over kills: 20 parts then make some 0.9 of it


def attack(campaigns: int, kills: int, seed: int = 0) -> dict[str, Any]:
    """What a fleet that was killed has in common with one that was not."""
    rng = np.random.default_rng(seed)
    with tempfile.TemporaryDirectory() as name:
        file = write_fleet(Path(name), campaigns)
        calm, killed = Path(name) / "calm", Path(name) / "killed"
        began = time.perf_counter()
        finish(file, calm)
        seconds = time.perf_counter() - began
        done, met = [], 0
        while met < kills:
            code, _ = run(_command(file, killed), seconds=rng.uniform(0, PARTS * seconds / kills))
            if code != -signal.SIGKILL:
                break  # done before its kill
            met += 1
            done.append(len(list(killed.glob("rows/day*.json"))))
            sys.stderr.write(f"kill {met}: {done[-1]} of {campaigns} done\n")
        finish(file, killed)
        expected, found = state(calm), state(killed)
        different = [f for f in {**found, **expected} if found.get(f) != expected.get(f)]
        same = {t: (calm / t).read_bytes() == (killed / t).read_bytes() for t in TABLES}
        left = len(unfinished(killed))
    return {"campaigns": campaigns, "kills": met, "done_at_the_kills": done,
            "seconds_undisturbed": round(seconds), "same_tables": same, "files": len(expected),
            "different_files": sorted(different), "temporary_files_left": left}  # fmt: skip


def finish(file: Path, out: Path) -> None:
    """Run the fleet to its end."""
    code, said = run(_command(file, out))
    if code not in (0, 3):
        raise RuntimeError(said)


def _command(file: Path, out: Path) -> list[str]:
    return ["fleet", str(file), "--quiet", "--out", str(out)]


if __name__ == "__main__":
    numbers = [int(a) for a in sys.argv[1:]]
    keep(__file__, attack(*(numbers + [200, 20][len(numbers) :])))
