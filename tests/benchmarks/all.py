"""Measure everything about speed anew: `python tests/benchmarks/all.py [script ...]`.

Runs the scripts one after the other, each in a process of its own, then draws the plots and writes
the evidence page's tables. Wants an otherwise idle machine, and 40 minutes on two cores; names
(`peers`, `samplers`) run only those. Peers: `pip install ".[bench]"`, see pyproject.toml.
Accuracy, coverage, trials, power and calibration are not timings, and have scripts of their own.
"""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
TIMINGS = ("kernel", "added", "scaling", "peers", "samplers", "startup", "loops")


def run(name: str) -> None:
    """One script, which must succeed."""
    began = time.perf_counter()
    print(f"== {name}", flush=True)
    subprocess.run([sys.executable, str(HERE / f"{name}.py")], check=True)
    print(f"== {name}: {time.perf_counter() - began:.0f} s", flush=True)


def main() -> None:
    """Timings, then what is made of them."""
    chosen = sys.argv[1:] or TIMINGS
    unknown = sorted(set(chosen) - set(TIMINGS))
    if unknown:
        sys.exit(f"no such timing: {', '.join(unknown)}; there are {', '.join(TIMINGS)}")
    for name in (*chosen, "figures", "readme"):
        run(name)


if __name__ == "__main__":
    main()
