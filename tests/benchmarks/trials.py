"""Did the diagnosis find what was concealed? Stores a finished run of blind trials.

    bayesimpact trial --number 200 --seed 2000 --strength 5 12 --workers 2 --out proof
    python tests/benchmarks/trials.py proof

Writes trials.json beside this file: the run's summary, with settings, seeds, versions, commit and
date as the run stamped them, and one row per trial.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

STORE = Path(__file__).with_suffix(".json")


def row(result: dict[str, Any]) -> dict[str, Any]:
    """What was concealed and what was answered in one trial."""
    truth, score = result["truth"], result["score"]
    return {
        "seed": result["seed"],
        "kind": truth["kind"],
        "rig": truth["rig_kind"],
        "noise": truth["noise_kind"],
        "planted": [p["id"] for p in truth["planted"]],
        "fault": (truth.get("fault") or {}).get("id"),
        "right": score["right"],
        "strengths": [None if s is None else round(s, 2) for s in score["strengths"]],
        "named": score["named"],
        "outcome": score["outcome"],
        "sizes_inside": [sum(score["sizes"].values()), len(score["sizes"])],
    }


def collected(run: Path) -> dict[str, Any]:
    """Summary and rows of a finished run."""
    summary = json.loads((run / "summary.json").read_text(encoding="utf-8"))
    first, last = summary["seeds"]
    files = [run / "trials" / f"{seed}.json" for seed in range(first, last + 1)]
    results = [json.loads(file.read_text(encoding="utf-8")) for file in files]
    return {**summary, "answers": [row(r) for r in results if "score" in r]}


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
