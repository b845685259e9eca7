"""How large must an effect be to be found, and to be found by its name? On the bundled rig.

Theory first. An effect of expected score z is detected with probability Phi(z - c), c being the
score at which the corrected test answers. It is named when the evidence beats the nearest rival by
the decisive odds t: with d = z sqrt(1 - rho^2) the distance between the two, the difference of
their log likelihoods is normal with mean d^2 / 2 and standard deviation d, so that happens with
probability Phi((d^2 / 2 - t) / d). Blind trials of fixed strength check both (`observed`).

    python tests/benchmarks/detection_power.py

Writes detection_power.json beside this file; `figures.py` draws it. With `--trials RUN` (folders of
`bayesimpact trial --kinds single --rig paper --noise white --strength 1 1 ...`) also what those
runs saw.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.optimize import brentq

from bayesimpact.data.campaign import Measurement
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.score_test.scan import scan
from bayesimpact.diagnosis.thresholds import DECISIVE, largest_log_odds
from bayesimpact.model.effects import EFFECTS
from bayesimpact.trial.bundle import PAPER_HEIGHTS, PAPER_RIG
from bayesimpact.trial.draw.designs import DrawnRig
from bayesimpact.trial.draw.planted_effects import PLANTED_EFFECTS
from bayesimpact.trial.draw.sensitivity import Sensitivity, clean_readings, misfit
from bayesimpact.trial.draw.sizing import LIMIT, Unsuitable, sized
from bayesimpact.trial.rig.measuring_chain import MeasuringChain
from bayesimpact.trial.rig.recordings import Release
from bayesimpact.trial.run.stamp import origin
from bayesimpact.trial.score.summary import rate

Array = NDArray[np.float64]

FAMILIES = 3  # of tests that share the alarm probability: scores, forcing, hum
NULL_DRAWS = 200_000
NINETY = 0.9
STRENGTHS = np.geomspace(0.2, 40.0, 400)
STORE = Path(__file__).with_suffix(".json")
SHOWN = slice(None, None, 8)  # of STRENGTHS, in detection_power.json


@dataclass(frozen=True)
class Power:
    """One effect on one design.

    Attributes
    ----------
    effect, size_name : which, and the number that grows with its size
    limit : that number (its distance from null) at the detection limit, SI
    exponent : the score grows as size to this power near the limit
    distinct, nearest : share of the response that the nearest rival cannot imitate, and which it is
    """

    effect: str
    size_name: str
    limit: float
    exponent: float
    distinct: float
    nearest: str

    def detected(self, strength: Array, critical: float) -> Array:
        """Probability of an alarm at `strength` detection limits (by score)."""
        return np.asarray(stats.norm.cdf(LIMIT * strength - critical))

    def named(self, strength: Array, critical: float) -> Array:
        """Probability that it is detected and beats its nearest rival decisively."""
        apart = np.maximum(LIMIT * strength * self.distinct, 1e-9)
        wins = stats.norm.cdf((0.5 * apart**2 - DECISIVE) / apart)
        return np.asarray(wins * self.detected(strength, critical))

    def size(self, strength: float) -> float:
        """The size whose score is `strength` detection limits, SI."""
        return float(self.limit * strength ** (1 / self.exponent))


def bundled_design(recordings: int = 9) -> DrawnRig:
    """The bundled rig and its chain with any number of recordings, obstacles in turn."""
    releases = []
    for i in range(recordings):
        case = list(PAPER_RIG.k2)[i % 3]
        height = PAPER_HEIGHTS[i // 3 % 3][1] * (1 - 0.02 * (i // 9))
        releases.append(Release(f"case{case}_{i // 3 + 1}", case, height, 1e-3 * (-1) ** i))
    chain = MeasuringChain(
        noise=5e-6, offsets={r.name: 1e-5 * (-1) ** i for i, r in enumerate(releases)}
    )
    return DrawnRig("paper", "white", PAPER_RIG, tuple(releases), 1000.0, 6.0, chain, Measurement())


def p_value_of(log_odds: float) -> float:
    """The p-value that stands for such log odds at most, nats, above 0."""
    return float(np.exp(brentq(lambda x: largest_log_odds(np.exp(x)) - log_odds, -600.0, -1.0)))


def critical_score(sensitivity: Sensitivity, rng: np.random.Generator) -> float:
    """Score at which the corrected test of one more size answers, under the law of all scores."""
    found = scan(sensitivity.fit, EFFECTS, campaign_scales(sensitivity.fit), rng=rng)
    information = found.projection.information
    scale = np.sqrt(np.diag(information))
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    draws = rng.standard_normal((NULL_DRAWS, scale.size)) @ root.T
    return float(np.quantile(np.abs(draws).max(axis=1), 1 - p_value_of(DECISIVE) / FAMILIES))


def power(sensitivity: Sensitivity, effect: str, rng: np.random.Generator) -> Power | None:
    """Detection limit of one effect and its distance from the nearest rival.

    None for effects without a size, and those that this design cannot show.
    """
    form = PLANTED_EFFECTS[effect].form(sensitivity.design, rng)
    if form.start == 0:
        return None
    try:
        small, large = (sized(sensitivity, effect, form, s) for s in (1.0, 2.0))
    except Unsuitable:
        return None
    exponent = np.log(large.score / small.score) / np.log(large.size / small.size)
    left, nearest = sensitivity.distinct(small.response, besides=effect)
    limit = small.size * (LIMIT / small.score) ** (1 / exponent)
    name = next(iter(form.build(small.size)))
    return Power(effect, name, float(limit), float(exponent), left / small.score, nearest)


def reaching(curve: Array, probability: float = NINETY) -> float | None:
    """Smallest of STRENGTHS from which on a curve stays at `probability`; None beyond them."""
    below = np.flatnonzero(curve < probability)
    if below.size and below[-1] == curve.size - 1:
        return None
    return float(STRENGTHS[below[-1] + 1] if below.size else STRENGTHS[0])


def limits_by_recordings(
    effects: Sequence[Power], counts: Sequence[int], rng: np.random.Generator
) -> dict[str, dict[int, float]]:
    """Effect -> number of recordings -> detection limit over that of nine recordings.

    The effect is planted at its limit; scores of the first n recordings say how far it stands out.
    """
    whole = bundled_design(max(counts))
    table: dict[str, dict[int, float]] = {}
    for one in effects:
        form = PLANTED_EFFECTS[one.effect].form(bundled_design(), rng)
        if any(isinstance(v, Mapping) for v in form.build(0.0).values()):
            continue  # another thing with every number of recordings
        reference = clean_readings(whole, form.reference) if form.reference else None
        readings = clean_readings(whole, {one.effect: form.build(one.limit)})
        scores = {}
        for n in {*counts, 9}:
            part = replace(whole, releases=whole.releases[:n])
            left = misfit(part, readings[:n])
            if reference is not None:
                left = left - misfit(part, reference[:n])
            scores[n] = float(np.linalg.norm(left))
        table[one.effect] = {n: (scores[9] / scores[n]) ** (1 / one.exponent) for n in counts}
    return table


def power_table(
    rng: np.random.Generator, counts: Sequence[int] = (3, 6, 9, 18, 27)
) -> dict[str, Any]:
    """The content of detection_power.json, theory only."""
    sensitivity = Sensitivity(bundled_design(), rng)
    critical = critical_score(sensitivity, rng)
    found = [p for p in (power(sensitivity, e, rng) for e in PLANTED_EFFECTS) if p is not None]
    rows = {}
    for one in found:
        detected, named = one.detected(STRENGTHS, critical), one.named(STRENGTHS, critical)
        at_detected, at_named = reaching(detected), reaching(named)
        rows[one.effect] = {
            "size": one.size_name,
            "limit": one.limit,
            "exponent": one.exponent,
            "distinct": one.distinct,
            "nearest": one.nearest,
            "detected_90": at_detected,
            "named_90": at_named,
            "detected_90_size": None if at_detected is None else one.size(at_detected),
            "named_90_size": None if at_named is None else one.size(at_named),
            "detected": [round(float(p), 4) for p in detected[SHOWN]],
            "named": [round(float(p), 4) for p in named[SHOWN]],
        }
    return {
        "schema": "bayesimpact/power/1",
        "critical_score": critical,
        "decisive": DECISIVE,
        "strengths": [round(float(x), 4) for x in STRENGTHS[SHOWN]],
        "effects": rows,
        "limit_by_recordings": {
            effect: {str(n): v for n, v in row.items()}
            for effect, row in limits_by_recordings(found, counts, rng).items()
        },
    }


def observed(results: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """Effect -> strength -> share of trials with an alarm and with the right name.

    `results` are stored trials of single effects; strengths are rounded to a tenth of an octave.
    """
    groups: dict[tuple[str, float], list[Mapping[str, Any]]] = {}
    for r in results:
        if "score" in r and r["truth"]["kind"] == "single":
            planted = r["truth"]["planted"][0]
            octave = round(10 * np.log2(planted["strength"])) / 10
            groups.setdefault((planted["id"], octave), []).append(r["score"])
    table: dict[str, dict[str, Any]] = {}
    for (effect, octave), scores in sorted(groups.items()):
        alarms = sum(s["verdict"] != "adequate" for s in scores)
        named = sum(s["outcome"] == "named" for s in scores)
        wrong = sum(s["outcome"] == "wrong name" for s in scores)
        table.setdefault(effect, {})[f"{2**octave:.2f}"] = {
            "detected": rate(alarms, len(scores)),
            "named": rate(named, len(scores)),
            "wrong_name": rate(wrong, len(scores)),
        }
    return table


def power_text(document: Mapping[str, Any]) -> str:
    """The table of detection_power.json: limits, and sizes found and named nine times in ten."""
    heads = " ".join(f"{head:>10s}" for head in ("limit", "detected", "named"))
    lines = [f"{'effect':30s} {'number':12s} {heads}  nearest rival"]
    for effect, row in document["effects"].items():
        cells = [row["limit"], row["detected_90_size"], row["named_90_size"]]
        sizes = " ".join(f"{'-':>10s}" if c is None else f"{c:10.3g}" for c in cells)
        share = f"{row['nearest']} ({100 * row['distinct']:.0f} % apart)"
        lines.append(f"{effect:30s} {row['size']:12s} {sizes}  {share}")
    lines += ["", "limit against that of nine recordings"]
    for effect, row in document["limit_by_recordings"].items():
        counts = "  ".join(f"{n}: {v:.2f}" for n, v in row.items())
        lines.append(f"{effect:30s} {counts}")
    return "\n".join(lines) + "\n"


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
