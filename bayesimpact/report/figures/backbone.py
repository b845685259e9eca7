"""Backbone and damping curves with posterior-predictive bands, as Figs 12 and 13 of Tian et al."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from bayesimpact.report.figures.style import (
    BLUE,
    GREY,
    RED,
    Array,
    label,
    new_figure,
    response,
    styled,
)
from bayesimpact.report.results import BackboneSummary, Curve, Results

PER_PAGE = 3
MOST = 12
"""Cases shown."""
_COLOURS = {"upper": RED, "lower": BLUE}
_BRANCHES = {"upper": "upper, towards the stop", "lower": "lower"}


def backbone_figures(results: Results) -> Mapping[str, Figure]:
    """Figures by name: backbone and damping, `PER_PAGE` cases side by side on each."""
    summary = results.backbone
    if summary is None:
        return {}
    cases = list(dict.fromkeys(curve.case for curve in summary.curves))[:MOST]
    pages = [cases[i : i + PER_PAGE] for i in range(0, len(cases), PER_PAGE)]
    figures = {}
    for number, page in enumerate(pages, 1):
        suffix = f"_{number}" if len(pages) > 1 else ""
        figures[f"backbone{suffix}"] = _backbone(results, summary, page)
        figures[f"damping{suffix}"] = _damping(results, summary, page)
    return figures


@styled
def _backbone(results: Results, summary: BackboneSummary, cases: Sequence[str]) -> Figure:
    """Amplitude against frequency; below, how far recorded frequencies are from simulated ones."""
    figure, panels = _grid(cases, [2.0, 1.0], height=5.4)
    shown = response(results)
    for column, case in enumerate(cases):
        top, bottom = panels[:, column]
        for curve in _curves(summary, case):
            colour, amplitude = _COLOURS[curve.branch], curve.amplitude * shown.scale
            low, middle, high = curve.frequency_band.T
            order = np.argsort(amplitude)
            top.fill_betweenx(
                amplitude[order], low[order], high[order], color=colour, alpha=0.3, lw=0
            )
            top.plot(curve.frequency, amplitude, ".", color=colour, ms=3.5, mew=0)
            _deviation(bottom, amplitude, 1e3 * (curve.frequency - middle),
                       1e3 * (low - middle), 1e3 * (high - middle), colour)  # fmt: skip
        _title(top, summary, case)
        top.set_xlabel(label("frequency", "Hz"))
        top.grid()
        bottom.set_xlabel(label("amplitude", shown.unit))
        bottom.grid()
        if column == 0:
            top.set_ylabel(label("amplitude", shown.unit))
            bottom.set_ylabel("recorded \N{MINUS SIGN} simulated (mHz)")
    _limit(panels[1])
    _legend(figure, summary)
    return figure


@styled
def _damping(results: Results, summary: BackboneSummary, cases: Sequence[str]) -> Figure:
    """Damping ratio against time, and below how far recorded ones lie from simulated ones."""
    figure, panels = _grid(cases, [2.0, 1.0], height=5.4)
    for column, case in enumerate(cases):
        top, bottom = panels[:, column]
        for curve in _curves(summary, case):
            colour, t = _COLOURS[curve.branch], curve.times
            low, middle, high = 100 * curve.damping_band.T
            top.fill_between(t, low, high, color=colour, alpha=0.3, lw=0)
            top.plot(t, 100 * curve.damping_ratio, ".", color=colour, ms=3.5, mew=0)
            _deviation(bottom, t, 100 * curve.damping_ratio - middle, low - middle, high - middle,
                       colour)  # fmt: skip
        _title(top, summary, case)
        top.grid()
        bottom.grid()
        bottom.set_xlabel(label("time since the first sample", "s"))
        if column == 0:
            top.set_ylabel("damping ratio (%)")
            bottom.set_ylabel("recorded \N{MINUS SIGN} simulated (%)")
    _limit(panels[1])
    _legend(figure, summary)
    return figure


def _grid(
    cases: Sequence[str], heights: Sequence[float], height: float
) -> tuple[Figure, np.ndarray]:
    width = {1: 5.5, 2: 8.0}.get(len(cases), 10.0)
    figure = new_figure(height, width)
    ratios = {"height_ratios": heights}
    panels = figure.subplots(2, len(cases), squeeze=False, sharey="row", gridspec_kw=ratios)
    return figure, panels


def _curves(summary: BackboneSummary, case: str) -> list[Curve]:
    return [c for c in summary.curves if c.case == case and c.times.size]


def _deviation(axis: Axes, x: Array, off: Array, low: Array, high: Array, colour: str) -> None:
    order = np.argsort(x)
    axis.fill_between(x[order], low[order], high[order], color=colour, alpha=0.18, lw=0)
    axis.plot(x, off, ".", color=colour, ms=3.0, mew=0)


def _limit(row: np.ndarray) -> None:
    """Common limits that hold nearly all points; the last small swings would squeeze the others."""
    points = [line.get_ydata() for axis in row for line in axis.lines]
    values = np.concatenate([np.asarray(p, dtype=float) for p in points]) if points else np.zeros(1)
    values = np.abs(values[np.isfinite(values)])
    if values.size and values.max() > 0:
        limit = 1.3 * float(np.percentile(values, 97))
        for axis in row:
            axis.set_ylim(-limit, limit)
            axis.axhline(0.0, color=GREY, lw=0.6)


def _title(axis: Axes, summary: BackboneSummary, case: str) -> None:
    words = f"case {case}" if case else "all recordings"
    if (case or "all") in summary.labels:
        k = summary.labels.index(case or "all")
        words += f": {100 * summary.inside[k]:.0f} % inside, p = {summary.p_values[k]:.2g}"
    axis.set_title(words, loc="left")


def _legend(figure: Figure, summary: BackboneSummary) -> None:
    points = [
        Line2D([], [], ls="", marker=".", color=_COLOURS[b], label=f"recorded, {words}")
        for b, words in _BRANCHES.items()
    ]
    band = Patch(
        color=GREY, alpha=0.4, lw=0, label=f"{100 * summary.probability:.0f} % of simulated"
    )
    figure.legend(handles=[*points, band], loc="outside upper right", ncols=3)
