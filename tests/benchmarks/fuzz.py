"""Damages campaigns in 10,000 ways and counts how they end: `python tests/benchmarks/fuzz.py`.

    python tests/benchmarks/fuzz.py [COUNT [SEED]]

Every campaign must be accepted or refused in a message of ten lines, within 2 s of the process'
own time; the memory is the process' peak over the whole run. The counts go to fuzz.json.
"""

from __future__ import annotations

import resource
import sys
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

from hypothesis import HealthCheck, Phase, given, seed, settings
from record import keep

sys.path.insert(0, str(Path(__file__).parents[1]))
from damaged import Case, cases, outcome

SHOWN = 5  # tracebacks kept of every kind of ending


def run(count: int, number: int) -> dict[str, Any]:
    """The counts of `count` campaigns."""
    counts: Counter[str] = Counter()
    details: dict[str, list[str]] = {}
    with tempfile.TemporaryDirectory() as folder:

        @seed(number)
        @settings(
            max_examples=count,
            deadline=None,
            database=None,
            phases=[Phase.generate],
            suppress_health_check=list(HealthCheck),
        )
        @given(case=cases)
        def attack(case: Case) -> None:
            kind, words = outcome(Path(folder), case)
            counts[kind] += 1
            kept = details.setdefault(kind, [])
            if kind not in ("accepted", "refused") and len(kept) < SHOWN and words not in kept:
                kept.append(words)

        attack()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    bad = {kind: words for kind, words in details.items() if words}
    return {"campaigns": sum(counts.values()), "seed": number, "endings": dict(counts),
            "peak_mib": round(peak), "details": bad}  # fmt: skip


if __name__ == "__main__":
    arguments = [int(a) for a in sys.argv[1:]]
    found = run(arguments[0] if arguments else 10_000, arguments[1] if len(arguments) > 1 else 0)
    for words in (w for several in found["details"].values() for w in several):
        sys.stdout.write(words[-3000:] + "\n")
    sys.stdout.write(f"{found['endings']}, peak {found['peak_mib']} MiB\n")
    keep(__file__, found)
