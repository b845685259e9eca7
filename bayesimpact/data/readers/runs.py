"""Recordings that a logger appended to one another in one table: its clock starts over.

Each becomes a block of its own, `run 1`, `run 2`, ... A clock that slips back by a little is none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.readers.channel import Channel, says_time

LEAST = 8  # rows of a run, a period of few samples
OVER = 0.1  # of a run's duration about the first stamp of all, where the next run begins
EVEN = 0.5  # of the median step, by which most steps of an unnamed clock differ from it at most
MOST = 0.9


def separate_runs(channels: Sequence[Channel]) -> list[Channel]:
    """Channels of one table, those of each run apart where its clock starts over."""
    clock = next((c for c in channels if c.is_called_time or says_time(c.name)), None)
    if clock is None and channels and channels[0].name.isdigit():
        clock = channels[0]
    edges = () if clock is None else _starts(clock.samples, named=not clock.name.isdigit())
    if not edges:
        return list(channels)
    spans = list(pairwise((*edges, channels[0].samples.size)))
    return [
        replace(
            c,
            samples=c.samples[first:end].copy(),
            rows=None if c.rows is None else c.rows[first:end],
            block=f"run {i}",
        )
        for i, (first, end) in enumerate(spans, 1)
        for c in channels
    ]


def _starts(stamps: NDArray[np.float64], *, named: bool) -> tuple[int, ...]:
    """Rows at which runs begin; none where stamps (n,) are no clock that starts over."""
    steps = np.diff(stamps)
    falls = np.flatnonzero(steps < 0.0) + 1
    if not falls.size or not np.all(np.isfinite(stamps)):
        return ()
    edges = np.concatenate([[0], falls, [stamps.size]])
    for first, end in pairwise(edges.tolist()):
        run = stamps[first:end]
        if run.size < LEAST or np.any(np.diff(run) == 0.0):
            return ()
        if abs(run[0] - stamps[0]) > OVER * (run[-1] - run[0]):
            return ()
    rising = steps[steps > 0.0]
    even = np.abs(rising / np.median(rising) - 1.0) <= EVEN
    return tuple(edges[:-1].tolist()) if named or np.mean(even) >= MOST else ()
