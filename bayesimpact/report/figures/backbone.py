"""Backbone and damping curves with posterior-predictive bands, as Figs 12 and 13 of Tian et al."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend_handler import HandlerTuple
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from bayesimpact.model.units import p_words
from bayesimpact.report.figures.style import (
    BLUE,
    ORANGE,
    Array,
    label,
    new_figure,
    position,
    styled,
)
from bayesimpact.report.results import BackboneCurve, BackboneSummary, Results

PER_PAGE = 3
MOST = 12
"""Cases shown."""
BRANCH_COLOURS = {"upper": ORANGE, "lower": BLUE}
BRANCH_MARKERS = {"upper": "^", "lower": "v"}
"""Told apart without colour too."""
BRANCH_WORDS = {"upper": "above rest", "lower": "below rest"}
_BAND: dict[str, Any] = {"alpha": 0.3, "lw": 0}


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
    figure, panels = _grid(cases)
    shown = position(results)
    for column, case in enumerate(cases):
        top, bottom = panels[:, column]
        for curve in _curves(summary, case):
            colour, amplitude = BRANCH_COLOURS[curve.branch], curve.amplitude * shown.scale
            low, _, high = curve.frequency_band.T
            order = np.argsort(amplitude)
            top.fill_betweenx(amplitude[order], low[order], high[order], color=colour, **_BAND)
            top.plot(curve.frequency, amplitude, **branch_style(curve.branch))
            off = deviation(curve.frequency, curve.frequency_band)
            bottom.plot(amplitude, off, **branch_style(curve.branch))
        _title(top, summary, case)
        top.set_xlabel(label("frequency", "Hz"))
        bottom.set_xlabel(label("amplitude", shown.unit))
    panels[0, 0].set_ylabel(label("amplitude", shown.unit))
    _finish(figure, panels, summary)
    return figure


@styled
def _damping(results: Results, summary: BackboneSummary, cases: Sequence[str]) -> Figure:
    """Damping ratio against time; below, how far recorded ones are from simulated ones."""
    figure, panels = _grid(cases)
    for column, case in enumerate(cases):
        top, bottom = panels[:, column]
        for curve in _curves(summary, case):
            colour, t = BRANCH_COLOURS[curve.branch], curve.times
            low, _, high = 100 * curve.damping_band.T
            top.fill_between(t, low, high, color=colour, **_BAND)
            top.plot(t, 100 * curve.damping_ratio, **branch_style(curve.branch))
            off = deviation(curve.damping_ratio, curve.damping_band)
            bottom.plot(t, off, **branch_style(curve.branch))
        _title(top, summary, case)
        bottom.set_xlabel(label("time since the first sample", "s"))
    panels[0, 0].set_ylabel("damping ratio (%)")
    _finish(figure, panels, summary)
    return figure


def branch_style(branch: str) -> dict[str, Any]:
    """How the recorded points of a branch are drawn."""
    colour, marker = BRANCH_COLOURS[branch], BRANCH_MARKERS[branch]
    return {"ls": "", "marker": marker, "color": colour, "ms": 3.5, "mew": 0}


def deviation(recorded: Array, band: Array) -> Array:
    """Recorded minus median in half-widths of the band: inside means between -1 and 1.

    Parameters
    ----------
    recorded : (k,)
    band : (k, 3) lower end, median, upper end
    """
    low, middle, high = band.T
    off = recorded - middle
    half = np.where(off > 0, high - middle, middle - low)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(half > 0, off / half, np.where(off == 0, 0.0, np.nan))


def _grid(cases: Sequence[str]) -> tuple[Figure, np.ndarray]:
    figure = new_figure(5.4, {1: 5.5, 2: 8.0}.get(len(cases), 10.0))
    ratios = {"height_ratios": [2.0, 1.0]}
    panels = figure.subplots(
        2, len(cases), squeeze=False, sharex="row", sharey="row", gridspec_kw=ratios
    )
    return figure, panels


def _curves(summary: BackboneSummary, case: str) -> list[BackboneCurve]:
    return [c for c in summary.curves if c.case == case and c.times.size]


def _finish(figure: Figure, panels: np.ndarray, summary: BackboneSummary) -> None:
    """What all panels have in common: grid, the band below, the legend."""
    for axis in panels.flat:
        axis.grid()
    for axis in panels[1]:
        axis.axhspan(-1.0, 1.0, color="#E4E4E4", lw=0, zorder=0)
    limit = deviation_limit(panels[1])
    panels[1, 0].set_ylim(-limit, limit)
    panels[1, 0].set_ylabel("recorded \N{MINUS SIGN} simulated\n(half-widths of the band)")
    _legend(figure, summary)


def deviation_limit(axes: Iterable[Axes]) -> float:
    """Where an axis of deviations ends so that all points and some of the outside are seen."""
    points = [np.asarray(line.get_ydata(), dtype=float) for axis in axes for line in axis.lines]
    sizes = np.abs(np.concatenate(points)) if points else np.zeros(0)
    return max(2.5, 1.1 * float(np.nanmax(sizes, initial=0.0)))


def _title(axis: Axes, summary: BackboneSummary, case: str) -> None:
    words = f"case {case}" if case else "all recordings"
    if (case or "all") in summary.labels:
        k = summary.labels.index(case or "all")
        words += f": {100 * summary.inside[k]:.0f} % inside, {p_words(summary.p_values[k])}"
    axis.set_title(words, loc="left")


def _legend(figure: Figure, summary: BackboneSummary) -> None:
    handles: list[Any] = [Line2D([], [], **branch_style(branch)) for branch in BRANCH_WORDS]
    handles.append(tuple(Patch(color=BRANCH_COLOURS[b], **_BAND) for b in BRANCH_WORDS))
    words = [f"recorded, {words}" for words in BRANCH_WORDS.values()]
    words.append(f"{100 * summary.probability:.0f} % of simulated")
    pairs = {tuple: HandlerTuple(ndivide=None, pad=0.0)}
    figure.legend(handles, words, loc="outside upper left", ncols=3, handler_map=pairs)
