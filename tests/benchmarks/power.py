"""Detection power on the bundled rig: theory for every effect, checked by stored blind trials.

bayesimpact trial --kinds single --rig paper --noise white --strength 1 1 --out runs/at1 ...
python tests/benchmarks/power.py --trials runs/at1 --trials runs/at2 --out tests/benchmarks/power
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from bayesimpact.report.figures.power import limits_figure, power_figure
from bayesimpact.trial.power import observed, power_table, power_text
from bayesimpact.trial.stamp import origin


def main() -> None:
    """Compute, print the table, store the result and two figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=Path, action="append", default=[], metavar="DIR")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, required=True, metavar="DIR")
    chosen = parser.parse_args()
    files = [f for folder in chosen.trials for f in sorted((folder / "trials").glob("*.json"))]
    results = [json.loads(f.read_text(encoding="utf-8")) for f in files]
    table = power_table(np.random.default_rng(chosen.seed))
    document = {**origin(), "seed": chosen.seed, **table, "observed": observed(results)}
    chosen.out.mkdir(parents=True, exist_ok=True)
    text = json.dumps(document, indent=1, allow_nan=False) + "\n"
    (chosen.out / "power.json").write_text(text, encoding="utf-8")
    (chosen.out / "power.txt").write_text(power_text(document), encoding="utf-8")
    power_figure(document).savefig(chosen.out / "power.png")
    limits_figure(document).savefig(chosen.out / "limits.png")
    print(power_text(document), end="")


if __name__ == "__main__":
    main()
