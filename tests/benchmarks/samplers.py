"""How many effective draws per second of the worst parameter, by our sampler and by others?

    python tests/benchmarks/samplers.py

The posterior of the bundled campaign (35 parameters), from its mode: ours as `bayesimpact sample`
runs it, plain emcee, dynesty, and NUTS with our exact gradients (see `sampling.py` for how each is
helped). All call the same compiled likelihood. Ours and emcee run on all threads; dynesty and NUTS
ask for one point at a time, hence ours once more on one thread to compare with. A sampler's rate
counts only when its means and standard deviations agree with ours within the Monte Carlo error.
Effective draws: ArviZ, bulk, least over the parameters; dynesty's are Kish's. The same posterior
with the true prior box costs dynesty some 200 nats more, so its rate is an upper bound. Where a
library is missing (`pip install ".[bench]"`) the sampler is recorded as absent. Writes
samplers.json beside this file.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

if __name__ == "__main__":  # imports go by the tests' folder, not by this one
    sys.path[0] = str(Path(__file__).resolve().parents[1])

import numba
import numpy as np
from benchmarks import sampling
from benchmarks.bundled import fit
from benchmarks.record import keep, present
from benchmarks.sampling import Sampled

from bayesimpact.inference.sampling.convergence import quiet_arviz

SEED = 0
LIMIT = 5.0  # Monte Carlo errors; 70 normal numbers pass it once in 25,000 times
ENOUGH = 50.0  # autocorrelation times, for an ESS to mean something


def on_one_thread(run: Callable[[], Sampled]) -> Sampled:
    """The same with a single thread."""
    threads = numba.get_num_threads()
    numba.set_num_threads(1)
    try:
        return run()
    finally:
        numba.set_num_threads(threads)


def disagreement(one: Sampled, other: Sampled) -> float:
    """Largest difference of means and standard deviations in their Monte Carlo errors."""
    means = np.abs(one.mean - other.mean) / np.hypot(one.mean_error, other.mean_error)
    spreads = np.abs(one.sd - other.sd) / np.hypot(one.sd_error, other.sd_error)
    return float(max(means.max(), spreads.max()))


def row(found: Sampled, reference: Sampled, rival: Sampled) -> dict[str, Any]:
    """What is kept of a sampler; `rival`: ours on as many threads."""
    ess, apart = float(found.ess.min()), disagreement(found, reference)
    agrees = apart <= LIMIT
    rate, best = ess / found.seconds, float(rival.ess.min()) / rival.seconds
    return {
        "threads": found.threads,
        "seconds": found.seconds,
        "ess": ess,
        "ess_per_s": rate if agrees else None,
        "ours_over_this": best / rate if agrees else None,
        "evaluations_per_effective_draw": found.evaluations / ess,
        "autocorrelation_times": found.times,
        "long_enough": None if found.times is None else found.times >= ENOUGH,
        "apart_in_errors": apart,
        "agrees": agrees,
    }


def measure() -> dict[str, Any]:
    """Run all that are installed."""
    given = fit()
    given.density(np.tile(given.mode, (64, 1)))  # compiled before anything is measured,
    quiet_arviz()  # and imported
    sampling.with_gradient(given)(given.mode)
    together = sampling.ours(given, SEED)
    alone = on_one_thread(lambda: sampling.ours(given, SEED))
    rows = {
        "ours": row(together, alone, together),
        "ours, one thread": row(alone, sampling.ours(given, SEED + 1), alone),
        "plain emcee": row(sampling.plain_emcee(given, SEED), alone, together),
    }
    peers = {"NUTS (nutpie)": ("nutpie", sampling.nuts), "dynesty": ("dynesty", sampling.dynesty)}
    for name, (library, run) in peers.items():
        if present(library):
            rows[name] = row(on_one_thread(lambda run=run: run(given, SEED)), alone, alone)
    return {
        "parameters": given.mode.size,
        "absent": sorted(set(peers) - set(rows)),
        "samplers": rows,
    }


if __name__ == "__main__":
    keep(__file__, measure(), ("arviz", "emcee", "nutpie", "dynesty"))
