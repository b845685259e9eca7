"""What searches take, beside what the clock of their simulations says: the constants of
`bayesimpact.model.jit.workload` in one table. `python tests/benchmarks/workload.py [NUMBER SEED]`

Drawn trials of the strong regime are diagnosed as `diagnose --quick` does, on an idle machine; the
clock should read about what the processor took. It is a limit, not a forecast: within a factor of
two is enough.
"""

from __future__ import annotations

import sys
import time
from typing import Any

import numpy as np
from benchmarks.record import keep

from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.model.jit.compiled import compilation_left_out
from bayesimpact.model.jit.workload import workload_counted
from bayesimpact.trial.draw.one_trial import draw
from bayesimpact.trial.draw.settings import strong_settings


def measured(seed: int) -> dict[str, Any]:
    """Seconds of the processor and of the clock for one campaign."""
    drawn = draw(strong_settings(), seed)
    with workload_counted() as simulated, compilation_left_out(time.process_time) as taken:
        begun = taken()
        found = diagnose(drawn.campaign, rng=np.random.default_rng([seed, 1]), search=False)
        seconds, clock = taken() - begun, simulated()
    row = {"seed": seed, "verdict": found.verdict, "processor_s": seconds, "clock_s": clock}
    print(row, flush=True)
    return row


def main() -> None:
    """So many campaigns of seeds in turn."""
    number, seed = map(int, sys.argv[1:3] or (10, 215000))
    rows = [measured(s) for s in range(seed, seed + number)]
    ratios = [row["processor_s"] / row["clock_s"] for row in rows]
    quartiles = np.quantile(ratios, (0.0, 0.25, 0.5, 0.75, 1.0)).tolist()
    keep(__file__, {"trials": rows, "processor_over_clock": quartiles})


if __name__ == "__main__":
    main()
