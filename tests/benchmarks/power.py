"""Detection power on the bundled rig: theory for every effect, checked by blind trials if given.

    python tests/benchmarks/power.py

Writes power.json beside this file; `figures.py` draws it. With `--trials RUN` (folders of
`bayesimpact trial --kinds single --rig paper --noise white --strength 1 1 ...`) also what those
runs saw.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

if __name__ == "__main__":  # imports go by the tests' folder, not by this one
    sys.path[0] = str(Path(__file__).resolve().parents[1])

import numpy as np
from benchmarks.detection_power import observed, power_table, power_text

from bayesimpact.trial.run.stamp import origin

STORE = Path(__file__).with_suffix(".json")


def main() -> None:
    """Compute, print the table, store the result."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=Path, action="append", default=[], metavar="DIR")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=STORE, metavar="FILE")
    chosen = parser.parse_args()
    files = [f for folder in chosen.trials for f in sorted((folder / "trials").glob("*.json"))]
    results = [json.loads(f.read_text(encoding="utf-8")) for f in files]
    table = power_table(np.random.default_rng(chosen.seed))
    document = {**origin(), "seed": chosen.seed, **table, "observed": observed(results)}
    text = json.dumps(document, allow_nan=False) + "\n"
    chosen.out.write_text(text, encoding="utf-8")
    print(power_text(document), end="")


if __name__ == "__main__":
    main()
