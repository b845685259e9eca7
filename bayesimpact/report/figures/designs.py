"""Which recording next: what each design is expected to tell the rivals apart by, and k2's gain."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from bayesimpact.report.diagnosis.next_words import design_words, shown, stiffness
from bayesimpact.report.figures.style import AFTER, BLACK, GREY, RED, new_figure, rows_axis, styled
from bayesimpact.report.results import Results

_ROW, _FRAME = 0.24, 1.05  # in
_LINEAR = 10.0  # nats; beyond that the axis is logarithmic


def design_figures(results: Results) -> Mapping[str, Figure]:
    """The ranked designs, where there are any."""
    content = (results.diagnosis or {}).get("next")
    if not content or len(content["designs"]) < 2:
        return {}
    return {"designs": _designs(content)}


@styled
def _designs(content: Mapping[str, Any]) -> Figure:
    designs = shown(content)
    figure = new_figure(_ROW * len(designs) + _FRAME)
    axes = figure.subplots(1, 2 if content["open"] else 1, sharey=True, squeeze=False)[0]
    rows = np.arange(len(designs))
    colours = [BLACK if d["repeats"] else AFTER if d["same_campaign"] else GREY for d in designs]
    if content["open"]:
        odds = np.array([d["expected_log_odds"] for d in designs])
        axes[0].hlines(rows, 0.0, odds, color=colours, lw=1.2)
        axes[0].scatter(odds, rows, c=colours, s=28, zorder=3)
        axes[0].axvline(content["decisive"], color=RED, lw=1.0, ls=(0, (4, 3)))
        axes[0].set_xscale("symlog", linthresh=_LINEAR)
        axes[0].set_xlim(0.0, max(float(odds.max()), _LINEAR) * 1.4)
        axes[0].xaxis.set_major_formatter("{x:g}")
        axes[0].set_xlabel("expected ln odds (nats)")
    gain = 100.0 * np.array([d["narrowing"] for d in designs])
    axes[-1].hlines(rows, 0.0, gain, color=colours, lw=1.2)
    axes[-1].scatter(gain, rows, c=colours, s=28, zorder=3)
    axes[-1].set_xlim(0.0, None)
    axes[-1].set_xlabel(f"90 % interval of {stiffness(designs[0])} narrower by (%)")
    names = [f"{d['rank']}: {design_words(d, angle=content['angle'])}" for d in designs]
    for axis in axes:
        rows_axis(axis, names)
    for axis in axes[1:]:
        axis.tick_params(axis="y", labelleft=False)
    axes[0].set_title("recordings that could be made next, best first", loc="left")
    return figure
