"""Results made up from random numbers, small enough that a report of them takes a moment."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from bayesimpact.inference.fit import Z90
from bayesimpact.model.units import per_mass_unit
from bayesimpact.report import checks
from bayesimpact.report.figures.save import drawers, figures_of
from bayesimpact.report.results import (
    BackboneCurve,
    BackboneSummary,
    Draws,
    MeasuringChainSummary,
    NoiseSummary,
    Provenance,
    RecordingResult,
    Results,
    Row,
    SamplerSummary,
    SearchSummary,
)
from bayesimpact.report.rows import widened

NOISE = 5e-6
MASS = 0.503
PHYSICAL = {"c1": (0.148, 1e-5, "N s/m"), "k1": (808.556, 3e-3, "N/m")}
STOP = {"c2": (2.085, 1.2e-4, "N s/m"), "g": (1.1e-3, 3.4e-8, "m")}


def row(name: str, value: float, sd: float, unit: str, role: str, **changes: Any) -> Row:
    """A row with a Gaussian posterior about `value`."""
    ci90 = (value - Z90 * sd, value + Z90 * sd)
    over = per_mass_unit(unit)
    ratio = (value / MASS, ci90[0] / MASS, ci90[1] / MASS) if over else (float("nan"),) * 3
    made = Row(name, unit, role, f"meaning of {name}", value, sd, value, ci90, ci90, ratio, over,
               {}, "uniform: lower 0, upper 1", sd)  # fmt: skip
    return replace(made, **changes)


def rows(names: list[str], cases: list[str], stop: bool) -> tuple[Row, ...]:
    """The unknowns of a campaign."""
    table = dict(PHYSICAL) | (STOP if stop else {})
    if stop:
        table |= {f"k2[{c}]": (5350.156 / (1 + i), 0.28, "N/m") for i, c in enumerate(cases)}
    found = [row(n, *values, "physical") for n, values in table.items()]
    for name in names:
        found += [
            row(f"y0[{name}]", -6.5e-3, 2.5e-7, "m", "nuisance"),
            row(f"v0[{name}]", 1.3e-4, 1.5e-5, "m/s", "nuisance"),
            row(f"offset[{name}]", 9.5e-6, 6.5e-8, "m", "nuisance"),
        ]
    return (*found, row("sigma", NOISE, 1.5e-8, "m", "noise"))


def recording(
    name: str, case: str, n: int, rng: np.random.Generator, excess: float
) -> RecordingResult:
    """A decaying cosine with noise `excess` times the stated one."""
    interval = 1e-3
    t = np.arange(n) * interval
    predicted = -6.5e-3 * np.exp(-0.15 * t) * np.cos(2 * np.pi * 6.4 * t)
    samples = predicted + excess * NOISE * rng.standard_normal(n)
    chi2 = float(np.mean((samples - predicted) ** 2)) / NOISE**2
    return RecordingResult(name, case, interval, 0.25, samples, predicted, NOISE * excess, NOISE,
                           chi2, 0.4)  # fmt: skip


def curve(name: str, case: str, branch: str, rng: np.random.Generator) -> BackboneCurve:
    """A branch of 12 swings."""
    amplitude = np.linspace(6e-3, 1e-3, 12)
    frequency = 6.39 + 200 * amplitude
    noise = 1e-3 * rng.standard_normal(12)
    damping = np.append(np.nan, np.linspace(0.03, 0.003, 11))

    def band(x: np.ndarray, half: float) -> np.ndarray:
        return np.stack([x - half, x, x + half], axis=1)

    times = np.arange(12) / 6.4
    bands = band(frequency, 2e-3), band(damping, 1e-4)
    return BackboneCurve(name, case, branch, times, amplitude, frequency + noise, damping, *bands)


def make_results(
    count: int = 3,
    cases: int = 2,
    *,
    n: int = 600,
    stop: bool = True,
    sampled: bool = True,
    converged: bool = True,
    excess: float = 1.0,
    seed: int = 1,
    **changes: Any,
) -> Results:
    """Results of `count` recordings of `cases` obstacles, assessed."""
    rng = np.random.default_rng(seed)
    labels = [str(i + 1) for i in range(cases)] if stop else [""]
    names = [f"run_{i}" for i in range(count)]
    recordings = tuple(
        recording(name, labels[i % len(labels)], n, rng, excess) for i, name in enumerate(names)
    )
    table = rows(names, labels, stop)
    interest = [r for r in table if r.role == "physical"]
    d, p = len(table), len(interest)
    generations = np.arange(1, 41)
    best = 1e4 * np.exp(-generations / 4.0)
    search = SearchSummary(100.0 * generations, best, 2 * best, best, best, "converged", True, 0.01)
    sampler = draws = backbone = None
    if sampled:
        values = np.array([r.median for r in interest]) + np.array([r.sd for r in interest]) * (
            rng.standard_normal((1200, p))
        )
        draws = Draws(
            "posterior", tuple(r.name for r in interest), tuple(r.unit for r in interest), values
        )
        sampler = SamplerSummary(
            converged, () if converged else ("independent ensembles disagree",),
            tuple(r.name for r in table), np.full(d, 1.7), np.full(d, 9000.0), np.full(d, 8000.0),
            np.full(d, 1.0004), 2, 150, 72, 21600, 0.8, draws.names, draws.units,
            values[:600].reshape(2, 100, 3, p), np.arange(100.0),
        )  # fmt: skip
        curves = [curve(r.name, r.case, b, rng) for r in recordings for b in ("upper", "lower")]
        groups = (*labels, "all") if len(labels) > 1 else (labels[0] or "all",)
        k = len(groups)
        backbone = BackboneSummary(
            tuple(curves), 0.9, groups, np.full(k, 0.91), np.full(k, 0.35), 200
        )
    chi2 = float(np.mean([r.reduced_chi2 for r in recordings]))
    made = Results(
        name="rig <1> & others", mass=MASS, stop=stop, quantity="displacement",
        recordings=recordings, rows=table, effects=(),
        noise=NoiseSummary("white", NOISE, 0.003, 0.0, "polynomial remainders", True),
        chain=MeasuringChainSummary("", 0.0, 0.0, 0.0), verdict="", headline="", reduced_chi2=chi2,
        chi2_z=(chi2 - 1) / np.sqrt(2 / (count * n)), log_posterior=1234.5,
        covariance=np.diag([r.sd**2 for r in table]), fit_converged=True, search=search,
        sampler=sampler, draws=draws, backbone=backbone, checks=(),
        provenance=Provenance("bayesimpact sample rig", 7, "2026-01-02T03:04:05+00:00", "ab" * 32,
                              {"python": "3.11", "numpy": "2.0"}, 12.0),
    )  # fmt: skip
    return checks.assessed(replace(made, **changes))


def with_chain(results: Results, chain: MeasuringChainSummary) -> Results:
    """The same results with stated uncertainties of mass, clock and gain."""
    table = tuple(
        replace(r, total90=widened(r.median, r.ci90, r.unit, chain, angle=False))
        for r in results.rows
    )
    return replace(results, chain=chain, rows=table)


def all_figures(results: Results) -> dict[str, Figure]:
    """Every figure that the results allow, by the name of its file, in the order of the page."""
    return {name: f for draw in drawers(results) for name, f in figures_of(draw, results).items()}
