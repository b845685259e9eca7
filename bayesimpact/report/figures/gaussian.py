"""The corner plot of a diagnosis that was not sampled: both models' Gaussian approximations."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from bayesimpact.report.diagnosis.change_view import NUISANCES
from bayesimpact.report.figures.corner import NormalLaw, corner_figure
from bayesimpact.report.results import Results


def gaussian_figures(results: Results) -> Mapping[str, Figure]:
    """Corner plot of the normal laws at both modes.

    Nothing where there are draws, nor where something stays unexplained: the curvature at the mode
    knows nothing of that, and would contradict the tables.
    """
    arrays, diagnosis = results.diagnosis_arrays, results.diagnosis or {}
    if results.draws is not None or results.remains or "before_chi2" not in arrays:
        return {}
    interest = results.select("physical", "effect")
    columns = [i for i, row in enumerate(results.rows) if row in interest]
    after = NormalLaw(
        "with what was added",
        tuple(row.name for row in interest),
        tuple(row.unit for row in interest),
        np.array([row.mode for row in interest]),
        results.covariance[np.ix_(columns, columns)],
    )
    mode = arrays["before_mode"]
    table = list(diagnosis["parameters"]["before"].items())[: mode.size]
    columns = [i for i, (name, _) in enumerate(table) if name.partition("[")[0] not in NUISANCES]
    before = NormalLaw(
        "base model",
        tuple(table[i][0] for i in columns),
        tuple(table[i][1]["unit"] for i in columns),
        mode[columns],
        arrays["before_covariance"][np.ix_(columns, columns)],
    )
    told = {row.name: (row.median, *row.ci90) for row in interest}
    shown = {row.name: results.digits(row) for row in interest}
    return {"corner": corner_figure(after, before=before, estimates=told, shown=shown)}
