"""The corner plot of a diagnosis that was not sampled: both models' Gaussian approximations."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from bayesimpact.report.figures.corner import corner_figure
from bayesimpact.report.figures.improvement import NUISANCES
from bayesimpact.report.results import Array, Draws, Results

_DRAWS = 4000


def gaussian_figures(results: Results) -> Mapping[str, Figure]:
    """Corner plot of the normal laws at both modes; nothing where there are draws."""
    arrays, diagnosis = results.diagnosis_arrays, results.diagnosis or {}
    if results.draws is not None or "before_chi2" not in arrays:
        return {}
    shown = results.select("physical", "effect")
    columns = [i for i, row in enumerate(results.rows) if row in shown]
    after = Draws(
        "with what was added",
        tuple(row.name for row in shown),
        tuple(row.unit for row in shown),
        _normal(np.array([row.mode for row in results.rows]), results.covariance)[:, columns],
    )
    mode = arrays["before_mode"]
    table = list(diagnosis["parameters"]["before"].items())[: mode.size]
    columns = [i for i, (name, _) in enumerate(table) if name.partition("[")[0] not in NUISANCES]
    before = Draws(
        "base model",
        tuple(table[i][0] for i in columns),
        tuple(table[i][1]["unit"] for i in columns),
        _normal(mode, arrays["before_covariance"])[:, columns],
    )
    return {"corner": corner_figure(after, before=before)}


def _normal(mean: Array, covariance: Array) -> Array:
    """Draws (S, d), the same in every run."""
    sd = np.sqrt(np.diag(covariance))
    unit = np.where(sd > 0, sd, 1.0)  # a parameter held at its bound does not vary
    values, vectors = np.linalg.eigh(covariance / np.outer(unit, unit))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    standard = np.random.default_rng(0).standard_normal((_DRAWS, mean.size))
    return np.asarray(mean + (standard @ root.T) * sd)
