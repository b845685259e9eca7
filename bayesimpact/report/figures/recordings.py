"""Recordings, fit and residuals, as Figs 9 to 11 of Tian et al."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec

from bayesimpact.data.period import crossing_period
from bayesimpact.model.units import display
from bayesimpact.report.cycles import contacts, stop_level
from bayesimpact.report.figures.style import (
    GREY,
    MODEL,
    ORANGE,
    RECORDED,
    WIDTH,
    label,
    polyline,
    response,
    response_word,
    styled,
)
from bayesimpact.report.results import RecordingResult, Results

MOST = 12
"""Recordings shown; a table in the report has all of them."""
PER_PAGE = 3
CLOSE_UP_CYCLES = 3.0
CLOSE_UP_MARGIN = 1.0  # on either side of an impact, in times in contact
CLOSE_UP_SAMPLES = 10  # on either side, at least
_ROW, _TOP, _BOTTOM = 2.15, 0.55, 0.5  # in; two figures of three recordings on a page of A4


def shown_recordings(results: Results) -> tuple[RecordingResult, ...]:
    """All recordings, or the worst-fitted ones of every case in turn where there are too many."""
    if len(results.recordings) <= MOST:
        return results.recordings
    by_case: dict[str, list[RecordingResult]] = {}
    for recording in sorted(results.recordings, key=lambda r: -r.reduced_chi2):
        by_case.setdefault(recording.case, []).append(recording)
    chosen: list[RecordingResult] = []
    depth = 0
    while len(chosen) < MOST:
        chosen += [rs[depth] for rs in by_case.values() if len(rs) > depth]
        depth += 1
    names = {r.name for r in chosen[:MOST]}
    return tuple(r for r in results.recordings if r.name in names)


def recording_figures(results: Results) -> Mapping[str, Figure]:
    """Figures by name, `PER_PAGE` recordings of one case on each."""
    figures = {}
    for case in dict.fromkeys(r.case for r in results.recordings):
        mine = [r for r in shown_recordings(results) if r.case == case]
        pages = [mine[i : i + PER_PAGE] for i in range(0, len(mine), PER_PAGE)]
        for page, recordings in enumerate(pages, 1):
            name = f"fit_case_{case}" if case else "fit"
            figures[name + (f"_{page}" if len(pages) > 1 else "")] = _page(results, recordings)
    return figures


@styled
def _page(results: Results, recordings: Sequence[RecordingResult]) -> Figure:
    height = _ROW * len(recordings) + _TOP + _BOTTOM
    figure = Figure(figsize=(WIDTH, height), dpi=150)
    # Placed by hand: a layout engine takes longer than all the drawing.
    outer = GridSpec(len(recordings), 1, figure, hspace=0.25, left=0.08, right=0.978,
                     bottom=_BOTTOM / height, top=1 - _TOP / height)  # fmt: skip
    limit = _residual_limit(results)
    for i, recording in enumerate(recordings):
        grid = outer[i].subgridspec(
            2, 2, height_ratios=[2.0, 1.0], width_ratios=[2.1, 1.0], hspace=0.12, wspace=0.09
        )
        whole = figure.add_subplot(grid[0, 0])
        below = figure.add_subplot(grid[1, 0], sharex=whole)
        near = figure.add_subplot(grid[0, 1], sharey=whole)
        near_below = figure.add_subplot(grid[1, 1], sharex=near, sharey=below)
        _motion(whole, results, recording, dots=False)
        _motion(near, results, recording, dots=True)
        _residual(below, results, recording, limit)
        _residual(near_below, results, recording, limit)
        for first, past in recording.excluded:
            for axis in (whole, below, near, near_below):
                span = ((first - 1) * recording.interval, past * recording.interval)
                axis.axvspan(*span, color=GREY, alpha=0.3, lw=0.8)
        start, end, words = close_up(results, recording)
        whole.set_xlim(0, recording.times[-1])
        near.set_xlim(start, end)
        case = f", case {recording.case}" if recording.case else ""
        whole.set_title(f"{recording.name}{case}", loc="left", fontweight="bold")
        near.set_title(f"close-up: {words}", loc="left")
        for axis in (whole, near):
            axis.tick_params(labelbottom=False)
        if i == len(recordings) - 1:
            for axis in (below, near_below):
                axis.set_xlabel(label("time since the first sample", "s"))
        for axis in (near, near_below):
            axis.tick_params(labelleft=False)
            axis.set_ylabel("")
        if i == 0:
            _legend(figure, near, below)
    figure.align_ylabels()
    return figure


def _legend(figure: Figure, motion: Axes, residual: Axes) -> None:
    found: dict[str, Artist] = {}
    for axis in (motion, residual):
        for handle, words in zip(*axis.get_legend_handles_labels(), strict=True):
            found.setdefault(words, handle)
    figure.legend(found.values(), found.keys(), loc="upper left", ncols=4, markerscale=2)


def _period(results: Results) -> float:
    """Period of free motion, s; of the recordings where the fit has no stiffness."""
    k1 = results.row("k1").median
    if k1 > 0 and np.isfinite(k1):
        return float(2 * np.pi * np.sqrt(results.mass / k1))
    found = [crossing_period(r.samples, r.interval) for r in results.recordings]
    known = [period for period in found if period is not None]
    longest = max(float(r.times[-1]) for r in results.recordings)
    return float(np.median(known)) if known else longest / CLOSE_UP_CYCLES


def _release(recording: RecordingResult) -> float:
    """When the motion is largest first, s: earlier samples are of less interest."""
    size = np.abs(recording.predicted - recording.predicted.mean())
    return float(recording.times[int(np.argmax(size > 0.9 * size.max()))])


def close_up(results: Results, recording: RecordingResult) -> tuple[float, float, str]:
    """Start and end of the close-up, s, and what it shows: the deepest impact, or first cycles."""
    (y, level), t = contacts(results, recording), recording.times
    deepest = int(np.argmax(y))
    if level is None or not y[deepest] >= level:
        close = min(float(t[-1]), _release(recording) + CLOSE_UP_CYCLES * _period(results))
        return max(0.0, close - CLOSE_UP_CYCLES * _period(results)), close, "first cycles"
    free = np.flatnonzero(y < level)
    first = int(np.max(free[free < deepest], initial=0))
    last = int(np.min(free[free > deepest], initial=t.size - 1))
    margin = max(CLOSE_UP_SAMPLES, round(CLOSE_UP_MARGIN * (last - first)))
    ends = max(first - margin, 0), min(last + margin, t.size - 1)
    return float(t[ends[0]]), float(t[ends[1]]), "deepest impact"


def _residual_limit(results: Results) -> float:
    """One scale for the residuals of all figures, in the unit of the first recording."""
    shown = shown_recordings(results)
    sizes = [float(np.max(np.abs(r.residual), initial=0.0)) / r.scale for r in shown]
    sizes += [2.2 * r.noise_rms / r.scale for r in shown]
    return 1.08 * max((size for size in sizes if np.isfinite(size)), default=0.0)


def _motion(axis: Axes, results: Results, recording: RecordingResult, *, dots: bool) -> None:
    shown = response(results, recording)
    t, y, fit = recording.times, recording.samples * shown.scale, recording.predicted * shown.scale
    # The recording is the wider of the two lines, or circles about the model's: both are seen.
    if dots:
        axis.plot(t, y, "o", mfc="none", mec=RECORDED, ms=4.5, mew=0.9, label="recorded",
                  rasterized=True)  # fmt: skip
    else:
        axis.plot(*polyline(t, y), color=RECORDED, lw=2.6, rasterized=True)
    axis.plot(*polyline(t, fit), color=MODEL, lw=0.8, label="model at the mode")
    level = stop_level(results, recording)
    if level is not None:
        axis.axhline(level * shown.scale, color=GREY, lw=0.8, ls=(0, (4, 3)), label="stop")
    words = f"{response_word(results, recording)}\n"
    axis.set_ylabel(label(words, shown.unit).replace("\n ", "\n"))
    axis.grid(axis="y")


def _residual(axis: Axes, results: Results, recording: RecordingResult, limit: float) -> None:
    sizes = [x * recording.scale for x in (results.rms, results.noise.level) if np.isfinite(x)]
    shown, limit = display(recording.unit, max(sizes, default=0.0)), limit * recording.scale
    r = recording.residual * shown.scale
    axis.plot(*polyline(recording.times, r), color="#555555", lw=0.45, rasterized=True)
    band = 2 * recording.noise_rms * shown.scale
    for level in (-band, band):
        axis.axhline(level, color=ORANGE, lw=0.9, label="± 2 standard deviations of the noise")
    if 0 < limit < np.inf:
        axis.set_ylim(-limit * shown.scale, limit * shown.scale)
    axis.set_ylabel(label("residual\n", shown.unit).replace("\n ", "\n"))
