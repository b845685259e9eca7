"""`recording_start`: a hammer or a snap that still acts on the first readings.

A free motion obeys the same equation from its first reading on. What it did before follows from
what comes after: by linear prediction backwards in time, exact for any number of modes, and for
other laws as good in one period as in the next. Readings while something still strikes do not
follow, by far more than all others, and that ends within a period.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from bayesimpact.data.faults.fault import Fault, start_fault
from bayesimpact.data.gaps import shown_period
from bayesimpact.data.recording import Recording

ORDER = 16  # readings from which one before is predicted: of up to eight modes
PERIODS = 8.0  # of a recording, at least, and so many times `ORDER` readings
MOST = 4000  # readings that the prediction is fitted to
NEXT = 2.0  # periods after the first one, whose largest error is compared
LARGE = 0.05  # of the readings' range: no noise, and no end of a filter, does as much
ABRUPT = 10.0
"""Times as much as after it. A mode that rings down by itself, to exp(-16) over a recording of
`PERIODS` periods, falls to a seventh in a period."""


def find_shock(recording: Recording) -> list[Fault]:
    """First readings of a free motion without a stop that do not lead to those after them."""
    period = shown_period(recording)
    if recording.case or period is None:
        return []
    x = recording.samples[:MOST]
    first = max(round(period / recording.interval), 2)
    if recording.samples.size < PERIODS * first or x.size < PERIODS * ORDER + first:
        return []
    errors = _errors(x, recording.used, first)
    after = float(np.max(errors[first : first + round(NEXT * first)], initial=0.0))
    struck = np.flatnonzero(errors[:first] > ABRUPT * after)
    if struck.size == 0 or errors[struck].max() < LARGE * np.ptp(recording.samples):
        return []
    rest = errors[:first] > np.sqrt(ABRUPT) * after
    end = int(np.flatnonzero(rest)[-1]) + 1
    ratio = float(errors[:first].max() / max(after, 1e-300))
    return [start_fault(recording, end, ratio, ABRUPT)]


def _errors(x: np.ndarray, used: np.ndarray | None, first: int) -> np.ndarray:
    """How far every reading is off what those after it lead to, (n - ORDER,); fitted from `first`
    on, to readings that count.
    """
    rows = np.column_stack([sliding_window_view(x[1:], ORDER), np.ones(x.size - ORDER)])
    target = x[:-ORDER]
    counts = np.arange(target.size) >= first
    if used is not None:
        counts &= sliding_window_view(used[: x.size], ORDER + 1).all(axis=1)
    if counts.sum() < 2 * ORDER:
        return np.zeros(target.size)
    weights = np.linalg.lstsq(rows[counts], target[counts], rcond=1e-9)[0]
    return np.asarray(np.abs(target - rows @ weights))
