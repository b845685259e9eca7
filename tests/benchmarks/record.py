"""What every benchmark shares: turns at the clock, slopes, and a record that says where from.

A benchmark checks its answer, measures with `rounds`, and ends with `keep(__file__, result)`.
"""

from __future__ import annotations

import datetime
import importlib.util
import json
import os
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

import numba
import numpy as np

from bayesimpact.trial.run.stamp import commit

ROUNDS = 40
REPEATS = 5
FIELDS = ("date", "commit", "machine", "python", "numba", "numpy")


def stored(file: Path, make: Callable[[], Mapping[str, Any]]) -> dict[str, Any]:
    """What a file of a resumed run holds; made, told and written first where it is missing.

    A run that is killed leaves no half of a file.
    """
    if not file.exists():
        text = json.dumps(make())
        part = file.with_suffix(".part")
        part.write_text(text, encoding="utf-8")
        part.replace(file)
        print(file.stem, text, flush=True)
    found: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return found


def provenance(peers: Sequence[str] = ()) -> dict[str, Any]:
    """Date, commit (with a + when the package differs from it), machine, versions, `others`.

    peers : further libraries, whose versions go under "versions" (None: not installed)
    """
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    names = [line.split(":")[1].strip() for line in lines if "model name" in line]
    head = commit() or ""
    result = {
        "date": datetime.date.today().isoformat(),
        "commit": head[:7] + "+" * head.endswith("+"),
        "machine": f"{(names or [platform.processor()])[0]}, {len(names) or '?'} cores",
        "python": platform.python_version(),
        "numba": numba.__version__,
        "numpy": np.__version__,
        "others": others(),
    }
    if peers:
        result["versions"] = {
            name: metadata.version(name) if present(name) else None for name in peers
        }
    return result


def others(seconds: float = 0.5) -> float | None:
    """Cores that other processes keep busy while this one sleeps; None where /proc/stat is not."""
    file = Path("/proc/stat")
    if not file.exists():
        return None

    def ticks() -> np.ndarray:  # user, nice, system, idle, waiting for a disk, ...
        return np.array(file.read_text().split("\n", 1)[0].split()[1:9], dtype=float)

    before = ticks()
    time.sleep(seconds)
    spent = ticks() - before
    idle = spent[3:5].sum() / max(spent.sum(), 1.0)
    return round((os.cpu_count() or 1) * (1.0 - float(idle)), 2)


def present(library: str) -> bool:
    """Is this library installed?"""
    return importlib.util.find_spec(library) is not None


def rounds(
    subjects: Mapping[str, Callable[[], object]],
    count: int = ROUNDS,
    repeats: int = REPEATS,
    clock: Callable[[], float] = time.perf_counter,
) -> dict[str, np.ndarray]:
    """Seconds of every subject in every round, name -> (count,): the fastest of `repeats` in a row.

    The subjects take turns, so that all see the same machine; each runs once before, unmeasured.
    """
    taken = {name: np.full(count, np.inf) for name in subjects}
    for subject in subjects.values():
        subject()
    for i in range(count):
        for name, subject in subjects.items():
            for _ in range(repeats):
                start = clock()
                subject()
                taken[name][i] = min(taken[name][i], clock() - start)
    return taken


def slope(x: Sequence[float], y: Sequence[float]) -> float:
    """Least-squares slope of log y against log x: 1 when y grows as x does."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


def keep(script: str, result: Mapping[str, Any], peers: Sequence[str] = ()) -> None:
    """Write a result with its provenance beside the script, and print it."""
    text = json.dumps({**provenance(peers), **result}, indent=2) + "\n"
    Path(script).with_suffix(".json").write_text(text, encoding="utf-8")
    print(text, end="")
