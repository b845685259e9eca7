"""How the global search converged."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from bayesimpact.report.figures.style import BLUE, ORANGE, new_figure, styled
from bayesimpact.report.results import Array, SearchSummary


@styled
def search_figure(search: SearchSummary) -> Figure:
    """Objective above its final best, its standard deviation and temperature,
    against evaluations."""
    figure = new_figure(3.0)
    left, right = figure.subplots(1, 2)
    n = search.evaluations
    final = float(search.best[-1])
    left.plot(n, _positive(search.median - final), color=ORANGE, label="median of the population")
    left.plot(n, _positive(search.best - final), color=BLUE, label="best")
    left.set_ylabel("objective above the final best (nats)")
    right.plot(
        n, _positive(search.spread), color=BLUE, label="standard deviation of the population"
    )
    right.plot(n, _positive(search.temperature), color=ORANGE, ls="--", label="temperature")
    right.set_ylabel("objective (nats)")
    for axis in (left, right):
        axis.set_yscale("log")
        axis.set_xlabel("evaluations of the objective")
        axis.grid()
        axis.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2)
    return figure


def _positive(values: Array) -> Array:
    """Values that a logarithmic axis can show, NaN for the others."""
    return np.where(np.isfinite(values) & (values > 0), values, np.nan)
