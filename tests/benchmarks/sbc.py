"""Simulation-based calibration: is the posterior's width right?

Truths are drawn from priors, the independent rig records them, the posterior is computed with the
same priors. If all is right the rank of a truth among the posterior's draws is uniform (Cook,
Gelman and Rubin 2006; Talts et al. 2018, arXiv 1804.06788), for every parameter and for the log
likelihood. The priors are narrow and stated, so that no truth is unphysical and no mode is missed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
from benchmarks.uniformity import critical_tail, smallest_tail
from numpy.typing import NDArray

from bayesimpact.data.campaign import Campaign
from bayesimpact.inference.fit import Fit, PosteriorDensity
from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.mode import find_mode
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.inference.posterior import sample
from bayesimpact.inference.priors import Priors, prior_from_table
from bayesimpact.model.effects import EFFECTS
from bayesimpact.model.oscillator import Oscillator, build_oscillator
from bayesimpact.trial.rig.measuring_chain import MeasuringChain
from bayesimpact.trial.rig.recordings import Effects, Release, Rig, make_campaign

Array = NDArray[np.float64]
Table = Mapping[str, Mapping[str, Any]]

RATE, DURATION, NOISE = 500.0, 1.6, 5e-6
MASS = 0.503
CASES = MappingProxyType({"a": "1", "b": "2"})  # recording -> obstacle
DRAWS = 399  # of emcee and of the normal approximation
PROPOSALS = 2000
WIDER = 1.1  # standard deviations of the proposals over those of the normal approximation

Method = Literal["normal", "weighted", "emcee"]
LEVEL = 0.99


def _normal(mean: float, sd: float) -> Mapping[str, Any]:
    return {"distribution": "normal", "mean": mean, "sd": sd}


BASE_PRIORS: Table = {
    "c1": _normal(0.148, 0.02),
    "k1": _normal(808.556, 4.0),
    "c2": _normal(2.085, 0.1),
    "g": _normal(1.1e-3, 1e-5),
    "k2[1]": _normal(5350.0, 50.0),
    "k2[2]": _normal(2959.0, 50.0),
    **{f"y0[{r}]": _normal(-6e-3 + 1e-3 * i, 2e-5) for i, r in enumerate(CASES)},
    **{f"v0[{r}]": _normal(0.0, 2e-3) for r in CASES},
    **{f"offset[{r}]": _normal(0.0, 1e-5) for r in CASES},
    "sigma": {"distribution": "lognormal", "median": NOISE, "sigma": 0.1},
}

MODELS: Mapping[str, Table] = {
    "base": {},
    "coulomb_friction": {"coulomb_friction.force": _normal(4e-3, 6e-4)},
    "spring_cubic": {"spring_cubic.stiffness": _normal(0.0, 3e5)},
    "contact_damping_speed": {"contact_damping_speed.coefficient": _normal(2.0, 0.3)},
}
"""Model (the id of its added effect) -> priors beside those of the base model, SI."""


@dataclass(frozen=True, eq=False)
class Replicate:
    """One truth and its posterior.

    Attributes
    ----------
    names : parameters, then "log_likelihood"
    ranks : (d + 1,), share of the posterior's draws below the truth, in (0, 1)
    errors : (d,), mode minus truth in the posterior's standard deviations
    """

    names: tuple[str, ...]
    ranks: Array
    errors: Array


def replicate(model: str, seed: int, method: Method = "weighted") -> Replicate:
    """Draw a truth of `model`, record it, rank it in its posterior.

    Parameters
    ----------
    method : how the posterior is drawn from: `normal`, the approximation at the mode; `weighted`,
        that approximation widened, each draw with its weight; `emcee`, the sampler
    """
    rng = np.random.default_rng([seed, list(MODELS).index(model)])
    table = {**BASE_PRIORS, **MODELS[model]}
    truth = {name: float(prior_from_table(name, row).sample(rng)) for name, row in table.items()}
    campaign = _record(model, truth, table, rng)
    density = _target(model, campaign, table)
    names = density.oscillator.layout.names
    start = np.array([_centre(table[name]) for name in names])
    steps = 0.05 * np.array([_width(table[name]) for name in names])
    fit = find_mode(density, start, steps=steps)
    draws, weights = _posterior(fit, method, seed, rng)
    true = np.array([truth[name] for name in names])
    likelihood = density.likelihood
    values = np.column_stack([draws, likelihood(draws)])
    own = np.append(true, likelihood(true[None]))
    ranks = (weights @ (values < own) + rng.random(own.size)) / (weights.sum() + 1)
    return Replicate((*names, "log_likelihood"), ranks, (fit.mode - true) / fit.sd)


def _record(
    model: str, truth: Mapping[str, float], table: Table, rng: np.random.Generator
) -> Campaign:
    k2 = {case: truth[f"k2[{case}]"] for case in CASES.values()}
    rig = Rig(MASS, truth["c1"], truth["k1"], truth["c2"], truth["g"], k2)
    releases = [Release(r, c, truth[f"y0[{r}]"], truth[f"v0[{r}]"]) for r, c in CASES.items()]
    offsets = {r: truth[f"offset[{r}]"] for r in CASES}
    chain = MeasuringChain(noise=truth["sigma"], offsets=offsets)
    numbers = {n.split(".")[1]: v for n, v in truth.items() if "." in n}
    effects: Effects = {} if model == "base" else {model: numbers}
    return make_campaign(
        "calibration", rig, releases, effects, chain, rate=RATE, duration=DURATION, rng=rng
    )


def _target(model: str, campaign: Campaign, table: Table) -> PosteriorDensity:
    added = [effect for effect in EFFECTS if effect.id == model]
    oscillator: Oscillator = build_oscillator(campaign, added)
    priors = tuple(prior_from_table(n, table[n]) for n in oscillator.layout.names)
    return PosteriorDensity(Likelihood(oscillator, Noise(level=NOISE)), Priors(priors))


def _centre(row: Mapping[str, Any]) -> float:
    return float(row["mean"] if "mean" in row else row["median"])


def _width(row: Mapping[str, Any]) -> float:
    return float(row["sd"] if "sd" in row else row["median"] * row["sigma"])


def _posterior(
    fit: Fit, method: Method, seed: int, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Draws (S, d), and weights (S,) whose sum is the equivalent number of independent draws."""
    if method == "emcee":
        draws = sample(fit, seed=seed).thinned(DRAWS, rng)
        return draws, np.ones(draws.shape[0])
    wide = 1.0 if method == "normal" else WIDER
    count = DRAWS if method == "normal" else PROPOSALS
    values, vectors = np.linalg.eigh(fit.covariance / np.outer(fit.sd, fit.sd))
    root = wide * fit.sd[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    unit = rng.standard_normal((count, fit.mode.size))
    draws = fit.mode + unit @ root.T
    if method == "normal":
        draws = draws[np.isfinite(fit.density.priors.log_density(draws))]
        return draws, np.ones(draws.shape[0])
    log_weight = fit.density(draws) + 0.5 * np.sum(unit**2, axis=1)
    weight = np.exp(log_weight - log_weight.max())
    return draws, weight * weight.sum() / np.sum(weight**2)


def verdicts(
    replicates: Sequence[Replicate], rng: np.random.Generator, level: float = LEVEL
) -> dict[str, Any]:
    """Per parameter: does the distribution of its ranks stay inside the band, and its coverage?"""
    names = replicates[0].names
    ranks = np.array([r.ranks for r in replicates])
    errors = np.array([r.errors for r in replicates])
    critical = critical_tail(len(replicates), level, rng)
    rows: dict[str, Any] = {}
    for i, name in enumerate(names):
        tail = float(smallest_tail(ranks[:, i]))
        rows[name] = {
            "inside": tail >= critical,
            "tail": tail,
            "covered_90": float(np.mean(np.abs(ranks[:, i] - 0.5) <= 0.45)),
        }
        if i < errors.shape[1]:
            rows[name] |= {
                "mean_error": float(errors[:, i].mean()),
                "sd_error": float(errors[:, i].std()),
            }
        rows[name]["ranks"] = [round(float(x), 4) for x in np.sort(ranks[:, i])]
    outside = [name for name in names if not rows[name]["inside"]]
    count = {"replicates": len(replicates), "level": level, "critical_tail": critical}
    return {**count, "outside": outside, "parameters": rows}
