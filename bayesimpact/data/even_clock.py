"""Readings with time stamps of their own, taken over to an even clock."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.clock import GAP, JITTER, even_interval, rounded_interval, taken_evenly
from bayesimpact.data.faults.clipped import find_clipped
from bayesimpact.data.gaps import bridged
from bayesimpact.data.recording import Recording
from bayesimpact.data.renewals import renewed
from bayesimpact.errors import InputError

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Even:
    """Readings on an even clock: samples (n,), interval s, used (n,) or None; whether they follow
    one another evenly as they were, and their stamps are of when they arrived; and how many of the
    readings repeated the one before because the probe had no newer one.
    """

    samples: Array
    interval: float
    used: Mask | None
    stamped_late: bool = False
    repeated: int = 0


def on_clock(
    path: Path | str,
    times: Array,
    samples: Array,
    rows: NDArray[np.int64],
    place: str = "line",
    *,
    resample: bool,
    alone: bool = False,
) -> Even:
    """Readings with written time stamps (n,), s, whatever they were read from; `alone` where no
    input or other channel has to stay on the clock of their rows.

    Raises
    ------
    InputError
        for an uneven clock, unless `resample` allows it: see `even_interval`, `on_even_clock`.
    """
    if resample and alone and np.all(np.diff(times) > 0.0):
        found = renewed(times, samples)
        if found is not None:
            return Even(*found, None, repeated=samples.size - found[0].size)
    if resample:
        return on_even_clock(path, times, samples, rows, place)
    return Even(samples, even_interval(path, times, rows, place), None)


def on_even_clock(
    path: Path | str, times: Array, samples: Array, rows: NDArray[np.int64], place: str = "line"
) -> Even:
    """Readings at uneven times (n,), s, taken over to an even clock by a cubic spline.

    Stamps that are an even clock's, written to a coarse unit or with rows missing, keep their
    readings. Elsewhere the interval is the mean of the file's, stretched to end on the last stamp;
    where the file leaves a gap, samples are marked as not used.

    Raises
    ------
    InputError
        where time stands still or runs backwards; `path`, `rows` (n,) and `place`, what a row is
        called, are for the message.
    """
    from scipy.interpolate import CubicSpline

    steps = np.diff(times)
    wrong = np.flatnonzero(steps <= 0.0)
    if wrong.size:
        i = int(wrong[0])
        found = f"time that does not increase ({times[i + 1]:.9g} s after {times[i]:.9g} s)"
        raise InputError(f"{path}, {place} {rows[i + 1]}", found, "times that increase")
    typical = float(np.mean(steps[steps <= GAP * np.median(steps)]))
    interval = rounded_interval(times, steps)
    if interval is not None:
        return Even(samples, interval, None)
    missing = _missing_rows(times, samples, steps)
    if missing is not None:
        return missing
    count = max(1, round(float(times[-1] - times[0]) / typical))
    even = np.linspace(times[0], times[-1], count + 1)
    before = np.clip(np.searchsorted(times, even, side="right") - 1, 0, times.size - 2)
    distance = np.minimum(np.abs(even - times[before]), np.abs(even - times[before + 1]))
    used = (steps[before] <= GAP * typical) | (distance < 0.1 * typical)
    values = np.asarray(CubicSpline(times, samples)(even), dtype=np.float64)
    _end_where_readings_do(values, even, times, samples)
    late = taken_evenly(times, samples)
    if used.all():
        return Even(values, float(even[1] - even[0]), None, late)
    return Even(bridged(values, used), float(even[1] - even[0]), used, late)


def _missing_rows(times: Array, samples: Array, steps: Array) -> Even | None:
    """Readings of an even clock whose file lacks rows, each in its place; None for any other."""
    place = np.concatenate([[0], np.cumsum(np.round(steps / np.median(steps)))]).astype(np.int64)
    slope, first = np.polyfit(place, times - times[0], 1)
    late = float(np.max(np.abs(times - times[0] - first - slope * place)))
    if late > JITTER * slope or place[-1] == times.size - 1 or np.diff(place).min() < 1:
        return None
    used = np.zeros(place[-1] + 1, dtype=bool)
    used[place] = True
    values = np.interp(np.arange(used.size), place, samples)
    return Even(bridged(values, used), float(slope), used)


def _end_where_readings_do(values: Array, even: Array, times: Array, samples: Array) -> None:
    """Keep the spline's values within the range of a recorder that clipped the readings.

    A spline overshoots where a plateau begins and ends, which hides that the readings were cut.
    Along a plateau values lie on the lines between its readings. Those between it and the reading
    next to it may have been cut, and are its first or last.
    """
    raw = Recording("", "", samples, float(np.mean(np.diff(times))))
    for fault in find_clipped(raw):
        at_most = np.minimum if fault.size == samples.max() else np.maximum
        at_most(values, fault.size, out=values)
        for first, end in fault.spans:
            before, after = times[max(first - 1, 0)], times[min(end, times.size - 1)]
            near = (even > before) & (even < after)
            within = np.clip(even[near], times[first], times[end - 1])
            values[near] = np.interp(within, times, samples)
