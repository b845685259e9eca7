"""How long does a whole diagnosis take, with its report, and what does it say?

    python tests/benchmarks/loops.py

Nine recordings of 6,000 samples each, in a fresh process, everything compiled before: the bundled
campaign of the paper's rig with nothing missing, the bundled one with two effects concealed, and
three with a force outside the catalogue (from the blind trials), of which one is sampled. With
`--quick` and without in turn; medians of wall and processor time, s, with the slowest run beside
them. The plain recurrence takes its turn too, for the machine's speed changes from one quarter of
an hour to the next. Writes loops.json beside this file.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

if __name__ == "__main__":  # imports go by the tests' folder, not by this one
    sys.path[0] = str(Path(__file__).resolve().parents[1])

import numpy as np
from benchmarks import kernel, recurrence
from benchmarks.bundled import PAPER
from benchmarks.record import keep, rounds
from benchmarks.startup import processor

from bayesimpact.trial.draw.one_trial import draw
from bayesimpact.trial.draw.settings import Settings
from bayesimpact.trial.run.blind import campaign_files

BUNDLED = {"nothing missing": PAPER, "two effects concealed": PAPER.parent / "concealed"}
OUTSIDE = ("friction_pad", "eddy_brake", "damping_bump")
SAMPLED = (*BUNDLED, "friction pad")
SEED, STRENGTH = 11, (6.0, 8.0)  # of what is outside; detection limits
RUNS = 3
COMMAND = [sys.executable, "-c", "from bayesimpact.cli import main; main()", "diagnose"]


def outside(effect: str, folder: Path) -> Path:
    """A campaign of the paper's rig on which a force outside the catalogue acts."""
    chosen = Settings(
        kinds=("outside",), outside=(effect,), strength=STRENGTH, rig_kinds=("paper",),
        noises=("white",),
    )  # fmt: skip
    drawn = draw(chosen, SEED)
    folder.mkdir(parents=True)
    for name, text in campaign_files(drawn.campaign, drawn.truth["rounding_m"]).items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def campaigns(work: Path) -> Iterator[tuple[str, Path]]:
    """All campaigns by name."""
    yield from BUNDLED.items()
    for effect in OUTSIDE:
        yield effect.replace("_", " "), outside(effect, work / effect)


def diagnosed(campaign: Path, out: Path, *options: str) -> tuple[float, float, str]:
    """Wall and processor time of a diagnosis, s, and what it says."""
    began, used = time.perf_counter(), processor()
    subprocess.run(
        [*COMMAND, str(campaign), "--out", str(out), "--quiet", *options],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    wall, used = time.perf_counter() - began, processor() - used
    said = json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))
    return wall, used, said["verdict"]


def summary(runs: list[tuple[float, float, str]]) -> Mapping[str, Any]:
    """Medians, the slowest, and the verdict, which must be the same."""
    verdicts = {verdict for _, _, verdict in runs}
    assert len(verdicts) == 1, verdicts
    wall, used = np.array([run[:2] for run in runs]).T
    return {
        "s": float(np.median(wall)),
        "slowest_s": float(wall.max()),
        "processor_s": float(np.median(used)),
        "verdict": verdicts.pop(),
    }


def measure(runs: int = RUNS) -> dict[str, Any]:
    """Seconds and verdicts of all campaigns."""
    result: dict[str, Any] = {}
    plain: list[float] = []
    theta, _, rest = kernel.campaign()
    recurrent = partial(recurrence.sums_of_squares, theta, *rest)
    with tempfile.TemporaryDirectory() as work:
        for name, folder in campaigns(Path(work) / "campaigns"):
            diagnosed(folder, Path(work) / "first", "--quick")  # compiles
            commands = {"quick": ["--quick"]} | ({"sampled": []} if name in SAMPLED else {})
            found: dict[str, list[tuple[float, float, str]]] = {c: [] for c in commands}
            for _ in range(runs):
                for command, options in commands.items():
                    found[command].append(diagnosed(folder, Path(work) / "out", *options))
                plain.extend(rounds({"plain": recurrent}, count=5)["plain"])
            result[name] = {command: summary(found[command]) for command in commands}
    return {"runs": runs, "campaigns": result, "recurrence_us": 1e6 * float(np.median(plain))}


if __name__ == "__main__":
    keep(__file__, measure())
