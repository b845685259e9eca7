"""How large an effect must be to be detected, and to be named; how limits fall with recordings."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from bayesimpact.report.figures.style import BLUE, GREY, ORANGE, new_figure, styled

COLUMNS = 3
ROW_HEIGHT = 1.1  # in
LIMITS = (0.5, 0.7, 1.0, 1.4, 2.0)


@styled
def power_figure(document: Mapping[str, Any]) -> Figure:
    """One panel per effect: probabilities against size, theory as lines, blind trials as points.

    `document` is the content of detection_power.json.
    """
    effects = document["effects"]
    rows = -(-len(effects) // COLUMNS)
    figure = new_figure(ROW_HEIGHT * rows + 0.6)
    axes = figure.subplots(rows, COLUMNS, sharex=True, sharey=True, squeeze=False)
    for axis, (effect, row) in zip(axes.flat, effects.items(), strict=False):
        x = np.array(document["strengths"])
        axis.plot(x, row["detected"], color=ORANGE, label="detected")
        axis.plot(x, row["named"], color=BLUE, label="named")
        axis.axhline(0.9, color=GREY, linewidth=0.6)
        _points(axis, document.get("observed", {}).get(effect, {}))
        axis.set_title(effect.replace("_", " "), loc="left")
        axis.set_xscale("log")
        axis.set_ylim(-0.03, 1.03)
        axis.xaxis.set_major_formatter("{x:g}")
    for axis in axes.flat[len(effects) :]:
        axis.set_axis_off()
    for axis in axes.flat[: len(effects)][-COLUMNS:]:  # the lowest of every column
        axis.tick_params(labelbottom=True)
    axes.flat[0].legend(loc="lower right")
    figure.supxlabel("size in detection limits (five standard errors)", fontsize=9)
    figure.supylabel("probability", fontsize=9)
    return figure


def _points(axis: Axes, observed: Mapping[str, Any]) -> None:
    for strength, cell in observed.items():
        for key, colour in (("detected", ORANGE), ("named", BLUE)):
            low, high = cell[key]["interval"]
            x = float(strength) * (0.97 if key == "detected" else 1.03)
            axis.plot([x, x], [low, high], color=colour, linewidth=0.8)
            axis.plot([x], [cell[key]["rate"]], "o", color=colour, markersize=3)


@styled
def limits_figure(document: Mapping[str, Any]) -> Figure:
    """Detection limit against the number of recordings, relative to nine of them."""
    figure = new_figure(3.2)
    axis = figure.subplots()
    table = document["limit_by_recordings"]
    counts = sorted({int(n) for row in table.values() for n in row})
    for row in table.values():
        known = sorted((int(n), v) for n, v in row.items())
        axis.plot(*zip(*known, strict=True), color=BLUE, alpha=0.5)
    if counts:
        x = np.array(counts, dtype=float)
        axis.plot(x, np.sqrt(9 / x), color=ORANGE, linestyle="--", label="one over square root")
        axis.legend()
    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.set_xticks(counts, [str(n) for n in counts])
    axis.set_yticks(LIMITS, [f"{limit:g}" for limit in LIMITS])
    for one in (axis.xaxis, axis.yaxis):
        one.set_minor_formatter(NullFormatter())
    axis.set_xlabel("recordings")
    axis.set_ylabel("detection limit / that of nine recordings")
    axis.grid()
    return figure
