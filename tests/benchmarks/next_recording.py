"""Does the recording that is proposed settle an ambiguous diagnosis? The independent rig makes it.

    python tests/benchmarks/next_recording.py RUN --seeds 82000 82060

Small campaigns of the rig hide one effect each, a little above what they could detect, so that
rivals come within the decisive odds. Where the diagnosis is ambiguous, the first proposal is
recorded and the campaign diagnosed again; beside it, the best repeat of a recording. RUN keeps a
file per seed, and a run goes on where it stopped. Writes next_recording.json beside this file: the
shares that were then named, and the slope of obtained against predicted ln odds for the planted
effect over its rivals.
"""

from __future__ import annotations

import sys
from pathlib import Path

if __name__ == "__main__":  # imports go by the tests' folder, not by this one
    sys.path[0] = str(Path(__file__).resolve().parents[1])

import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from math import inf, sqrt
from typing import Any

import numpy as np
from benchmarks.record import stored

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.recording import Recording
from bayesimpact.design.candidates import PlannedRecording
from bayesimpact.design.hypotheses import Rivalry, rivalry
from bayesimpact.design.rank import Z90, Proposal, proposals
from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.diagnosis.loop import Diagnosis
from bayesimpact.inference.fit import Fit
from bayesimpact.trial.draw.one_trial import draw
from bayesimpact.trial.draw.settings import Settings
from bayesimpact.trial.rig.measuring_chain import MeasuringChain
from bayesimpact.trial.rig.recordings import Release, Rig, record
from bayesimpact.trial.run.stamp import origin

STORE = Path(__file__).with_suffix(".json")
EFFECTS = (
    "contact_damping_indentation", "contact_damping_speed", "contact_hardening",
    "contact_power_law", "contact_second_stage", "contact_relaxation", "obstacle_mass",
    "gap_wear", "coulomb_friction", "quadratic_drag", "spring_quadratic", "spring_cubic",
    "opposite_stop", "power_damping", "structural_damping", "contact_no_tension", "hunt_crossley",
    "adhesion", "stiffness_drift", "sensor_quadratic",
)  # fmt: skip
SETTINGS = Settings(
    kinds=("single",),
    effects=EFFECTS,
    strength=(1.0, 1.8),
    rig_kinds=("small",),
    noises=("white",),
    search=False,
)
LARGEST = 50.0
"""Predicted ln odds up to which the slope counts, nats: beyond, nothing depends on their size."""

Row = dict[str, Any]


def recorded(
    truth: Mapping[str, Any], design: PlannedRecording, rng: np.random.Generator
) -> Recording:
    """The rig's recording of a design, released by hand as the trial's others."""
    p = truth["parameters"]
    k2 = {name[3:-1]: value for name, value in p.items() if name.startswith("k2[")}
    rig = Rig(truth["mass_kg"], p["c1"], p["k1"], p.get("c2", 0.0), p.get("g", inf), k2)
    effects = {one["id"]: one["parameters"] for one in truth["planted"]}
    noise, speed = truth["noise_m"], abs(design.y0) * sqrt(rig.k1 / rig.mass)
    y0 = design.y0 * (1 + 0.02 * rng.standard_normal())
    v0 = design.v0 + 4e-3 * speed * rng.standard_normal()
    offsets = {"new": float(2 * noise * rng.standard_normal())}
    white = truth.get("noise_white_share", 0.0)
    chain = MeasuringChain(
        noise, truth["noise_correlation"], offsets, None, truth["rounding_m"], white
    )
    samples = record(
        rig, Release("new", design.case, y0, v0), effects, chain,
        rate=1 / design.interval, duration=design.samples * design.interval, rng=rng,
        rtol=1e-10, atol=1e-12,
    )  # fmt: skip
    return Recording("new", design.case, samples, design.interval)


def diagnosed(campaign: Campaign, seed: int) -> Diagnosis:
    """As in trials without the global search."""
    return diagnose(campaign, rng=np.random.default_rng(seed), search=False)


def outcome(p: Proposal, found: Diagnosis, rivals: Rivalry) -> Row:
    """What a recording was expected to bring, and what it brought."""
    tried = {frozenset(c.ids): c for c in found.selection.tried}
    odds = {ids: found.selection.log_odds(c) for ids, c in tried.items()}
    first = tried.get(frozenset(rivals.hypotheses[0].ids))
    return {
        "halves": {
            name: [before, after, None if first is None else sd_of(first.fit, name) * Z90]
            for name, (before, after) in p.halves.items()
        },
        "kind": p.design.kind,
        "case": p.design.case,
        "y0": p.design.y0,
        "odds": p.odds.tolist(),
        "log_odds": p.log_odds,
        "chance": p.chance,
        "verdict": found.verdict,
        "effects": [e.id for e in found.effects],
        "after": [odds.get(frozenset(h.ids)) for h in rivals.hypotheses],
    }


def sd_of(fit: Fit, name: str) -> float:
    """Standard deviation of one parameter."""
    return float(fit.sd[fit.names.index(name)])


def trial(seed: int) -> Row:
    """One seed: the first diagnosis and, where it is ambiguous, those with a further recording."""
    drawn = draw(SETTINGS, seed)
    first = diagnosed(drawn.campaign, seed)
    row: Row = {"seed": seed, "verdict": first.verdict, "truth": drawn.truth["planted"][0]["id"]}
    if first.verdict != "ambiguous":
        return row
    rivals = rivalry(first)
    ranked = proposals(rivals, rng=np.random.default_rng(0))
    chosen = {
        "next": next(p for p in ranked if p.design.joins and not p.design.repeats),
        "repeat": next(p for p in ranked if p.design.repeats),
    }
    row |= {
        "ids": [h.ids for h in rivals.hypotheses],
        "lo": [h.log_odds for h in rivals.hypotheses],
        "arms": {},
    }
    for arm, p in chosen.items():
        new = recorded(drawn.truth, p.design, np.random.default_rng([seed, 1]))
        again = replace(drawn.campaign, recordings=(*drawn.campaign.recordings, new))
        row["arms"][arm] = outcome(p, diagnosed(again, seed), rivals)
    return row


def pairs(rows: Sequence[Row]) -> np.ndarray:
    """Predicted and obtained ln odds of the planted effect over every rival, (n, 2), both arms."""
    found = []
    for row in rows:
        if [row["truth"]] not in [list(ids) for ids in row["ids"]]:
            continue
        i = [list(ids) for ids in row["ids"]].index([row["truth"]])
        for arm in row["arms"].values():
            for j, after in enumerate(arm["after"]):
                if j != i and after is not None and arm["after"][i] is not None:
                    before = row["lo"][i] - row["lo"][j]
                    found.append((arm["odds"][i][j], arm["after"][i] - after - before))
    return np.array(found).reshape(-1, 2)


def slope(predicted: np.ndarray, obtained: np.ndarray) -> tuple[float, float]:
    """Slope through the origin and its standard error; the variance of ln odds is twice them."""
    weight = 1 / (2 * np.maximum(predicted, 0.5))
    total = float(np.sum(weight * predicted**2))
    return float(np.sum(weight * predicted * obtained)) / total, 1 / sqrt(total)


def summary(rows: Sequence[Row]) -> Row:
    """Shares settled, and the slope."""
    open_ = [row for row in rows if "arms" in row]
    seeds = [row["seed"] for row in rows]
    result: Row = {"seeds": [min(seeds), max(seeds)], "trials": len(rows), "ambiguous": len(open_)}
    for arm in ("next", "repeat"):
        ends = [(row["truth"], row["arms"][arm]) for row in open_]
        result[arm] = {
            "settled": sum(a["verdict"] == "named" for _, a in ends),
            "right": sum(a["verdict"] == "named" and a["effects"] == [t] for t, a in ends),
            "expected": sum(a["chance"] for _, a in ends),
        }
    halves = [
        h for row in open_ for a in row["arms"].values() for h in a.get("halves", {}).values()
    ]
    known = np.log([[b / a, b / o] for b, a, o in halves if o]).reshape(-1, 2)
    if len(known):  # how much narrower k2 became, in logarithms, over what was predicted
        ratio = known[:, 1] / known[:, 0]
        result["narrowing"] = {"median": float(np.median(ratio)), "intervals": len(known)}
    both = pairs(open_)
    near = both[both[:, 0] <= LARGEST]
    if near.size:
        value, error = slope(*near.T)
        result["slope"] = {"value": value, "se": error, "pairs": len(near), "beyond": len(both)}
        result["slope"]["beyond"] -= len(near)
    return result


def main() -> None:
    """Run what is missing, then sum up."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", type=Path)
    parser.add_argument("--seeds", type=int, nargs=2, default=(82000, 82060))
    chosen = parser.parse_args()
    chosen.run.mkdir(parents=True, exist_ok=True)
    rows = [stored(chosen.run / f"{s}.json", partial(trial, s)) for s in range(*chosen.seeds)]
    result = {**origin(), "settings": SETTINGS.document(), **summary(rows), "rows": rows}
    STORE.write_text(json.dumps(result).replace('{"seed"', '\n{"seed"') + "\n", encoding="utf-8")
    print(json.dumps({k: v for k, v in result.items() if k not in ("rows", "settings")}, indent=1))


if __name__ == "__main__":
    main()
