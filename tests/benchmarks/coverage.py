"""Do 90 % intervals hold the truth nine times in ten? The paper's rig, nothing concealed.

    python tests/benchmarks/coverage.py --campaigns 100 --out tests/benchmarks/coverage.json
    python tests/benchmarks/coverage.py --campaigns 24 --duration 3 --quantity acceleration

The recordings come from the independent generator; every campaign has its own releases, rest
readings and noise. Intervals are those of the posterior's normal approximation at the mode, which
the sampler's own check compares with emcee (ratio of standard deviations 0.99 to 1.02 on the
bundled campaign).
"""

from __future__ import annotations

import argparse
import json
import platform
import subprocess
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from scipy import stats

from bayesimpact.inference.identify import identify
from bayesimpact.trial.bundle import PAPER_RIG, paper_releases
from bayesimpact.trial.rig import make_campaign
from bayesimpact.trial.rig_chain import Chain

NOISE = {"displacement": 5e-6, "velocity": 2e-4, "acceleration": 2e-2}  # m, m/s, m/s2
QUANTILE = stats.norm.ppf(0.95)


def truth_of(rig, releases, offsets) -> dict[str, float]:
    """Every parameter's true value by its name."""
    values = {"c1": rig.c1, "k1": rig.k1, "c2": rig.c2, "g": rig.g}
    values |= {f"k2[{case}]": k2 for case, k2 in rig.k2.items()}
    for release in releases:
        values[f"y0[{release.name}]"] = release.y0
        values[f"v0[{release.name}]"] = release.v0
        values[f"offset[{release.name}]"] = offsets[release.name]
    return values


def one(seed: int, duration: float, quantity: str) -> dict[str, float]:
    """Errors of all parameters of one campaign in their standard deviations."""
    rng = np.random.default_rng([2026, seed])
    releases = paper_releases(rng)
    noise = NOISE[quantity]
    offsets = {r.name: float(2 * noise * rng.standard_normal()) for r in releases}
    chain = Chain(noise=noise, offsets=offsets)
    campaign = make_campaign(
        "coverage", PAPER_RIG, releases, chain=chain, rate=1000.0, duration=duration, rng=rng,
        quantity=quantity,
    )  # fmt: skip
    fit = identify(campaign, rng=rng, search=False).fit
    truth = truth_of(PAPER_RIG, releases, offsets) | {"sigma": noise}
    return {
        name: float((value - truth[name]) / sd)
        for name, value, sd in zip(fit.names, fit.mode, fit.sd, strict=True)
    }


def summary(errors: list[dict[str, float]]) -> dict[str, dict[str, float]]:
    """Coverage and spread of the standardised errors per parameter (nuisances by kind)."""
    kinds: dict[str, list[float]] = {}
    for error in errors:
        for name, z in error.items():
            kind = name.split("[")[0] if name.startswith(("y0", "v0", "offset")) else name
            kinds.setdefault(kind, []).append(z)
    result = {}
    for kind, values in kinds.items():
        z = np.array(values)
        held = int(np.sum(np.abs(z) <= QUANTILE))
        low, high = stats.binomtest(held, z.size).proportion_ci(0.95, "exact")
        result[kind] = {
            "coverage90": held / z.size, "low": float(low), "high": float(high), "n": int(z.size),
            "sd_of_z": float(z.std()), "mean_of_z": float(z.mean()),
        }  # fmt: skip
    return result


def main() -> None:
    """Run, print a table, store the result."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--campaigns", type=int, default=100)
    parser.add_argument("--duration", type=float, default=6.0)
    parser.add_argument("--quantity", choices=NOISE, default="displacement")
    parser.add_argument("--out", type=Path)
    chosen = parser.parse_args()
    errors = [one(seed, chosen.duration, chosen.quantity) for seed in range(chosen.campaigns)]
    table = summary(errors)
    for name, row in table.items():
        share, spread = 100 * row["coverage90"], row["sd_of_z"]
        ends = f"{100 * row['low']:.0f} to {100 * row['high']:.0f}"
        print(f"{name:8s} {share:5.1f} % ({ends})  sd of z {spread:.3f}  n {row['n']}")
    if chosen.out is not None:
        commit = subprocess.run(
            ["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=False
        ).stdout.strip()
        content = {
            "question": "coverage of 90 % intervals, base model, paper's rig",
            "campaigns": chosen.campaigns, "duration_s": chosen.duration, "commit": commit,
            "quantity": chosen.quantity,
            "date": datetime.now(UTC).date().isoformat(), "machine": platform.machine(),
            "parameters": table,
        }  # fmt: skip
        chosen.out.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
