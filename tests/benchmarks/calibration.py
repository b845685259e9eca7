"""Is the posterior calibrated, and how often is nothing mistaken for something?

python tests/benchmarks/calibration.py sbc --seed 300 --replicates 300 --workers 2 --add
python tests/benchmarks/calibration.py sbc --method emcee --replicates 50 --out FILE.json
python tests/benchmarks/calibration.py alarms --controls 300 --workers 2 --out FILE.json

`--add` adds a run of all models, without its single ranks, to sbc.json beside this file.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

if __name__ == "__main__":  # imports go by the tests' folder, not by this one
    sys.path[0] = str(Path(__file__).resolve().parents[1])

import numpy as np
from benchmarks.alarms import alarm, false_alarms
from benchmarks.sbc import MODELS, replicate, verdicts
from tqdm import tqdm

from bayesimpact.cluster import executor
from bayesimpact.trial.draw.settings import Settings
from bayesimpact.trial.run.stamp import origin

STORE = Path(__file__).parent / "sbc.json"


def sbc(chosen: argparse.Namespace) -> dict:
    """Ranks of all models."""
    models = chosen.models.split(",") if chosen.models else list(MODELS)
    seeds = range(chosen.seed, chosen.seed + chosen.replicates)
    result: dict = {"method": chosen.method, "replicates": len(seeds), "models": {}}
    for model in models:
        jobs = ((seed, (model, seed, chosen.method)) for seed in seeds)
        with executor(chosen.workers, chosen.scheduler) as spread:
            found = dict(tqdm(spread(replicate, jobs), total=len(seeds), desc=model))
        rows = verdicts([found[seed] for seed in seeds], np.random.default_rng(0))
        result["models"][model] = rows
        print(f"{model:24s} outside the {100 * rows['level']:.0f} % band: {rows['outside']}")
        for name, row in rows["parameters"].items():
            print(
                f"  {name:36s} tail {row['tail']:.3g}  90 % holds {100 * row['covered_90']:.1f} %"
            )
    return result


def without_ranks(document: dict) -> dict:
    """An SBC run as it is stored: verdicts and coverage, not every rank."""
    models = {}
    for model, found in document["models"].items():
        rows = found["parameters"].items()
        kept = {name: {k: v for k, v in row.items() if k != "ranks"} for name, row in rows}
        models[model] = {**found, "parameters": kept}
    return {**document, "models": models}


def alarms(chosen: argparse.Namespace) -> dict:
    """False alarms of controls on all rigs and noises."""
    settings = Settings(kinds=("control",))
    seeds = range(chosen.seed, chosen.seed + chosen.controls)
    with executor(chosen.workers, chosen.scheduler) as spread:
        jobs = ((seed, (settings, seed)) for seed in seeds)
        found = dict(tqdm(spread(alarm, jobs), total=len(seeds), desc="controls"))
    lost = {seed: row["failed"] for seed, row in found.items() if "failed" in row}
    if lost:
        raise SystemExit(
            f"{len(lost)} of {len(found)} controls failed, the first: {lost.popitem()}"
        )
    result = false_alarms([found[seed] for seed in seeds], np.random.default_rng(0))
    print(json.dumps({k: v for k, v in result.items() if k != "rows"}, indent=1))
    return {**result, "rows": [found[seed] for seed in seeds]}


def main() -> None:
    """Run one of the two and store it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("sbc", "alarms"))
    parser.add_argument("--replicates", type=int, default=300)
    parser.add_argument("--controls", type=int, default=300)
    parser.add_argument("--models", help="comma separated")
    parser.add_argument("--method", default="weighted", choices=("normal", "weighted", "emcee"))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--scheduler")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--add", action="store_true", help="add an SBC run to sbc.json")
    chosen = parser.parse_args()
    result = {"sbc": sbc, "alarms": alarms}[chosen.what](chosen)
    document = {**origin(), "command": chosen.what, "seed": chosen.seed, **result}
    if chosen.add and chosen.what == "sbc":
        runs = [*json.loads(STORE.read_text(encoding="utf-8")), without_ranks(document)]
        STORE.write_text(json.dumps(runs, indent=1) + "\n", encoding="utf-8")
    if chosen.out is not None:
        chosen.out.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
