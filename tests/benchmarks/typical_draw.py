"""Which draw of `data/concealed` is the bundled one: neither a lucky nor an unlucky one.

    python tests/benchmarks/typical_draw.py

Records the concealed campaign from 25 seeds in a row, diagnoses each as the demo does, and measures
how far the answer is from the truth: the median over all parameters of |z|, the distance in
standard deviations. The bundled draw (`CONCEALED_SEED` of `bayesimpact/trial/bundle.py`) is the one
with the median of the 25. Seeds whose answer is not both effects stay in the table, and count as
far off. Writes typical_draw.json beside this file. 20 minutes of one core.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from math import inf
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

import bayesimpact as bi
from bayesimpact.report.diagnosis.document import document
from bayesimpact.trial.bundle import (
    CONCEALED_EFFECTS,
    DECIMALS,
    concealed_campaign,
    concealed_truth,
)
from bayesimpact.trial.rig.files import write_campaign
from bayesimpact.trial.run.stamp import origin
from bayesimpact.trial.score.answers import NORMAL_90

STORE = Path(__file__).with_suffix(".json")
FIRST, DRAWS = 20231101, 25


def distances(answer: Mapping[str, Any], truth: Mapping[str, float]) -> dict[str, float]:
    """Parameter -> distance of its median from the truth, in standard deviations."""
    found = answer["parameters"]["after"]
    widths = {n: (found[n]["ci90"][1] - found[n]["ci90"][0]) / (2 * NORMAL_90) for n in truth}
    return {n: (found[n]["median"] - value) / widths[n] for n, value in truth.items()}


def draw(seed: int) -> dict[str, Any]:
    """One draw: its answer, and how far that is from the truth."""
    with TemporaryDirectory() as folder:
        write_campaign(Path(folder), concealed_campaign(seed), decimals=DECIMALS, comment="")
        found = bi.diagnose(bi.load(folder), seed=0, search=False)
    answer = document(found, seed=0, seconds=0.0, versions={})
    named = sorted(e["id"] for e in answer["effects"])
    row: dict[str, Any] = {"seed": seed, "verdict": answer["verdict"], "named": named}
    if answer["verdict"] != "named" or named != sorted(CONCEALED_EFFECTS):
        return {**row, "median_distance": None}
    z = distances(answer, concealed_truth()["parameters"])
    inside = sum(abs(d) <= NORMAL_90 for d in z.values())
    middle = median(abs(d) for d in z.values())
    return {**row, "distances": z, "inside": inside, "median_distance": middle}


def typical(rows: Sequence[Mapping[str, Any]]) -> int:
    """The seed in the middle of all, by the distance; of an even number the lower one."""

    def far(row: Mapping[str, Any]) -> float:
        return inf if row["median_distance"] is None else float(row["median_distance"])

    return int(sorted(rows, key=far)[(len(rows) - 1) // 2]["seed"])


def main() -> None:
    """Draw, diagnose, store, print the seed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--number", type=int, default=DRAWS)
    parser.add_argument("--out", type=Path, default=STORE, metavar="FILE")
    chosen = parser.parse_args()
    stamp, rows = origin(), []
    for seed in range(FIRST, FIRST + chosen.number):
        rows.append(draw(seed))
        print(json.dumps({k: v for k, v in rows[-1].items() if k != "distances"}), flush=True)
    result = {**stamp, "typical": typical(rows), "draws": rows}
    chosen.out.write_text(json.dumps(result, allow_nan=False, indent=1) + "\n", encoding="utf-8")
    print(f"typical: {result['typical']}")


if __name__ == "__main__":
    main()
