"""The plot of `bayesimpact check`: every recording as it was read."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.faults.fault import Fault
from bayesimpact.data.gaps import runs
from bayesimpact.data.recording import Recording
from bayesimpact.errors import InputError
from bayesimpact.model.units import reading
from bayesimpact.report.figures.inline import inline
from bayesimpact.report.figures.save import escaped
from bayesimpact.report.figures.style import styled

MOST = 60
"""Panels in one figure; what is beyond is named in the title."""


@styled
def campaign_figure(campaign: Campaign, faults: Sequence[Fault] = ()) -> Figure:
    """One panel per recording, time against the reading (mm, mm/s, else SI); faults in red."""
    shown = campaign.recordings[:MOST]
    columns = min(3, len(shown))
    rows = -(-len(shown) // columns)
    figure = Figure(figsize=(4.2 * columns, 2.1 * rows + 0.6), layout="constrained", dpi=120)
    axes = figure.subplots(rows, columns, squeeze=False, sharey=not campaign.mixed)
    for axis in axes.flat[len(shown) :]:
        axis.set_visible(False)
    for panel, (axis, recording) in enumerate(zip(axes.flat, shown, strict=False)):
        read = reading(recording.quantity, recording.unit)
        scale, label = read.scale, f"{recording.quantity.replace('_', ' ')}, {read.unit}"
        axis.plot(recording.start + recording.times, recording.samples * scale, lw=0.6)
        if recording.used is not None:
            _mark(axis, recording, runs(~recording.used), "0.6")
        for fault in faults:
            if fault.recording == recording.name and fault.action != "notice":
                _mark(axis, recording, fault.spans, "tab:red")
        case = f", case {recording.case}" if recording.case else ""
        axis.set_title(escaped(f"{recording.name}{case}"), fontsize="small")
        if panel >= len(shown) - columns:
            axis.set_xlabel("time, s", fontsize="small")
        if panel % columns == 0:
            axis.set_ylabel(label, fontsize="small")
        axis.tick_params(labelsize="small")
        axis.grid(alpha=0.3)
    rest = len(campaign.recordings) - len(shown)
    figure.suptitle(escaped(campaign.name) + (f" (and {rest} more recordings)" if rest else ""))
    return figure


def plot(what: Campaign | Recording | Iterable[Recording]) -> Figure:
    """`campaign_figure` of a campaign, or of one or more recordings, which notebooks show.

    Raises
    ------
    InputError
        when there is nothing to plot.
    """
    if isinstance(what, Campaign):
        return inline(campaign_figure(what))
    recordings = (what,) if isinstance(what, Recording) else tuple(what)
    if not recordings or not all(isinstance(r, Recording) for r in recordings):
        found = ", ".join(type(r).__name__ for r in recordings) or "nothing"
        raise InputError("plot", found, "a Campaign, a Recording, or several of them")
    title = recordings[0].name if len(recordings) == 1 else f"{len(recordings)} recordings"
    return inline(campaign_figure(Campaign(title, 1.0, recordings, stop=False)))


def _mark(axis: Axes, recording: Recording, spans: Sequence[tuple[int, int]], colour: str) -> None:
    """Shade spans of samples, at least two intervals wide so that a single one can be seen."""
    for first, end in spans:
        low = recording.start + (first - 1) * recording.interval
        high = recording.start + max(end, first + 1) * recording.interval
        axis.axvspan(low, high, color=colour, alpha=0.35, lw=0.8)
