"""The force that the base model leaves unexplained, over displacement and velocity."""

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
    BLACK,
    GREY,
    Array,
    label,
    new_figure,
    position,
    position_word,
    styled,
)
from bayesimpact.report.results import Results

_SPEEDS = 160
_CONTACT = "#ECECEC"


def force_figures(results: Results) -> Mapping[str, Figure]:
    """The force map, where the diagnosis has one."""
    if "force_y" not in results.diagnosis_arrays:
        return {}
    return {"force_map": _figure(results, results.diagnosis_arrays)}


@styled
def _figure(results: Results, arrays: Mapping[str, Array]) -> Figure:
    figure = new_figure(5.2)
    grid = figure.add_gridspec(2, 2, width_ratios=[1.25, 1.0])
    plane = figure.add_subplot(grid[:, 0])
    upper = figure.add_subplot(grid[0, 1], sharex=plane)
    lower = figure.add_subplot(grid[1, 1], sharex=plane)
    unit = force_unit(results, arrays)
    _map(figure, plane, results, arrays, unit)
    _part(upper, results, arrays, unit, "a", np.ones_like(arrays["force_y"]))
    _part(lower, results, arrays, unit, "b", arrays["force_v_high"])
    upper.set_title("conservative part $a(y)$", loc="left")
    lower.set_title("dissipative part $b(y)\\,v$ at the fastest upward passage", loc="left")
    upper.tick_params(labelbottom=False)
    x_label = label(position_word(results), position(results).unit)
    lower.set_xlabel(x_label)
    plane.set_xlabel(x_label)
    handles, labels = upper.get_legend_handles_labels()
    if len(handles) > 1:
        figure.legend(handles, labels, loc="outside lower center", ncols=len(handles))
    return figure


def force_unit(results: Results, arrays: Mapping[str, Array]) -> Display:
    """Forces in mN unless that gives unreadable numbers."""
    size = float(np.max(np.abs(arrays["force_a"]) + Z90 * arrays["force_a_sd"]))
    if not results.angular and 1e-5 <= size < 10:
        return Display(1e3, "mN")
    return readable("N m" if results.angular else "N", size)


def _map(
    figure: Figure, axis: Axes, results: Results, arrays: Mapping[str, Array], unit: Display
) -> None:
    """Mean force in colour where the mass has been; a line around what exceeds its band."""
    shown = position(results)
    y, low, high = (arrays[f"force_{k}"] for k in ("y", "v_low", "v_high"))
    v = np.linspace(low.min(), high.max(), _SPEEDS)[:, None]
    force = arrays["force_a"] + arrays["force_b"] * v
    variance = arrays["force_a_sd"] ** 2 + (arrays["force_b_sd"] * v) ** 2
    sd = np.sqrt(np.maximum(variance + 2 * v * arrays["force_ab"], 0.0))
    met = (v >= low) & (v <= high)
    limit = float(max(np.abs(force[met]).max(), np.median(Z90 * sd[met]), 1e-300)) * unit.scale
    seen = np.where(met, force * unit.scale, np.nan)
    x, speed = y * shown.scale, v[:, 0] * shown.scale
    mesh = axis.pcolormesh(
        x, speed, seen, cmap="PuOr_r", vmin=-limit, vmax=limit, shading="nearest", rasterized=True
    )
    beyond = np.where(met, np.abs(force) / np.maximum(sd, 1e-300) - Z90, np.nan)
    if np.nanmin(beyond) < 0 < np.nanmax(beyond):
        axis.contour(x, speed, beyond, levels=[0.0], colors=BLACK, linewidths=0.7)
    if "gap" in arrays:
        axis.axvline(arrays["gap"][0] * shown.scale, color=BLACK, lw=0.9, ls=(0, (4, 3)))
    axis.set_ylabel(label("velocity", f"{shown.unit}/s"))
    axis.set_title("unexplained force, posterior mean", loc="left")
    bar = figure.colorbar(mesh, ax=axis, orientation="horizontal", aspect=40, pad=0.02)
    bar.set_label(label("force", unit.unit))
    bar.outline.set_visible(False)  # type: ignore[operator]


def _part(
    axis: Axes,
    results: Results,
    arrays: Mapping[str, Array],
    unit: Display,
    part: str,
    factor: Array,
) -> None:
    """One part with its 90 % band: what the base model leaves, what is left, what was learned."""
    shown = position(results)
    x = arrays["force_y"] * shown.scale
    if "gap" in arrays:
        gap = arrays["gap"][0] * shown.scale
        axis.axvspan(gap, x[-1], color=_CONTACT, lw=0, zorder=0)
        axis.text(gap, 0.02, " contact", transform=axis.get_xaxis_transform(), color="#555555",
                  fontsize=8, ha="left", va="bottom")  # fmt: skip
    axis.axhline(0.0, color=GREY, lw=0.6)
    unknown = (results.diagnosis or {}).get("verdict") == "unknown"
    best = "the best of the catalogue" if unknown else "what was added"
    for name, colour, words in (
        ("force", BEFORE, "left unexplained by the base model, 90 % band"),
        ("left", AFTER, f"still unexplained with {best}"),
    ):
        if f"{name}_{part}" not in arrays:
            continue
        mean = arrays[f"{name}_{part}"] * factor * unit.scale
        half = Z90 * arrays[f"{name}_{part}_sd"] * np.abs(factor) * unit.scale
        axis.fill_between(x, mean - half, mean + half, color=colour, alpha=0.3, lw=0)
        axis.plot(x, mean, color=colour, lw=1.4, label=words)
    if f"learned_{part}" in arrays:
        line = arrays[f"learned_{part}"] * factor * unit.scale
        axis.plot(x, line, color=AFTER, lw=1.2, ls=(0, (5, 2)), label="learned with the parameters")
    axis.set_xlim(x[0], x[-1])
    axis.set_ylabel(f"force ({typeset(unit.unit)})")
    axis.grid(axis="y")
