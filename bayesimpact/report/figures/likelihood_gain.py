"""When, at which impact and in which recordings the missing physics shows."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from bayesimpact.report.figures.style import AFTER, Array, new_figure, rows_axis, styled
from bayesimpact.report.results import Results

_ROW, _LEAST, _MOST = 0.22, 3.2, 8.0  # in


def likelihood_gain_figures(results: Results) -> Mapping[str, Figure]:
    """Gain in log likelihood by recording, time and impact, where there is one."""
    if "gain" not in results.diagnosis_arrays:
        return {}
    return {"likelihood_gain": _figure(results, results.diagnosis_arrays)}


@styled
def _figure(results: Results, arrays: Mapping[str, Array]) -> Figure:
    rows = len(results.recordings)
    impacts = arrays.get("impact_gain")
    figure = new_figure(min(_MOST, max(_LEAST, _ROW * rows + 1.9)))
    ratios = [1.5, 0.8] if impacts is None else [1.5, 0.8, 1.2]
    panels = figure.subplots(1, len(ratios), width_ratios=ratios, squeeze=False)[0]
    _by_time(figure, panels[0], results, arrays["gain"])
    _by_recording(panels[1], arrays["gain"].sum(axis=1))
    if impacts is not None:
        _by_impact(panels[2], impacts)
    return figure


def _by_time(figure: Figure, axis: Axes, results: Results, gain: Array) -> None:
    limit = float(np.abs(gain).max()) or 1.0
    for i, (row, recording) in enumerate(zip(gain, results.recordings, strict=True)):
        edges = np.linspace(0.0, recording.times[-1], gain.shape[1] + 1)
        mesh = axis.pcolormesh(
            edges, [i - 0.45, i + 0.45], row[None], cmap="PuOr_r", vmin=-limit, vmax=limit
        )
    rows_axis(axis, [r.name for r in results.recordings])
    axis.grid(visible=False)
    axis.set_xlabel("time since the first sample (s)")
    axis.set_title("by recording and time", loc="left")
    # Beneath its own panel: beside it, the label reads as the next panel's.
    bar = figure.colorbar(mesh, ax=axis, orientation="horizontal", pad=0.02, aspect=40)
    bar.set_label("gain in log likelihood (nats)")
    bar.outline.set_visible(False)  # type: ignore[operator]


def _by_recording(axis: Axes, total: Array) -> None:
    axis.barh(range(total.size), total, color=AFTER, height=0.6)
    axis.axvline(0.0, color="#444444", lw=0.7)
    rows_axis(axis, [""] * total.size)
    axis.set_xlabel("gain (nats)")
    axis.set_title("by recording", loc="left")


def _by_impact(axis: Axes, gain: Array) -> None:
    """Mean over recordings, up to the impact that half of them reach."""
    gain = gain[:, np.isfinite(gain).sum(axis=0) >= 0.5 * gain.shape[0]]
    number = np.arange(1, gain.shape[1] + 1)
    axis.bar(number, np.nanmean(gain, axis=0), color=AFTER, width=0.8)
    axis.axhline(0.0, color="#444444", lw=0.7)
    axis.set_xlabel("impact number")
    axis.set_ylabel("gain until the next impact,\nmean of recordings (nats)")
    axis.set_title("by impact", loc="left")
    axis.xaxis.set_major_locator(MaxNLocator(integer=True))
    axis.grid(axis="y")
    axis.set_axisbelow(True)
