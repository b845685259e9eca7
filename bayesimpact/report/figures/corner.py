"""Corner plots of the parameters of interest, of one posterior or of two."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from bayesimpact.inference.convergence import quiet_arviz
from bayesimpact.report.figures.style import BLACK, BLUE, ORANGE, Scaled, scaled, styled, symbol
from bayesimpact.report.results import Array, Draws
from bayesimpact.report.units import decimals, display, number, typeset

MOST = 12
"""Parameters in one corner plot; the first of the table are taken."""
LEVELS = (1 - float(np.exp(-0.5)), 1 - float(np.exp(-2.0)))
"""Probability inside the ellipses of one and two standard deviations of a Gaussian in the plane."""
_PANEL = 1.4  # in


@dataclass(frozen=True, eq=False)
class _Cloud:
    """Draws of one posterior as plotted: (S, p), NaN columns for parameters that it lacks."""

    values: Array
    colour: str
    label: str

    @cached_property
    def ranges(self) -> Array:
        """(p, 2), what nearly all draws span."""
        return np.percentile(self.values, [0.15, 99.85], axis=0).T

    def has(self, k: int) -> bool:
        """True when parameter k is known and not constant."""
        low, high = self.ranges[k]
        return bool(np.isfinite(low) and high > low)


@styled
def corner_figure(
    draws: Draws,
    *,
    before: Draws | None = None,
    truths: Mapping[str, float] | None = None,
    truth_label: str = "reference",
) -> Figure:
    """Marginals and pairs of draws, with a second posterior and reference values where given.

    Parameters
    ----------
    draws : the posterior
    before : another posterior of (some of) the same parameters
    truths : parameter -> value in SI, drawn as lines where it lies near
    truth_label : what these are
    """
    names = draws.names[:MOST]
    other = None if before is None else _matched(before, names)
    axes = [_axis(draws, other, k) for k in range(len(names))]
    clouds = [_Cloud(_plotted(draws.values[:, : len(names)], axes), BLUE, draws.label)]
    if before is not None and other is not None:
        clouds.insert(0, _Cloud(_plotted(other, axes), ORANGE, before.label))
    marks = {
        k: float(axes[k](np.array(truths[name])))
        for k, name in enumerate(names)
        if truths is not None and name in truths
    }
    limits = [_limits(clouds, k, marks.get(k)) for k in range(len(names))]
    size = max(4.2, _PANEL * len(names) + 1.0)
    figure = Figure(figsize=(size, size), dpi=150)
    margin = 0.75 / size
    figure.subplots_adjust(margin + 0.01, margin, 1 - 0.2 / size, 1 - 0.45 / size, 0.07, 0.07)
    panels = figure.subplots(len(names), len(names), squeeze=False)
    for i in range(len(names)):
        for j in range(len(names)):
            _panel(panels[i, j], i, j, clouds, limits, marks)
        _title(panels[i, i], names[i], draws.units[i], draws.values[:, i])
        _outer_labels(panels, axes, i)
    figure.align_labels()
    _legend(figure, clouds, marks, truth_label)
    return figure


def _matched(before: Draws, names: tuple[str, ...]) -> Array:
    """Columns of another posterior in the order of `names`, NaN where it has no such parameter."""
    absent = np.full(before.values.shape[0], np.nan)
    columns = [
        before.values[:, before.names.index(name)] if name in before.names else absent
        for name in names
    ]
    return np.column_stack(columns)


def _plotted(values: Array, axes: list[Scaled]) -> Array:
    return np.column_stack([axis(values[:, k]) for k, axis in enumerate(axes)])


def _axis(draws: Draws, other: Array | None, k: int) -> Scaled:
    both = [draws.values[:, k]]
    if other is not None and np.isfinite(other[:, k]).all():
        both.append(other[:, k])
    return scaled(draws.names[k], draws.units[k], np.concatenate(both))


def _limits(clouds: list[_Cloud], k: int, mark: float | None) -> tuple[float, float]:
    known = [cloud.ranges[k] for cloud in clouds if cloud.has(k)]
    if not known:
        middle = float(np.nanmedian(clouds[-1].values[:, k]))
        return middle - 1.0, middle + 1.0
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
    clouds: list[_Cloud],
    limits: list[tuple[float, float]],
    marks: Mapping[int, float],
) -> None:
    """Row i, column j: a marginal, a pair, or nothing above the diagonal."""
    if j > i:
        axis.remove()
        return
    for cloud in clouds:
        if i == j and cloud.has(i):
            axis.hist(cloud.values[:, i], bins=28, range=tuple(cloud.ranges[i]), density=True,
                      histtype="stepfilled", color=cloud.colour, alpha=0.25)  # fmt: skip
            axis.hist(cloud.values[:, i], bins=28, range=tuple(cloud.ranges[i]), density=True,
                      histtype="step", color=cloud.colour, lw=1.0)  # fmt: skip
        elif i != j and cloud.has(i) and cloud.has(j):
            _pair(axis, cloud, i, j)
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


def _pair(axis: Axes, cloud: _Cloud, i: int, j: int) -> None:
    quiet_arviz()  # corner imports it, aloud
    import corner

    corner.hist2d(
        cloud.values[:, j],
        cloud.values[:, i],
        ax=axis,
        range=[tuple(cloud.ranges[j]), tuple(cloud.ranges[i])],
        bins=20,
        levels=LEVELS,
        smooth=1.2,
        color=cloud.colour,
        plot_datapoints=False,
        plot_density=False,
        no_fill_contours=True,
        fill_contours=False,
        contour_kwargs={"linewidths": 0.9},
        quiet=True,
    )


def _title(axis: Axes, name: str, unit: str, values: Array) -> None:
    """Symbol, median and half of the 90 % interval above a marginal."""
    low, median, high = np.percentile(values, [5, 50, 95])
    shown = display(unit, abs(median))
    half = 0.5 * (high - low) * shown.scale
    places = decimals(half)
    text = f"{number(median * shown.scale, places)} ± {number(half, places)} {typeset(shown.unit)}"
    axis.set_title(f"{symbol(name)}\n{text}", fontsize=7.0)


def _outer_labels(panels: np.ndarray, axes: list[Scaled], i: int) -> None:
    """Ticks and labels along the bottom and the left edge only."""
    last = panels.shape[0] - 1
    for axis in panels[i, : i + 1]:
        axis.xaxis.set_major_locator(MaxNLocator(3, prune="both"))
        axis.tick_params(labelbottom=i == last, labelsize=6.5, length=2.5)
    for j in range(i):
        panels[i, j].yaxis.set_major_locator(MaxNLocator(3, prune="both"))
        panels[i, j].tick_params(labelleft=j == 0)
    bottom = panels[last, i]
    bottom.set_xlabel(axes[i].label, fontsize=7.0)
    bottom.tick_params(axis="x", labelrotation=40)
    if i > 0:
        panels[i, 0].set_ylabel(axes[i].label, fontsize=7.0)


def _legend(
    figure: Figure, clouds: list[_Cloud], marks: Mapping[int, float], truth_label: str
) -> None:
    handles = [Line2D([], [], color=cloud.colour, label=cloud.label) for cloud in clouds]
    if marks:
        line = Line2D([], [], color=BLACK, lw=0.8, ls=(0, (4, 2)), label=truth_label)
        handles.append(line)
    if len(handles) > 1:
        figure.legend(handles=handles, loc="upper right", fontsize=9.0)
