"""The likeliest formula against the learned force and its band."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bayesimpact.inference.fit import Z90
from bayesimpact.model.units import Display, readable, typeset
from bayesimpact.report.figures.style import (
    AFTER,
    BEFORE,
    GREY,
    Array,
    label,
    new_figure,
    position,
    position_word,
    styled,
)
from bayesimpact.report.results import Results


def formula_figures(results: Results) -> Mapping[str, Figure]:
    """Both parts of the force, where a formula was found for a force of the displacement."""
    arrays = results.diagnosis_arrays
    if "formula_a" not in arrays or not (results.diagnosis or {}).get("formulas"):
        return {}
    return {"formula": _figure(results, arrays)}


@styled
def _figure(results: Results, arrays: Mapping[str, Array]) -> Figure:
    figure = new_figure(3.2)
    left, right = figure.subplots(1, 2)
    _part(left, results, arrays, "a", "N")
    _part(right, results, arrays, "b", "N s/m")
    left.set_title("conservative part $a(y)$", loc="left")
    right.set_title("dissipative part $b(y)$, times $v$", loc="left")
    handles, labels = left.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(handles))
    return figure


def _part(axis: Axes, results: Results, arrays: Mapping[str, Array], part: str, unit: str) -> None:
    shown = position(results)
    x, mean = arrays["reference_y"] * shown.scale, arrays[f"reference_{part}"]
    half, found = Z90 * arrays[f"reference_{part}_sd"], arrays[f"formula_{part}"]
    force = _unit(results, unit, float(np.max(np.abs(mean) + half)))
    if "gap" in arrays:
        axis.axvspan(arrays["gap"][0] * shown.scale, x[-1], color="#ECECEC", lw=0, zorder=0)
    axis.axhline(0.0, color=GREY, lw=0.6)
    band = (mean - half) * force.scale, (mean + half) * force.scale
    axis.fill_between(x, *band, color=BEFORE, alpha=0.3, lw=0)
    axis.plot(x, mean * force.scale, color=BEFORE, lw=1.2, label="learned force, 90 % band")
    axis.plot(x, found * force.scale, color=AFTER, lw=1.6, ls=(0, (5, 2)), label="formula")
    axis.set_xlim(x[0], x[-1])
    axis.set_xlabel(label(position_word(results), shown.unit))
    axis.set_ylabel(f"force ({typeset(force.unit)})" if part == "a" else typeset(force.unit))


def _unit(results: Results, unit: str, size: float) -> Display:
    if results.angular:
        unit = {"N": "N m", "N s/m": "N m s/rad"}[unit]
    return readable(unit, size)
