"""How long until something happens? The command line's help, a first likelihood, a first compile.

    python tests/benchmarks/startup.py

Every number is the wall time of a fresh process, and beside it its processor time, which a busy
machine lengthens less. `help`: `bayesimpact --help`. `first_likelihood`: read the bundled campaign
and compute one likelihood, everything compiled before and found in the cache; also what an
interpreter and numba's import take of it. `mode`: from the same files to the mode, with the global
search, nothing given; measured inside the process, after its imports. `cold`: everything that the
package compiles (simulator and likelihood on one and on several threads, derivatives, the general
simulator, all effects' laws) with an empty NUMBA_CACHE_DIR; `cold_first_likelihood`: the first
likelihood with one. Writes startup.json beside this file.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

if __name__ == "__main__":  # imports go by the tests' folder, not by this one
    sys.path[0] = str(Path(__file__).resolve().parents[1])

import numpy as np
from benchmarks.bundled import PAPER
from benchmarks.record import keep

RUNS = 7

FIRST = f"""
import numpy as np
from bayesimpact.data.read import load_campaign
from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.oscillator import build_oscillator

campaign = load_campaign({str(PAPER)!r})
oscillator = build_oscillator(campaign)
values = dict(c1=0.148, k1=808.6, c2=2.085, g=1.1e-3, k2=4000.0, v0=0.0, offset=0.0, sigma=5e-6)
values |= {{f"y0[{{r.name}}]": float(r.samples[0]) for r in campaign.recordings}}
names = oscillator.layout.names
theta = np.array([values[name if name in values else name.split("[")[0]] for name in names])
likelihood = Likelihood(oscillator, Noise())
value = likelihood(theta)
assert np.isfinite(value).all()
"""

MODE = f"""
import time

import numpy as np
from bayesimpact.data.read import load_campaign
from bayesimpact.inference.identify import identify

began, used = time.perf_counter(), time.process_time()
fit = identify(load_campaign({str(PAPER)!r}), rng=np.random.default_rng(0)).fit
print(time.perf_counter() - began, time.process_time() - used)
assert fit.converged and fit.reduced_chi2 < 1.05
"""

EVERYTHING = (
    FIRST
    + """
from bayesimpact.model.exact.sensitivities.derivatives import grams
from bayesimpact.model.effects import EFFECTS
from bayesimpact.model.law_table import law_row
from bayesimpact.model.motions import general_motions
from bayesimpact.model.parameters import BASE_SLOTS
from bayesimpact.model.exact.simulate import simulate

many, o = np.tile(theta, (16, 1)), oscillator
assert np.allclose(likelihood(many), value)
columns, constants = (
    np.ascontiguousarray(x[:, : len(BASE_SLOTS)]) for x in (o.layout.columns, o.layout.constants)
)
for t in (theta, many):
    grams(t, columns, constants, campaign.mass, o.samples, o.starts, o.counts, o.intervals)
likelihood.linearise(theta)
o.predict(many)
simulate(mass=0.503, c1=0.148, k1=808.6, y0=1e-3, v0=0.0, interval=1e-3, n=100)
slots = o.layout.slots(theta[None])[0]
for count in (1, slots.shape[0]):
    general_motions(slots[:count], campaign.mass, o.counts[:count], o.intervals[:count], o.laws)
for effect in EFFECTS:
    if effect.law is not None:
        law_row(effect.law, 0)
"""
)


def processor() -> float:
    """Processor time of all processes that this one has started and that have ended, s."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def said(command: list[str], cache: str | None = None) -> str:
    """What a fresh process, which must succeed, prints; `cache` is its folder of compiled code."""
    surroundings = dict(os.environ) | ({} if cache is None else {"NUMBA_CACHE_DIR": cache})
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, env=surroundings, text=True)
    return done.stdout


def seconds(command: list[str], cache: str | None = None) -> tuple[float, ...]:
    """Wall and processor time of a whole process, s."""
    began, used = time.perf_counter(), processor()
    said(command, cache)
    return time.perf_counter() - began, processor() - used


def told(command: list[str], cache: str | None = None) -> tuple[float, ...]:
    """Wall and processor time, s, that a process prints, as it measures them itself."""
    return tuple(map(float, said(command, cache).split()))


def measure(runs: int = RUNS) -> dict[str, Any]:
    """Wall and processor seconds, medians of `runs` processes; the cold ones of one each."""

    result: dict[str, Any] = {"runs": runs}

    def python(code: str) -> list[str]:
        return [sys.executable, "-P", "-c", code]  # coverage.py here is not numba's coverage

    def time_it(
        name: str,
        command: list[str],
        cache: str | None = None,
        count: int = runs,
        by: Callable[[list[str], str | None], tuple[float, ...]] = seconds,
    ) -> None:
        if count > 1:
            by(command, cache)  # files in memory, code compiled
        wall, used = np.median([by(command, cache) for _ in range(count)], axis=0)
        result.update({f"{name}_s": float(wall), f"{name}_processor_s": float(used)})

    main = "from bayesimpact.cli import main; main()"
    with tempfile.TemporaryDirectory() as first, tempfile.TemporaryDirectory() as cache:
        time_it("interpreter", python("pass"))
        time_it("import_numba", python("import numba"))
        time_it("help", [*python(main), "--help"])
        time_it("cold_first_likelihood", python(FIRST), first, 1)
        time_it("cold", python(EVERYTHING), cache, 1)
        time_it("warm", python(EVERYTHING), cache)
        time_it("first_likelihood", python(FIRST), cache)
        time_it("mode", python(MODE), cache, by=told)
    return result


if __name__ == "__main__":
    keep(__file__, measure())
