"""A parameter over many campaigns: estimates with intervals along a date or a condition."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib import dates
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bayesimpact.report.figures.style import (
    BLUE,
    GREY,
    RED,
    full_symbol,
    label,
    new_figure,
    scaled,
    styled,
)

Array = NDArray[np.float64]

DATES: Any = dates  # carries no types
ROW = 2.0  # height, in
ACROSS = 2
_TITLE_COLUMNS = 60  # characters


@dataclass(frozen=True)
class Panel:
    """One parameter.

    Attributes
    ----------
    parameter, unit : name and SI unit
    along, is_date : what the abscissa is; dates are days since 1970-01-01
    x, estimates, low, high : (n,), SI
    change : the line or step that was found, at x (n,), SI; None without one
    """

    parameter: str
    unit: str
    along: str
    is_date: bool
    x: Array
    estimates: Array
    low: Array
    high: Array
    change: Array | None = None


@styled
def series_figure(panels: Sequence[Panel]) -> Figure:
    """All parameters, two panels in a row; what changes is drawn over the estimates."""
    rows = -(-len(panels) // ACROSS)
    figure = new_figure(max(ROW * rows, ROW))
    grid = figure.subplots(rows, min(ACROSS, len(panels)), squeeze=False)
    for axis in grid.ravel()[len(panels) :]:
        axis.remove()
    for axis, panel in zip(grid.ravel(), panels, strict=False):
        shown = scaled(panel.parameter, panel.unit, panel.estimates)
        x = panel.x.astype("datetime64[D]") if panel.is_date else panel.x
        middle = shown(panel.estimates)
        width = np.abs(np.stack([middle - shown(panel.low), shown(panel.high) - middle]))
        axis.errorbar(x, middle, width, fmt="o", color=BLUE, ecolor=GREY, ms=3, lw=0.8)
        if panel.change is not None:
            axis.plot(x, shown(panel.change), color=RED, lw=1.4)
        axis.set_title(full_symbol(panel.parameter, _TITLE_COLUMNS), loc="left")
        axis.set_ylabel(shown.label)
        axis.set_xlabel("" if panel.is_date else label(panel.along.replace("_", " "), ""))
        axis.grid(axis="y")
        if panel.is_date:
            ticks = DATES.AutoDateLocator(minticks=3, maxticks=6)
            axis.xaxis.set_major_locator(ticks)
            axis.xaxis.set_major_formatter(DATES.ConciseDateFormatter(ticks))
    return figure
