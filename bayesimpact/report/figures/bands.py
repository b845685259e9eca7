"""Backbone and damping before and after: how far recorded cycles lie from simulated ones."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from bayesimpact.model.units import p_words
from bayesimpact.report.figures.backbone import (
    BRANCH_WORDS,
    branch_style,
    deviation,
    deviation_limit,
)
from bayesimpact.report.figures.style import label, new_figure, position, styled
from bayesimpact.report.results import BackboneSummary, Results


def band_figures(results: Results) -> Mapping[str, Figure]:
    """Deviations in half-widths of the bands of both models, where both were sampled."""
    before, after = results.before_backbone, results.backbone
    if before is None or after is None:
        return {}
    return {"bands": _figure(results, before, after)}


@styled
def _figure(results: Results, before: BackboneSummary, after: BackboneSummary) -> Figure:
    figure = new_figure(5.0)
    panels = figure.subplots(2, 2, sharex="col", sharey=True)
    sides = (("base model", before), ("with what was added", after))
    for row, (words, summary) in zip(panels, sides, strict=True):
        _cycles(row, summary, position(results).scale)
        inside = f"{100 * summary.inside[-1]:.0f} % inside, {p_words(summary.p_values[-1])}"
        row[0].set_title(f"frequency, {words}: {inside}", loc="left")
        row[1].set_title(f"damping ratio, {words}", loc="left")
    limit = deviation_limit(panels.flat)
    panels[0, 0].set_ylim(-limit, limit)
    panels[1, 0].set_xlabel(label("amplitude", position(results).unit))
    panels[1, 1].set_xlabel(label("time since the first sample", "s"))
    figure.supylabel("recorded \N{MINUS SIGN} simulated (half-widths of the band)", fontsize=9)
    handles, labels = panels[0, 0].get_legend_handles_labels()
    unique = dict(zip(labels, handles, strict=True))
    figure.legend(unique.values(), unique.keys(), loc="outside upper left", ncols=2)
    return figure


def _cycles(row: np.ndarray, summary: BackboneSummary, scale: float) -> None:
    for axis in row:
        axis.axhspan(-1.0, 1.0, color="#E4E4E4", lw=0, zorder=0)
        axis.grid()
    for curve in summary.curves:
        for axis, x, recorded, band in (
            (row[0], curve.amplitude * scale, curve.frequency, curve.frequency_band),
            (row[1], curve.times, curve.damping_ratio, curve.damping_band),
        ):
            style = branch_style(curve.branch)
            axis.plot(x, deviation(recorded, band), label=BRANCH_WORDS[curve.branch], **style)
