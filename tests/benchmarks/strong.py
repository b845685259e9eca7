"""Is the diagnosis right where the misfit is large? Stores finished runs of strong trials.

    bayesimpact trial --regime strong --number 200 --seed 60000 --workers 2 --out strong
    python tests/benchmarks/strong.py strong

Writes strong.json beside this file: the run's summary, with settings, seeds, versions, commit and
date as the run stamped them, and one row per trial, its line of log.txt among it.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

if __name__ == "__main__":  # imports go by the tests' folder, not by this one
    sys.path[0] = str(Path(__file__).resolve().parents[1])

from bayesimpact.trial.score.line import trial_line

STORE = Path(__file__).with_suffix(".json")


def row(result: dict[str, Any]) -> dict[str, Any]:
    """What was concealed and what was answered in one trial, or that it failed."""
    entry: dict[str, Any] = {"seed": result["seed"], "line": trial_line(result)}
    if "truth" in result:
        truth = result["truth"]
        entry |= {
            "kind": truth["kind"],
            "rig": truth["rig_kind"],
            "misfit": round(truth["misfit"], 2),
            "planted": [p["id"] for p in truth["planted"] if not p["outside"]],
            "outside": [p["id"] for p in truth["planted"] if p["outside"]],
        }
    if "score" not in result:
        return entry | {"outcome": "crash", "stage": result["stage"]}
    score = result["score"]
    inside = [row["after"] for row in score["coverage"].values() if "after" in row]
    return entry | {
        "verdict": score["verdict"],
        "named": sorted(e["id"] for e in result["answer"]["effects"]),
        "outcome": score["outcome"],
        "worse": score["quality"]["worse"],
        "inside": [sum(inside), len(inside)],
        "seconds": round(score["seconds"], 1),
        "processor_s": result.get("processor_s"),
    }


def collected(run: Path) -> dict[str, Any]:
    """Summary and rows of a finished run."""
    summary: dict[str, Any] = json.loads((run / "summary.json").read_text(encoding="utf-8"))
    first, last = summary["seeds"]
    files = [run / "trials" / f"{seed}.json" for seed in range(first, last + 1)]
    results = [json.loads(file.read_text(encoding="utf-8")) for file in files]
    return {**summary, "answers": [row(r) for r in results]}


def main() -> None:
    """Store a run."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", type=Path)
    parser.add_argument("--out", type=Path, default=STORE)
    chosen = parser.parse_args()
    text = json.dumps(collected(chosen.run), allow_nan=False, separators=(",", ":"))
    chosen.out.write_text(text.replace('{"seed"', '\n{"seed"') + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
