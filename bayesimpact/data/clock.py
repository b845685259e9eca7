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

# Steps of two units: so many are spread evenly by a clock that is slow, but not by chance (of five
# places drawn at random 0 of 2,000 draws kept within `EVENLY`, of four 1 %)
FEW_STEPS = 5
# Units that the stamps of a slow clock differ by from even ones, and a little for the fit of a line
EVENLY = 1.2
FINE = 0.2  # of an interval: a coarser unit may hide that a clock is not even
GAP = 2.5  # typical intervals between two stamps: more is a gap
RARE = 0.02  # of the steps: stamps of a buffer with more gaps than that are those of batches
ON_THE_WHOLE = 0.1  # relative: of a few batches the last may be short
MOST_COUNTS = 0.9  # of the readings; where they turn, one is the same twice
LEAST_TAKEN = 60  # readings that tell it
SMOOTHER = 1.25
"""Times less that readings are off a cubic over their numbers than over their stamps. Of 8,000
drawn decays that were taken at their uneven stamps (4 to 50 a period, noise of 1e-4 to .1) the
ratio never was above 1.17; of as many that were taken evenly it was above this in 12 to 96 %,
fewest where stamps jitter by little and a period has 4 readings."""


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
        `JITTER` intervals from even spacing, and a coarse unit of the stamps does not explain it.
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
        if (rounded := _finely_rounded(times, steps)) is not None:
            return rounded
        found = (
            f"a sample at {times[worst]:.9g} s, {late[worst] / interval:+.1%} of an interval off"
        )
        accepted = (
            f"evenly spaced samples: every time within {JITTER:.0%} of an interval, "
            "or resample = true"
        )
        raise InputError(f"{path}, {place} {rows[worst]}", found, accepted)
    return interval


def _finely_rounded(times: NDArray[np.float64], steps: NDArray[np.float64]) -> float | None:
    """`rounded_interval` where the unit is so fine that a clock which is not even would show."""
    interval = rounded_interval(times, steps)
    if interval is None:
        return None
    unit = float(np.ptp(steps))  # every step is one of two neighbours
    late = times - np.polyval(np.polyfit(np.arange(times.size), times, 1), np.arange(times.size))
    return interval if unit <= FINE * interval and np.ptp(late) <= EVENLY * unit else None


def rounded_interval(times: NDArray[np.float64], steps: NDArray[np.float64]) -> float | None:
    """Interval of an even clock whose stamps were rounded to a coarse unit; None for any other.

    Where most steps are one unit, longer ones are missing rows, unless as evenly spread as the
    steps of a clock that is a little slow.
    """
    count = np.arange(times.size)
    slope, first = np.polyfit(count, times - times[0], 1)
    late = times - times[0] - first - slope * count
    unit = float(np.diff(np.unique(np.round(steps, 9))).min(initial=np.inf))
    whole = np.abs(steps / unit - np.round(steps / unit)).max() < 1e-3
    if not (whole and np.abs(late).max() <= unit and np.ptp(steps) <= 1.5 * unit):
        return None
    ones = np.median(steps) < 1.5 * unit
    longer = int(np.sum(steps > 1.5 * unit))
    if ones and (longer < FEW_STEPS or np.ptp(late) > EVENLY * unit):
        return None
    return float(slope)


def check_rate(path: Path | str, interval: float, rate: float | None) -> None:
    """Refuse a sample_rate_hz that contradicts the recording's own clock, interval in s."""
    if rate is not None and abs(rate * interval - 1.0) > 1e-3:
        found = f"sample_rate_hz = {rate:g}, and a clock at {1 / interval:g} Hz"
        accepted = "the recording's clock, or sample_rate_hz, or both agreeing"
        raise InputError(str(path), found, accepted)


def check_mean_rate(path: Path | str, times: NDArray[np.float64], rate: float) -> None:
    """Refuse a stated rate that stamps of when readings arrived contradict on the whole."""
    mean = mean_rate(times)
    if abs(mean - rate) > ON_THE_WHOLE * rate:
        found = f"sample_rate_hz = {rate:g}, and {mean:.4g} rows a second by the time column"
        raise InputError(str(path), found, "a rate that agrees with the rows on the whole")


def mean_rate(times: NDArray[np.float64]) -> float:
    """Readings per second by stamps (n,), s, of when they arrived; 0 where these do not rise.

    In a gap none were taken where the stamps after it do not catch up: it is then left out.
    """
    steps, span = np.diff(times), float(times[-1] - times[0])
    if span <= 0.0:
        return 0.0
    usual = steps <= GAP * np.median(steps)
    typical, gaps, lost = float(np.mean(steps[usual])), np.flatnonzero(~usual), 0
    for gap in gaps if gaps.size <= RARE * steps.size else ():
        missing = round(float(steps[gap]) / typical) - 1
        after = steps[gap + 1 : gap + 2 + missing][usual[gap + 1 : gap + 2 + missing]]
        if float(after.sum()) > 0.5 * after.size * typical:
            lost += missing
    return (steps.size + lost) / span


def taken_evenly(times: NDArray[np.float64], samples: NDArray[np.float64]) -> bool:
    """Whether readings (n,) follow one another evenly although their time stamps (n,) do not: those
    of when they arrived, behind a buffer, do not tell when they were taken.

    Not those of an encoder that is read whenever it counts: they follow one another by even steps.
    """
    if times.size < LEAST_TAKEN or not np.all(np.diff(times) > 0.0) or _counts(samples):
        return False
    numbers = np.arange(times.size, dtype=np.float64)
    return _off_a_cubic(times, samples) > SMOOTHER * _off_a_cubic(numbers, samples)


def _counts(samples: NDArray[np.float64]) -> bool:
    """Whether most readings differ from the one before by one and the same step."""
    steps = np.abs(np.diff(samples))
    step = float(np.median(steps))
    return step > 0.0 and bool(np.mean(np.abs(steps - step) < 0.01 * step) > MOST_COUNTS)


def _off_a_cubic(places: NDArray[np.float64], samples: NDArray[np.float64]) -> float:
    """How far samples (n,) are off the cubic through two neighbours on either side, on average,
    over what independent noise would be.
    """
    beside = (slice(None, -4), slice(1, -3), slice(3, -1), slice(4, None))
    at, off = places[2:-2], samples[2:-2].copy()
    variance = np.ones_like(off)
    for one in beside:
        weight = np.ones_like(off)
        for other in beside:
            if other is not one:
                weight *= (at - places[other]) / (places[one] - places[other])
        off -= weight * samples[one]
        variance += weight**2
    return float(np.mean(np.abs(off) / np.sqrt(variance)))
