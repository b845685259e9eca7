"""The part of a file that start_s and end_s keep: what lies outside is not looked at."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

MARGIN = 1e-6
"""Of an interval: a sample at the very start or end counts in, however its time was rounded."""


def window(
    times: tuple[float, float] | Floats, size: int, start: float | None, end: float | None
) -> tuple[int, int]:
    """First and last-plus-one of the samples between start and end, s.

    All of them where the window holds fewer than two. What lies outside may hold no numbers, and
    no even clock.

    Parameters
    ----------
    times : an even clock (interval, start), or the written time stamps (size,), s
    size : number of samples
    """
    if isinstance(times, tuple):
        interval, first = times
        low = 0 if start is None else math.ceil((start - first) / interval - MARGIN)
        high = size if end is None else math.floor((end - first) / interval + MARGIN) + 1
    else:
        steps = np.diff(times)
        steps = steps[np.isfinite(steps)]
        slack = MARGIN * abs(float(np.median(steps))) if steps.size else 0.0
        inside = np.ones(size, dtype=bool)
        if start is not None:
            inside &= times >= start - slack
        if end is not None:
            inside &= times <= end + slack
        kept = np.flatnonzero(inside)
        low, high = (int(kept[0]), int(kept[-1]) + 1) if kept.size else (0, 0)
    low, high = max(0, low), min(size, high)
    return (low, high) if high - low >= 2 else (0, size)


def unbroken(times: Floats, samples: Floats, first: int, last: int) -> tuple[int, int]:
    """The window first..last-1 and all that follows on either side without a break.

    A break is what is no number, and a time that does not increase. Resampled readings lie on the
    even clock of all this, whatever part of it start and end keep.
    """
    wrong = ~(np.isfinite(times) & np.isfinite(samples))
    stands = np.diff(times) <= 0.0
    before = np.flatnonzero(wrong[:first] | stands[:first])
    after = np.flatnonzero(wrong[last:] | stands[last - 1 :])
    low = int(before[-1]) + 1 if before.size else 0
    return low, last + int(after[0]) if after.size else samples.size
