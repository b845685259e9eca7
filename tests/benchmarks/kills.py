"""Kills commands at every write and at random moments: `python tests/benchmarks/kills.py [COUNT]`.

COUNT (200) kills with SIGKILL, half of them at the writes in turn and half at moments drawn evenly
from the time of an undisturbed run; each is resumed, and chain, posterior and fit.json are compared
with those of the undisturbed run, bit for bit. `sample` and `diagnose` take turns. The counts go to
kills.json.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from record import keep

sys.path.insert(0, str(Path(__file__).parents[1]))
from kills import killed_and_resumed, run, state
from small_rig import record

from bayesimpact.trial.rig_files import write_campaign

COMMANDS = ("sample", "diagnose")


def attack(count: int, seed: int = 0) -> dict[str, Any]:
    """The counts of `count` kills."""
    rng = np.random.default_rng(seed)
    found: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_campaign(folder / "campaign", record(seed=3))
        for command in COMMANDS:
            arguments = [command, str(folder / "campaign"), "--quiet"]
            began = time.perf_counter()
            code, said = run([*arguments, "--out", str(folder / command)])
            if code not in (0, 3):
                raise RuntimeError(said)
            seconds, writes = time.perf_counter() - began, int(said.split()[-1])
            expected, met, lost = state(folder / command), 0, []
            for k in range(count // len(COMMANDS)):
                at = (
                    {"write": 1 + k // 2 % writes}
                    if k % 2
                    else {"seconds": rng.uniform(0, seconds)}
                )
                out = folder / f"{command}-{k}"
                try:
                    met += killed_and_resumed(arguments, out, **at)
                    if state(out) != expected:
                        lost.append(f"{at}: other results")
                except RuntimeError as error:
                    lost.append(f"{at}: {error}")
            found[command] = {"kills": met, "writes": writes, "seconds": round(seconds, 1),
                              "losses": lost}  # fmt: skip
    return found


if __name__ == "__main__":
    keep(__file__, attack(int(sys.argv[1]) if len(sys.argv) > 1 else 200))
