"""The plot of `bayesimpact check`: every recording as it was read."""

from __future__ import annotations

from matplotlib.figure import Figure

from bayesimpact.data.campaign import Campaign
from bayesimpact.report.figures.save import escaped
from bayesimpact.report.figures.style import styled

MOST = 60
"""Panels in one figure; what is beyond is named in the title."""


@styled
def campaign_figure(campaign: Campaign) -> Figure:
    """One panel per recording, time against displacement in mm (or angle in rad)."""
    shown = campaign.recordings[:MOST]
    columns = min(3, len(shown))
    rows = -(-len(shown) // columns)
    figure = Figure(figsize=(4.2 * columns, 2.1 * rows + 0.6), layout="constrained", dpi=120)
    axes = figure.subplots(rows, columns, squeeze=False, sharey=True)
    for axis in axes.flat[len(shown) :]:
        axis.set_visible(False)
    for panel, (axis, recording) in enumerate(zip(axes.flat, shown, strict=False)):
        angle = recording.quantity == "angle"
        scale, label = (1.0, "angle, rad") if angle else (1e3, "displacement, mm")
        axis.plot(recording.start + recording.times, recording.samples * scale, lw=0.6)
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
