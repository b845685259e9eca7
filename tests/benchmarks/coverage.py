"""Do 90 % intervals hold the truth nine times in ten? The bundled rig, nothing concealed.

    python tests/benchmarks/coverage.py RUN --quantity velocity --seeds 310000 310100
    python tests/benchmarks/coverage.py RUN --quantity acceleration --seeds 310000 310100
    python tests/benchmarks/coverage.py RUN --collect

The independent rig records; every campaign has its own releases, rest readings and noise, and
takes the path of `bayesimpact fit`: faults, search, mode. Counted are the intervals that `fit` and
`diagnose --quick` report, normal about the mode; of the first `--sampled` campaigns also those of
`bayesimpact sample` (emcee takes minutes). RUN keeps a file per campaign, and a run goes on where
it stopped. Writes coverage_<quantity>.json beside this file; `--collect` only sums up what RUN has.

Probes of velocity and acceleration have the noise with which they tell as much as the probe of the
paper: white at 1 kHz, sized so that the base parameters' standard deviations are, in the geometric
mean, those of displacements with 5 um (`test_the_three_probes_tell_as_much`).
"""

from __future__ import annotations

import sys
from pathlib import Path

if __name__ == "__main__":  # imports go by the tests' folder, not by this one
    sys.path[0] = str(Path(__file__).resolve().parents[1])

import argparse
import json
import time
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from benchmarks.record import stored
from scipy import stats

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.quantity import Quantity
from bayesimpact.inference.identify import identify
from bayesimpact.inference.posterior import sample
from bayesimpact.trial.bundle import PAPER_RIG, paper_releases
from bayesimpact.trial.rig.measuring_chain import MeasuringChain
from bayesimpact.trial.rig.recordings import Release, Rig, make_campaign
from bayesimpact.trial.run.stamp import origin
from bayesimpact.trial.score.rates import rate_in_groups
from bayesimpact.workflow import without_faults

NOISE: Mapping[Quantity, float] = {
    "displacement": 5e-6,
    "velocity": 2.25e-4,
    "acceleration": 1.25e-2,
}
"""Of every probe, m, m/s, m/s2: see the module."""
QUANTILE = stats.norm.ppf(0.95)
WAYS = ("normal", "sampled")
SAMPLED = 20
SEED = 2026

Row = dict[str, Any]


def truth_of(
    rig: Rig, releases: Iterable[Release], offsets: Mapping[str, float]
) -> dict[str, float]:
    """Every parameter's true value by its name."""
    values = {"c1": rig.c1, "k1": rig.k1, "c2": rig.c2, "g": rig.g}
    values |= {f"k2[{case}]": k2 for case, k2 in rig.k2.items()}
    for release in releases:
        values[f"y0[{release.name}]"] = release.y0
        values[f"v0[{release.name}]"] = release.v0
        values[f"offset[{release.name}]"] = offsets[release.name]
    return values


def recorded(
    seed: int, quantity: Quantity, duration: float = 6.0, recordings: int = 9
) -> tuple[Campaign, dict[str, float]]:
    """A campaign of the bundled rig, nine recordings at 1 kHz unless fewer are asked for."""
    rng = np.random.default_rng([SEED, seed])
    releases, noise = paper_releases(rng)[:recordings], NOISE[quantity]
    offsets = {r.name: float(2 * noise * rng.standard_normal()) for r in releases}
    campaign = make_campaign(
        "coverage", PAPER_RIG, releases, chain=MeasuringChain(noise=noise, offsets=offsets),
        rate=1000.0,
        duration=duration, rng=rng, quantity=quantity,
    )  # fmt: skip
    return campaign, truth_of(PAPER_RIG, releases, offsets) | {"sigma": noise}


def one(seed: int, quantity: Quantity, sampled: bool = True, **size: Any) -> Row:
    """One campaign: whether each interval holds the truth, and errors in standard deviations."""
    began = time.perf_counter()
    campaign, truth = recorded(seed, quantity, **size)
    made = time.perf_counter()
    fit = identify(without_faults(campaign), rng=np.random.default_rng(seed)).fit
    found = time.perf_counter()
    row: Row = {
        "seed": seed, "quantity": quantity, "converged": fit.converged,
        "recordings": len(campaign.recordings), "duration_s": size.get("duration", 6.0),
        "made_s": round(made - began, 2), "seconds": round(found - made, 2), "parameters": {},
    }  # fmt: skip
    for name, mode, sd in zip(fit.names, fit.mode, fit.sd, strict=True):
        z = float((mode - truth[name]) / sd)
        row["parameters"][name] = {"normal": bool(abs(z) <= QUANTILE), "z": z}
    if sampled:
        posterior = sample(fit, seed=seed)
        row["converged"] &= posterior.chains.converged
        row["sampled_s"] = round(time.perf_counter() - found, 2)
        for name, column in zip(fit.names, posterior.draws.T, strict=True):
            low, high = np.percentile(column, [5, 95])
            row["parameters"][name]["sampled"] = bool(low <= truth[name] <= high)
    return row


def kind_of(name: str) -> str:
    """Nuisances of all recordings count together."""
    return name.split("[")[0] if name.startswith(("y0", "v0", "offset")) else name


def summary(rows: Sequence[Row]) -> dict[str, dict[str, Any]]:
    """Coverage of both kinds of intervals and spread of the standardised errors per parameter."""
    kinds: dict[str, list[list[Row]]] = {}
    for row in rows:
        own: dict[str, list[Row]] = {}
        for name, found in row["parameters"].items():
            own.setdefault(kind_of(name), []).append(found)
        for kind, found in own.items():
            kinds.setdefault(kind, []).append(found)
    result = {}
    for kind, groups in kinds.items():
        z = np.array([f["z"] for group in groups for f in group])
        result[kind] = {
            way: rate_in_groups([[f[way] for f in group if way in f] for group in groups])
            for way in WAYS
        } | {"sd_of_z": float(z.std()), "mean_of_z": float(z.mean())}
    return result


def document(rows: Sequence[Row], quantity: Quantity) -> dict[str, Any]:
    """What is stored of a run."""
    seeds = sorted(row["seed"] for row in rows)
    return {
        "question": "coverage of 90 % intervals, base model, bundled rig",
        **origin(), "quantity": quantity, "noise": NOISE[quantity], "campaigns": len(rows),
        "seeds": [seeds[0], seeds[-1]], "recordings": max(row["recordings"] for row in rows),
        "sampled": sum("sampled_s" in row for row in rows),
        "duration_s": max(row["duration_s"] for row in rows),
        "not_converged": [row["seed"] for row in rows if not row["converged"]],
        "median_s": float(np.median([row["seconds"] for row in rows])),
        "parameters": summary(rows),
    }  # fmt: skip


def store_of(quantity: Quantity) -> Path:
    """Where a summary is kept."""
    return Path(__file__).with_name(f"coverage_{quantity}.json")


def run(
    folder: Path, quantity: Quantity, seeds: Iterable[int], sampled: int = SAMPLED, **size: Any
) -> list[Row]:
    """Campaigns that the folder lacks are run; rows of those asked for."""
    folder.mkdir(parents=True, exist_ok=True)
    return [
        stored(
            folder / f"{quantity}-{seed}.json",
            partial(one, seed, quantity, number < sampled, **size),
        )
        for number, seed in enumerate(seeds)
    ]


def kept(folder: Path, quantity: Quantity) -> list[Row]:
    """Rows of all campaigns that a run has finished so far."""
    files = sorted(folder.glob(f"{quantity}-*.json"))
    return [json.loads(file.read_text(encoding="utf-8")) for file in files]


def main(arguments: Sequence[str] | None = None) -> None:
    """Run what is missing, store the summary, print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", type=Path)
    parser.add_argument("--quantity", choices=list(NOISE), action="append")
    parser.add_argument("--seeds", type=int, nargs=2, default=(310000, 310100))
    parser.add_argument("--sampled", type=int, default=SAMPLED, help="campaigns sampled as well")
    parser.add_argument("--collect", action="store_true", help="sum up, run nothing")
    chosen = parser.parse_args(arguments)
    for quantity in chosen.quantity or ("velocity", "acceleration"):
        if not chosen.collect:
            run(chosen.run, quantity, range(*chosen.seeds), chosen.sampled)
        rows = kept(chosen.run, quantity)
        if not rows:
            continue
        result = document(rows, quantity)
        store_of(quantity).write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
        print(f"{quantity}: {len(rows)} campaigns")
        for name, row in result["parameters"].items():
            low, high = (100 * end for end in row["normal"]["interval"])
            shown = f"{100 * row['normal']['rate']:5.1f} % ({low:.0f} to {high:.0f})"
            also = f"sampled {row['sampled']['hits']} of {row['sampled']['of']}"
            print(f"{name:8s} {shown}, {also}  sd of z {row['sd_of_z']:.3f}")


if __name__ == "__main__":
    main()
