"""Corner plots of the parameters of interest, of one posterior or of two."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from bayesimpact.model.units import number, typeset, without_zero
from bayesimpact.report.digits import Digits, digits
from bayesimpact.report.figures.clouds import LEVELS, Cloud, Law, NormalLaw, plotted
from bayesimpact.report.figures.style import (
    BLACK,
    BLUE,
    ORANGE,
    WIDTH,
    Array,
    LabScale,
    full_symbol,
    label,
    scaled,
    styled,
)

__all__ = ["LEVELS", "NormalLaw", "corner_figure"]

MOST = 12
"""Parameters in one corner plot; the first of the table are taken."""
_PANEL, _LEFT, _RIGHT, _BELOW, _ABOVE = 1.4, 0.85, 1.0, 0.85, 0.6  # in
_TITLE_COLUMNS = 24  # characters

Estimate = tuple[float, float, float]  # median and both ends of the 90 % interval, SI


@styled
def corner_figure(
    draws: Law,
    *,
    before: Law | None = None,
    truths: Mapping[str, float] | None = None,
    truth_label: str = "reference",
    estimates: Mapping[str, Estimate] | None = None,
    shown: Mapping[str, Digits] | None = None,
) -> Figure:
    """Marginals and pairs of a posterior, with a second one and reference values where given.

    Parameters
    ----------
    draws : the posterior
    before : another posterior of (some of) the same parameters
    truths : parameter -> value in SI, drawn as lines where it lies near
    truth_label : what these are
    estimates : parameter -> numbers for its title, as other tables have them; else of the draws
    shown : parameter -> their digits; else those that the interval of the estimate allows
    """
    names = draws.names[:MOST]
    known = {name: _estimate(draws, k) for k, name in enumerate(names)} | dict(estimates or {})
    told = {
        name: digits(draws.units[k], known[name][0], known[name][1:])
        for k, name in enumerate(names)
    } | dict(shown or {})
    axes = [_axis(draws, before, k, known[name], told[name]) for k, name in enumerate(names)]
    clouds = [plotted(draws, names, axes, BLUE)]
    if before is not None:
        clouds.insert(0, plotted(before, names, axes, ORANGE))
    marks = {
        k: float(axes[k](np.array(truths[name])))
        for k, name in enumerate(names)
        if truths is not None and name in truths
    }
    limits = [_limits(clouds, k, marks.get(k)) for k in range(len(names))]
    figure, panels = _grid(len(names))
    for i in range(len(names)):
        for j in range(i + 1):
            _panel(panels[i, j], i, j, clouds, limits, marks)
        _title(panels[i, i], names[i], known[names[i]], told[names[i]])
        _outer_labels(panels, axes, i)
    figure.align_labels()
    _legend(figure, clouds, marks, truth_label)
    return figure


def _grid(count: int) -> tuple[Figure, np.ndarray]:
    """No wider than other figures, so that its letters are as large as theirs in print."""
    size = min(WIDTH, _PANEL * count + _LEFT + _RIGHT)
    figure = Figure(figsize=(size, size), dpi=150)
    places = figure.add_gridspec(
        count,
        count,
        left=_LEFT / size,
        bottom=_BELOW / size,
        right=1 - _RIGHT / size,
        top=1 - _ABOVE / size,
        wspace=0.07,
        hspace=0.07,
    )
    panels = np.full((count, count), None, dtype=object)  # nothing above the diagonal
    for i in range(count):
        for j in range(i + 1):
            panels[i, j] = figure.add_subplot(places[i, j])
    return figure, panels


def _estimate(law: Law, k: int) -> Estimate:
    if isinstance(law, NormalLaw):
        half = 1.6448536269514722 * float(np.sqrt(law.covariance[k, k]))
        mean = float(law.mean[k])
        return mean, mean - half, mean + half
    low, median, high = (float(x) for x in np.percentile(law.values[:, k], [5, 50, 95]))
    return median, low, high


def _axis(law: Law, before: Law | None, k: int, estimate: Estimate, shown: Digits) -> LabScale:
    """The axis of a parameter: from zero, or from the median as its title has it."""
    name, unit = law.names[k], law.units[k]
    both = [law.values[:, k]]
    if before is not None and name in before.names:
        both.append(before.values[:, before.names.index(name)])
    axis = scaled(name, unit, np.concatenate(both), (estimate[0], shown))
    if not axis.offset:
        return axis
    base = scaled(name, unit, np.zeros(1)).quantity
    return replace(axis, quantity=f"Δ{base}")


def _limits(clouds: list[Cloud], k: int, mark: float | None) -> tuple[float, float]:
    known = [cloud.ranges[k] for cloud in clouds if cloud.has(k)]
    if not known:
        return -1.0, 1.0
    low, high = min(float(r[0]) for r in known), max(float(r[1]) for r in known)
    span = high - low
    # A reference that lies near is shown; one far away would squeeze the posterior to a line.
    if mark is not None and low - 1.5 * span < mark < high + 1.5 * span:
        low, high = min(low, mark), max(high, mark)
    margin = 0.06 * (high - low)
    return low - margin, high + margin


def _panel(
    axis: Axes,
    i: int,
    j: int,
    clouds: list[Cloud],
    limits: list[tuple[float, float]],
    marks: Mapping[int, float],
) -> None:
    """Row i, column j: a marginal, or a pair below the diagonal."""
    for cloud in clouds:
        if i == j and cloud.has(i):
            cloud.marginal(axis, i)
        elif i != j and cloud.has(i) and cloud.has(j):
            cloud.pair(axis, i, j)
    if j in marks:
        axis.axvline(marks[j], color=BLACK, lw=0.8, ls=(0, (4, 2)))
    if i != j and i in marks:
        axis.axhline(marks[i], color=BLACK, lw=0.8, ls=(0, (4, 2)))
    axis.set_xlim(*limits[j])
    if i != j:
        axis.set_ylim(*limits[i])
    else:
        axis.set_yticks([])
        axis.spines["left"].set_visible(False)
        axis.set_ylim(bottom=0)


def _title(axis: Axes, name: str, estimate: Estimate, shown: Digits) -> None:
    """Symbol, median and half of the 90 % interval above a marginal, into the empty corner."""
    median, low, high = estimate
    half = 0.5 * (high - low) * shown.scale
    around = number(half, without_zero(shown.places, half))
    text = f"{shown.value(median)} ± {around} {typeset(shown.unit)}"
    axis.set_title(f"{full_symbol(name, _TITLE_COLUMNS)}\n{text}", loc="left", fontsize=8.5)


def _outer_labels(panels: np.ndarray, axes: list[LabScale], i: int) -> None:
    """Ticks and labels along the bottom and the left edge only."""
    last = panels.shape[0] - 1
    for axis in panels[i, : i + 1]:
        axis.set_xticks(_ticks(*axis.get_xlim()))
        axis.tick_params(labelbottom=i == last, labelsize=8.0, length=2.5)
    for j in range(i):
        panels[i, j].set_yticks(_ticks(*panels[i, j].get_ylim()))
        panels[i, j].tick_params(labelleft=j == 0)
    words = label(f"{axes[i].quantity}\n", axes[i].unit).replace("\n ", "\n").strip()
    panels[last, i].set_xlabel(words, fontsize=8.5)
    panels[last, i].tick_params(axis="x", labelrotation=40)
    if i > 0:
        panels[i, 0].set_ylabel(words, fontsize=8.5)


def _ticks(low: float, high: float) -> Array:
    """Round values well inside an axis, so that labels of neighbouring panels keep apart."""
    margin = 0.15 * (high - low)
    for intervals in (3, 4, 6, 8):  # one tick alone would say nothing of the scale
        ticks = np.asarray(MaxNLocator(intervals).tick_values(low, high))
        ticks = ticks[(ticks > low + margin) & (ticks < high - margin)]
        if ticks.size > 1:
            break
    return ticks


def _legend(
    figure: Figure, clouds: list[Cloud], marks: Mapping[int, float], truth_label: str
) -> None:
    handles = [Line2D([], [], color=cloud.colour, label=cloud.label) for cloud in clouds]
    if marks:
        line = Line2D([], [], color=BLACK, lw=0.8, ls=(0, (4, 2)), label=truth_label)
        handles.append(line)
    if len(handles) > 1:
        figure.legend(handles=handles, loc="upper right", fontsize=9.0)
