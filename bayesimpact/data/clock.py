"""Even spacing of a recording's time stamps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bayesimpact.errors import InputError

JITTER = 0.05
"""Largest accepted distance of a time stamp from even spacing, in intervals.

Room for stamps that were rounded when written, as 25.6 kHz in microseconds.
"""


def even_interval(
    path: Path | str, times: NDArray[np.float64], rows: NDArray[np.int64], place: str = "line"
) -> float:
    """Interval of evenly spaced time stamps, s.

    First to last stamp over the number of intervals; where the stamps are rounded, the slope of the
    least-squares line through them, which rounding hardly moves.

    Parameters
    ----------
    path : for messages
    times : (n,) s, n >= 2
    rows : (n,) line of each stamp, for messages
    place : what messages call a row

    Raises
    ------
    InputError
        where time stands still, runs backwards, leaves a gap, or a stamp lies further than
        `JITTER` intervals from even spacing.
    """
    steps = np.diff(times)
    still = np.flatnonzero(steps <= 0.0)
    if still.size:
        i = int(still[0])
        found = "the same time twice" if steps[i] == 0.0 else "time running backwards"
        found += f" ({times[i + 1]:.9g} s after {times[i]:.9g} s)"
        raise InputError(f"{path}, {place} {rows[i + 1]}", found, "times that increase evenly")
    typical = float(np.median(steps))
    gaps = np.flatnonzero(steps > 1.5 * typical)
    if gaps.size:
        i = int(gaps[0])
        found = f"a gap from {times[i]:.9g} s to {times[i + 1]:.9g} s"
        raise InputError(
            f"{path}, {place} {rows[i + 1]}",
            found,
            f"evenly spaced samples, here {typical:.6g} s apart, or resample = true",
        )
    count = np.arange(times.size)
    interval = float(times[-1] - times[0]) / (times.size - 1)
    late = times - times[0] - count * interval
    if np.max(np.abs(late)) > 1e-6 * interval:
        slope, first = np.polyfit(count, late, 1)
        interval += float(slope)
        late = late - first - slope * count
    worst = int(np.argmax(np.abs(late)))
    if abs(late[worst]) > JITTER * interval:
        found = (
            f"a sample at {times[worst]:.9g} s, {late[worst] / interval:+.1%} of an interval off"
        )
        accepted = (
            f"evenly spaced samples: every time within {JITTER:.0%} of an interval, "
            "or resample = true"
        )
        raise InputError(f"{path}, {place} {rows[worst]}", found, accepted)
    return interval


def check_rate(path: Path | str, interval: float, rate: float | None) -> None:
    """Refuse a sample_rate_hz that contradicts the recording's own clock, interval in s."""
    if rate is not None and abs(rate * interval - 1.0) > 1e-3:
        found = f"sample_rate_hz = {rate:g}, and a clock at {1 / interval:g} Hz"
        accepted = "the recording's clock, or sample_rate_hz, or both agreeing"
        raise InputError(str(path), found, accepted)
