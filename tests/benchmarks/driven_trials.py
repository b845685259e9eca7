"""Is what is concealed in driven recordings with a stop named, and nothing where nothing is?

    python tests/benchmarks/driven_trials.py RUN --seeds 320000 320060

Rigs with a stop under a sine sweep, steps or noise in turn, one recording of 1,500 samples of
displacement each, integrated by SciPy's DOP853 (`driven_twin`). Every third rig hides nothing; the
others one effect of 5 to 12 detection limits, a limit being five standard errors of its size beside
all other unknowns. Diagnosed as trials of decays are without the global search. RUN keeps a file
per seed, and a run goes on where it stopped. Writes driven_trials.json beside this file.
"""

from __future__ import annotations

import sys
from pathlib import Path

if __name__ == "__main__":  # imports go by the tests' folder, not by this one
    sys.path[0] = str(Path(__file__).resolve().parents[1])

import argparse
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from benchmarks.record import stored
from driven_rigs import DrivenRig, driven_rig
from driven_twin import Law

from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.effects import EFFECTS
from bayesimpact.model.oscillator import build_oscillator
from bayesimpact.trial.run.stamp import origin
from bayesimpact.trial.score.rates import rate

STORE = Path(__file__).with_suffix(".json")
KINDS = ("sweep", "steps", "noise")
STRENGTH = (5.0, 12.0)
LIMIT = 5.0  # standard errors
REACH = 3e-3  # of the motion of `driven_rig`, m
CONTROLS = 3  # one in so many hides nothing

Row = dict[str, Any]


@dataclass(frozen=True)
class Hidden:
    """An effect: its parameter, its force per unit of it, a size at which to linearise.

    corner : the force has a kink or a jump at v = 0
    """

    parameter: str
    force: Callable[[float, float, float], float]  # of y, v and indentation (0 in flight)
    nominal: Callable[[Mapping[str, float]], float]  # of mass, k1, k2
    corner: bool = False


HIDDEN: Mapping[str, Hidden] = {
    "spring_cubic": Hidden(
        "stiffness", lambda y, v, d: y**3, lambda p: 1e-2 * p["k1"] / REACH**2
    ),
    "quadratic_drag": Hidden(
        "coefficient", lambda y, v, d: abs(v) * v, lambda p: 1e-2 * p["mass"] / REACH, True
    ),
    "coulomb_friction": Hidden(
        "force", lambda y, v, d: float(np.sign(v)), lambda p: 1e-3 * p["k1"] * REACH, True
    ),
    "contact_hardening": Hidden(
        "stiffness", lambda y, v, d: d**3, lambda p: 1e-1 * p["k2"] / REACH**2
    ),
    "contact_damping_indentation": Hidden(
        "coefficient", lambda y, v, d: d * v, lambda p: p["c2"] / REACH
    ),
}  # fmt: skip


def law(hidden: Hidden, size: float, gap: float) -> Law:
    """The force as the integrator takes it."""
    return lambda y, v, touching: size * hidden.force(y, v, (y - gap) * touching)


def standard_error(rig: DrivenRig, id: str, size: float) -> float:
    """Of the effect's size beside all other unknowns, from derivatives at the truth."""
    (effect,) = (e for e in EFFECTS if e.id == id)
    oscillator = build_oscillator(rig.campaign, [effect])
    name = f"{id}.{HIDDEN[id].parameter}"
    names = oscillator.layout.names
    known = {**rig.truth, name: size, "sigma": rig.noise}
    theta = np.array([known[n] for n in names])
    least = {"y0[a]": REACH, "v0[a]": REACH * np.sqrt(rig.truth["k1"] / rig.campaign.mass)}
    sizes = [max(abs(x), least.get(n, 0.0)) for n, x in zip(names, theta, strict=True)]
    steps = 1e-4 * np.array(sizes)
    (found,) = Likelihood(oscillator, Noise()).linearise(theta, steps)
    scale = np.linalg.norm(found.jacobian, axis=0)
    inverse = np.linalg.inv(found.jacobian.T @ found.jacobian / np.outer(scale, scale))
    at = list(found.columns).index(oscillator.layout.index(name))
    return float(rig.noise * np.sqrt(inverse[at, at]) / scale[at])


def trial(seed: int) -> Row:
    """One rig, what it hides, and what is said of it."""
    kind, inner = KINDS[seed % len(KINDS)], 8 * seed  # multiples of 8 have a stop
    turn, rng = seed // len(KINDS), np.random.default_rng([seed, 1])
    row: Row = {"seed": seed, "kind": kind, "truth": None}
    rig = driven_rig(inner, "displacement", kind=kind)
    if turn % CONTROLS:
        id = list(HIDDEN)[(turn - turn // CONTROLS - 1) % len(HIDDEN)]
        hidden, t = HIDDEN[id], rig.truth
        nominal = hidden.nominal({**t, "mass": rig.campaign.mass, "k2": t["k2[1]"]})
        near = driven_rig(
            inner, "displacement", law(hidden, nominal, t["g"]), corner=hidden.corner, kind=kind
        )
        strength = float(rng.uniform(*STRENGTH))
        size = strength * LIMIT * standard_error(near, id, nominal)
        rig = driven_rig(
            inner, "displacement", law(hidden, size, t["g"]), corner=hidden.corner, kind=kind
        )
        row |= {"truth": id, "strength": strength, "size": size}
    found = diagnose(rig.campaign, rng=np.random.default_rng(seed), search=False)
    named = [e.id for e in found.effects] if found.verdict in ("named", "partly") else []
    row |= {"verdict": found.verdict, "named": named, "effects": [e.id for e in found.effects]}
    if found.verdict == "named" and named == [row["truth"]]:
        full = f"{id}.{hidden.parameter}"
        low, median, high = found.intervals.quantiles(full)
        row |= {"found": [low, median, high], "inside": bool(low <= size <= high)}
    return row


def summary(rows: Sequence[Row]) -> Row:
    """Rates, of all and by the kind of input."""
    seeds = [row["seed"] for row in rows]
    result: Row = {"seeds": [min(seeds), max(seeds)], "trials": len(rows), "kinds": {}}
    for kind in ("all", *KINDS):
        own = [row for row in rows if kind in ("all", row["kind"])]
        quiet = [row for row in own if row["truth"] is None]
        hiding = [row for row in own if row["truth"] is not None]
        right = [row for row in hiding if row["verdict"] == "named" and "inside" in row]
        wrong = [row for row in own if not set(row["named"]) <= {row["truth"]}]
        result["kinds"][kind] = {
            "adequate": rate(sum(row["verdict"] == "adequate" for row in quiet), len(quiet)),
            "named": rate(len(right), len(hiding)),
            "wrong": rate(len(wrong), len(own)),
            "inside": rate(sum(row["inside"] for row in right), len(right)),
        }
    return result


def main() -> None:
    """Run what is missing, then sum up."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", type=Path)
    parser.add_argument("--seeds", type=int, nargs=2, default=(320000, 320060))
    chosen = parser.parse_args()
    chosen.run.mkdir(parents=True, exist_ok=True)
    rows = [stored(chosen.run / f"{s}.json", partial(trial, s)) for s in range(*chosen.seeds)]
    result = {**origin(), **summary(rows), "rows": rows}
    STORE.write_text(json.dumps(result).replace('{"seed"', '\n{"seed"') + "\n", encoding="utf-8")
    print(json.dumps(result["kinds"], indent=1))


if __name__ == "__main__":
    main()
