"""Traces of the sampler: a few walkers of every ensemble."""

from __future__ import annotations

from collections.abc import Mapping
from textwrap import fill

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from bayesimpact.model.units import typeset
from bayesimpact.report.figures.style import (
    CYCLE,
    WIDTH,
    Told,
    new_figure,
    scaled,
    styled,
)
from bayesimpact.report.names import split
from bayesimpact.report.results import SamplerSummary

MOST = 14
"""Parameters shown."""
_TITLE_COLUMNS = 60  # characters


@styled
def trace_figure(sampler: SamplerSummary, told: Mapping[str, Told] | None = None) -> Figure:
    """One panel per parameter of interest, one colour per ensemble; `told`: see `scaled`."""
    names = sampler.trace_names[:MOST]
    columns = min(2, len(names))
    rows = -(-len(names) // columns)
    figure = new_figure(1.25 * rows + 0.8, WIDTH if columns == 2 else 0.6 * WIDTH)
    panels = figure.subplots(rows, columns, squeeze=False, sharex=True)
    for axis in panels.flat[len(names) :]:
        axis.remove()
    for k, axis in enumerate(panels.flat[: len(names)]):
        draws = sampler.traces[..., k]
        shown = scaled(names[k], sampler.trace_units[k], draws.ravel(), (told or {}).get(names[k]))
        for e in range(draws.shape[0]):
            axis.plot(sampler.trace_steps, shown(draws[e]), color=CYCLE[e % len(CYCLE)],
                      lw=0.45, alpha=0.6, rasterized=True)  # fmt: skip
        unit = typeset(shown.unit)
        effect, _, _ = split(names[k])
        title = shown.quantity + (f", in {unit}" if unit else "")
        title = fill(f"{effect}: {title}", _TITLE_COLUMNS) if effect else title
        axis.set_title(title, loc="left", fontsize=8.0)
        axis.set_xlim(0, max(float(sampler.trace_steps[-1]), 1.0))
        axis.tick_params(labelbottom=k >= len(names) - columns)
    figure.supxlabel("kept step of the sampler", fontsize=9.0)
    handles = [
        Line2D([], [], color=CYCLE[e % len(CYCLE)], label=f"ensemble {e + 1}")
        for e in range(sampler.ensembles)
    ]
    figure.legend(handles=handles, loc="outside upper left", ncols=min(6, len(handles)))
    return figure
