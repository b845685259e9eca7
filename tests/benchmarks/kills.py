"""Kills commands at every write and at random moments: `python tests/benchmarks/kills.py [COUNT]`.

COUNT (200) kills with SIGKILL, half of them at the writes in turn and half at moments drawn evenly
from the time of an undisturbed run (the latest one: a kill that comes after the end of its run does
not count, and is tried again); each is resumed, and everything that the command left is
compared with what an undisturbed run left, bit for bit: chains, draws, arrays, tables, JSON but
for dates and seconds. `sample`, `diagnose`, `fleet` and `trial` take turns. The counts go to
kills.json; a run that is terminated keeps those it has.
"""

from __future__ import annotations

import shutil
import signal
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from record import keep

sys.path.insert(0, str(Path(__file__).parents[1]))
from kills import RESUME, killed_and_resumed, run, state, unfinished
from small_fleet import write_fleet
from small_rig import RELEASES, record

from bayesimpact.trial.rig.files import write_campaign

TRIALS = ["--number", "2", "--rig", "small", "--noise", "white", "--kinds", "control",
          "--no-report", "--no-search"]  # fmt: skip
TRIES = 8  # for a kill that comes too late


@dataclass
class Victim:
    """One command, and what became of it."""

    arguments: list[str]
    resume: tuple[str, ...]
    seconds: float = 0.0
    writes: int = 0
    expected: dict[str, str] = field(default_factory=dict)
    kills: int = 0
    late: int = 0
    left: int = 0
    losses: list[str] = field(default_factory=list)

    def undisturbed(self, out: Path) -> None:
        """What a kill must not change."""
        run([*self.arguments, "--out", str(out) + "-first"])  # compiles what is not yet compiled
        began = time.perf_counter()
        code, said = run([*self.arguments, "--out", str(out)])
        if code not in (0, 3):
            raise RuntimeError(said)
        self.seconds, self.writes = time.perf_counter() - began, int(said.split()[-1])
        self.expected = state(out)

    def attacked(self, out: Path, write: int | None, rng: np.random.Generator) -> None:
        """One kill that meets the run, at a write or at a random moment, and the resumption."""
        for _ in range(TRIES):
            at: dict[str, Any] = {"seconds": float(rng.uniform(0, self.seconds))}
            if write is not None:
                at = {"write": 1 + write % self.writes}
            if self._met(out, at):
                return

    def _met(self, out: Path, at: dict[str, Any]) -> bool:
        """One kill and the resumption; whether the kill met the run."""
        began, met = time.perf_counter(), True
        try:
            met = killed_and_resumed(self.arguments, out, resume=self.resume, **at)
            self.kills, self.late = self.kills + met, self.late + (not met)
            if not met:  # two runs: one to its end, one that found all done
                self.seconds = min(self.seconds, time.perf_counter() - began)
            found = state(out)
            wrong = [n for n in {**found, **self.expected} if found.get(n) != self.expected.get(n)]
            if wrong:
                self.losses.append(f"{at}: {', '.join(sorted(wrong))}")
        except RuntimeError as error:
            self.losses.append(f"{at}: {error}")
        self.left += len(unfinished(out))
        shutil.rmtree(out, ignore_errors=True)
        return met

    def document(self) -> dict[str, Any]:
        """Its counts; `after_its_end`: kills that came too late to meet the run."""
        return {"kills": self.kills, "after_its_end": self.late, "writes": self.writes,
                "seconds": round(self.seconds, 1), "temporary_files_left": self.left,
                "losses": self.losses}  # fmt: skip


def victims(folder: Path) -> dict[str, Victim]:
    """The commands with small campaigns of their own."""
    write_campaign(folder / "stop", record(seed=3, duration=0.6, releases=RELEASES[:1]))
    file = write_fleet(folder, 2)
    return {
        "sample": Victim(["sample", str(folder / "stop"), "--quiet"], RESUME),
        "diagnose": Victim(["diagnose", str(folder / "day0"), "--quiet"], RESUME),
        "fleet": Victim(["fleet", str(file), "--quiet"], ()),
        "trial": Victim(["trial", *TRIALS, "--quiet"], ()),
    }


def attack(count: int, seed: int = 0) -> dict[str, Any]:
    """The counts of `count` kills, or of as many as there were until SIGTERM."""
    rng = np.random.default_rng(seed)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        commands = victims(folder)
        try:
            for command, victim in commands.items():
                victim.undisturbed(folder / f"{command}-out")
            for k in range(count):
                command, victim = list(commands.items())[k % len(commands)]
                turn = k // len(commands)
                write = turn // 2 if turn % 2 else None
                victim.attacked(folder / f"{command}-{k}", write, rng)
                sys.stderr.write(f"{k + 1} {command}: {len(victim.losses)} lost\n")
        except KeyboardInterrupt:
            sys.stderr.write("terminated\n")
        found: dict[str, Any] = {name: one.document() for name, one in commands.items()}
    return {"asked": count, "kills": sum(one["kills"] for one in found.values()),
            "losses": sum(len(one["losses"]) for one in found.values()), **found}  # fmt: skip


if __name__ == "__main__":
    keep(__file__, attack(int(sys.argv[1]) if len(sys.argv) > 1 else 200))
