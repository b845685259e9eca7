"""Before and after: spectrum of the residual, misfit, held-out scores, shifts of the parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter

from bayesimpact.inference.fit import Z90
from bayesimpact.report.diagnosis.change_view import NUISANCES
from bayesimpact.report.diagnosis.view import gain_words
from bayesimpact.report.figures.style import (
    AFTER,
    BEFORE,
    BLACK,
    GREY,
    Array,
    new_figure,
    rows_axis,
    styled,
    symbol,
)
from bayesimpact.report.results import Results

MOST = 16
"""Parameters shown; those that moved most."""
WIDE, LINEAR = 300.0, 10.0  # an axis that reaches beyond the first is logarithmic from the second
FAR = 1000.0  # standard deviations: beyond, they tell a narrow interval, no large shift
_ROW = 0.24  # in


def improvement_figures(results: Results) -> Mapping[str, Figure]:
    """Misfit before and after, and how the parameters moved; nothing when nothing was missing."""
    arrays, diagnosis = results.diagnosis_arrays, results.diagnosis or {}
    if "before_chi2" not in arrays:
        return {}
    figures = {"improvement": _improvement(results, arrays, diagnosis.get("fit") or {})}
    moved, unit = shifts(diagnosis.get("parameters") or {})
    if moved:
        figures["shifts"] = _shifts(moved, unit)
    return figures


@styled
def _improvement(results: Results, arrays: Mapping[str, Array], fit: Mapping[str, Any]) -> Figure:
    rows = len(results.recordings)
    held_out = arrays.get("held_out_recordings")
    figure = new_figure(max(3.3, min(9.0, _ROW * rows + 1.4)))
    ratios = [1.3, 1.0] if held_out is None else [1.3, 1.0, 0.8]
    panels = figure.subplots(1, len(ratios), width_ratios=ratios, squeeze=False)[0]
    _spectrum(panels[0], arrays["spectrum"])
    _chi2(panels[1], results, arrays["before_chi2"])
    if held_out is not None:
        _held_out(panels[2], held_out[:, 1] - held_out[:, 0], fit.get("held_out_gain") or {})
    handles = [
        Line2D([], [], color=BEFORE, marker="o", ms=4, label="base model"),
        Line2D([], [], color=AFTER, marker="o", ms=4, label="with what was added"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2)
    return figure


def _spectrum(axis: Axes, spectrum: Array) -> None:
    frequency, before, after, low, high = spectrum.T
    axis.fill_between(
        frequency, low, high, color=GREY, alpha=0.3, lw=0, label="90 % of white noise"
    )
    axis.plot(frequency, before, "o-", color=BEFORE, ms=3)
    axis.plot(frequency, after, "o-", color=AFTER, ms=3)
    axis.set_xscale("log")
    axis.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
    axis.xaxis.set_major_formatter("{x:g}")
    axis.xaxis.set_minor_formatter(NullFormatter())
    if spectrum[:, 1:3].max(initial=0.0) > 5:
        axis.set_yscale("log")
    axis.set_xlabel("frequency (Hz)")
    axis.set_ylabel("power over that of the noise")
    axis.set_title("whitened residual", loc="left")
    axis.grid()
    axis.legend(loc="upper right")


def _chi2(axis: Axes, results: Results, before: Array) -> None:
    after = np.array([r.reduced_chi2 for r in results.recordings])
    rows = np.arange(after.size)
    level = np.nan_to_num(results.noise.level_error)
    counts = np.array([r.samples.size for r in results.recordings])
    half_width = Z90 * np.sqrt(2 / counts + 4 * level**2)
    axis.barh(rows, 2 * half_width, left=1 - half_width, height=0.9, color=GREY, alpha=0.3, lw=0)
    axis.hlines(rows, before, after, color="#777777", lw=0.9)
    axis.plot(before, rows, "o", color=BEFORE, ms=5)
    axis.plot(after, rows, "o", color=AFTER, ms=5)
    if before.max() > 5:
        axis.set_xscale("log")
    rows_axis(axis, [r.name for r in results.recordings])
    axis.set_xlabel("reduced $\\chi^2$")
    axis.set_title("misfit by recording", loc="left")


def _held_out(axis: Axes, gain: Array, total: Mapping[str, Any]) -> None:
    axis.barh(range(gain.size), gain, color=AFTER, height=0.6)
    axis.axvline(0.0, color=BLACK, lw=0.7)
    rows_axis(axis, [""] * gain.size)
    axis.set_xlabel("gain in log score (nats)")
    axis.set_title("held out: " + _total(total), loc="left")


def _total(gain: Mapping[str, Any]) -> str:
    words = gain_words(gain)
    return f"{words} in all" if words else "by recording"


def shifts(parameters: Mapping[str, Any]) -> tuple[list[tuple[str, Array, Array]], str]:
    """Parameters that both models have: name, and (low, median, high) before and after.

    From the median of the base model, most moved ones in the table's order; then the unit: standard
    deviations of the base model, or where these say nothing any more per cent of its value.
    """
    moved = _moved(parameters, per_cent=False)
    if any(np.abs(after).max() > FAR for _, _, after in moved):
        return _moved(parameters, per_cent=True), "%"
    return moved, "its standard deviations"


def _moved(parameters: Mapping[str, Any], *, per_cent: bool) -> list[tuple[str, Array, Array]]:
    before, after = parameters.get("before", {}), parameters.get("after", {})
    found = []
    for name, old in before.items():
        sd = (old["ci90"][1] - old["ci90"][0]) / (2 * Z90)
        if name not in after or name.partition("[")[0] in NUISANCES or not sd > 0:
            continue
        new, one = after[name], 0.01 * abs(old["median"]) if per_cent else sd
        if not one > 0:
            continue
        ends = [_scaled(x, old["median"], one) for x in (old, new)]
        found.append((name, ends[0], ends[1]))
    kept = sorted(found, key=lambda row: -abs(row[2][1]))[:MOST]
    return [row for row in found if row in kept] if len(found) > MOST else found


def _scaled(estimate: Mapping[str, Any], centre: float, one: float) -> Array:
    low, high = estimate["ci90"]
    return (np.array([low, estimate["median"], high]) - centre) / one


@styled
def _shifts(moved: list[tuple[str, Array, Array]], unit: str) -> Figure:
    figure = new_figure(0.42 * len(moved) + 1.2)
    axis = figure.subplots()
    for i, (_, before, after) in enumerate(moved):
        for values, colour, offset in ((before, BEFORE, -0.13), (after, AFTER, 0.13)):
            axis.plot(values[[0, 2]], [i + offset] * 2, color=colour, lw=3.0)
            axis.plot(values[1], i + offset, "o", color=colour, ms=5)
    axis.axvline(0.0, color=GREY, lw=0.7)
    rows_axis(axis, [symbol(name) for name, *_ in moved])
    if max(np.abs(after).max() for _, _, after in moved) > WIDE:
        axis.set_xscale("symlog", linthresh=LINEAR)  # one wide interval would hide all others
        axis.xaxis.set_major_formatter("{x:g}")
        unit += f", logarithmic beyond {LINEAR:g}"
    axis.set_xlabel(f"shift from the base model ({unit})")
    axis.set_title("parameters and 90 % intervals", loc="left")
    handles = [
        Line2D([], [], color=colour, lw=3.0, label=words)
        for colour, words in ((BEFORE, "base model"), (AFTER, "with what was added"))
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2)
    return figure
