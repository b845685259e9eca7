"""Readings of a probe that was asked more often than it renews its reading.

Between two renewals such a probe answers with the same number again. Rows then repeat in an even
beat, 2 in 7 of those of a sensor of 400 Hz asked at 560 Hz, and stamps are of when it was asked, up
to a whole row after the reading was taken. What it has to tell is one reading a renewal, evenly.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

Array = NDArray[np.float64]

STRETCH = 40  # renewals in a row, each with a new number, that show the beat
REPEATS = 5  # among them, at least: of as many places drawn at random 0 of 2,000 draws are so even
SHARE = 0.1  # of all rows that repeat, at least: fewer hardly change the clock
EVENLY = 1.2  # rows that changes differ by from even ones: one, and a little for the fit of a line
MOST = 20_000  # changes in which the beat is looked for


def renewed(times: Array, samples: Array) -> tuple[Array, float] | None:
    """The readings that renewals brought, and their interval, s, of readings (n,) with time stamps
    (n,), s; None where no beat shows.

    Where the motion is slow, or clipped, a renewal may bring the same number: the beat is taken
    from where every one brought another, and has to go on from there to both ends.
    """
    changes = np.append(0, np.flatnonzero(np.diff(samples) != 0.0) + 1)
    if changes.size <= STRETCH or samples.size - changes.size < SHARE * samples.size:
        return None
    at, row = times[changes], float(np.max(np.diff(times)))
    found = _stretch(at, changes, row)
    if found is None:
        return None
    first, end = found
    count = np.arange(end - first)
    while True:
        interval, _ = np.polyfit(count, at[first:end], 1)
        begin = float(np.min(at[first:end] - interval * count))
        late = at[first:end] - begin - interval * count
        if np.max(late) > EVENLY * row or interval <= row:
            return None
        if first == 0 and end == at.size:
            break
        reach = end - first
        first, end = max(first - reach // 4, 0), min(end + reach // 4, at.size)
        spare = 0.5 * (EVENLY * row - np.max(late))  # a change is seen up to a row late
        count = np.floor((at[first:end] - begin + spare) / interval)
        if np.any(np.diff(count) < 1):
            return None
        count -= count[0]
    total = int(count[-1]) + 1
    if total > (1.0 - SHARE) * (changes[-1] + 1):
        return None
    last = np.searchsorted(count, np.arange(total), side="right") - 1
    return samples[changes[last]], float(interval)


def _stretch(at: Array, changes: NDArray[np.int64], row: float) -> tuple[int, int] | None:
    """First and last-plus-one of the changes that follow one another most evenly, seen at `at`, s,
    with rows between them that repeat; None where none are even.
    """
    windows = sliding_window_view(at[:MOST], STRETCH)
    line = np.arange(STRETCH) - 0.5 * (STRETCH - 1)
    slopes = windows @ line / (line @ line)
    spread = np.ptp(windows - slopes[:, None] * line, axis=1)
    rows = changes[STRETCH - 1 : STRETCH - 1 + slopes.size] - changes[: slopes.size]
    spread[rows < STRETCH - 1 + REPEATS] = np.inf
    first = int(np.argmin(spread))
    return (first, first + STRETCH) if spread[first] <= EVENLY * row else None
