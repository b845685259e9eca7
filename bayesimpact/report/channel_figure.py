"""The plot of `bayesimpact new`: every channel of the files as it was read."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from bayesimpact.data.readers.channel import Channel
from bayesimpact.data.readers.guess import nearest_clock

MOST = 60
"""Panels in one figure; what is beyond is named in the title."""
POINTS = 20_000
"""Samples drawn of a channel; longer ones are thinned."""


def channel_figure(files: Sequence[tuple[str, Sequence[Channel]]]) -> Figure:
    """One panel per channel that is no clock; time in s where the file has one, else samples."""
    panels = [
        (file, c, nearest_clock(all_, c)) for file, all_ in files for c in all_ if not c.is_time
    ]
    shown = panels[:MOST]
    columns = min(3, max(1, len(shown)))
    rows = max(1, -(-len(shown) // columns))
    figure = Figure(figsize=(4.2 * columns, 2.1 * rows + 0.6), layout="constrained", dpi=120)
    axes = figure.subplots(rows, columns, squeeze=False)
    for axis in axes.flat[len(shown) :]:
        axis.set_visible(False)
    for axis, (file, channel, clock) in zip(axes.flat, shown, strict=False):
        step = max(1, channel.samples.size // POINTS)
        times, label = np.arange(channel.samples.size, dtype=np.float64), "sample"
        if clock is not None:
            times, label = clock.seconds(), "time, s"
        elif channel.times is not None:
            times, label = channel.times, "time, s"
        elif channel.interval is not None:
            times, label = channel.start + times * channel.interval, "time, s"
        axis.plot(times[::step], channel.samples[::step], lw=0.6)
        axis.set_title(f"{file}: {channel.name}", fontsize="small", parse_math=False)
        axis.set_xlabel(label, fontsize="small")
        axis.set_ylabel(channel.unit or "no unit", fontsize="small", parse_math=False)
        axis.tick_params(labelsize="small")
        axis.grid(alpha=0.3)
    if len(panels) > len(shown):
        figure.suptitle(f"and {len(panels) - len(shown)} more channels")
    return figure
