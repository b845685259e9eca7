"""Readings in coarse steps after the motion has died away: one reading, however often repeated.

The error of a rounded reading changes from sample to sample while the motion crosses several steps.
At rest it is the same in all of them, up to half a step, and a likelihood that took them as
independent would be the surer of it the longer the recording goes on. It is no fault: a
notice says how many readings count once.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayesimpact.data.faults.fault import Fault, file_time
from bayesimpact.data.faults.flat import reading_step
from bayesimpact.data.period import crossing_period
from bayesimpact.data.recording import Recording

WITHIN = 1.5  # steps about the last readings: noise may cross the edge of a step
REPEATED = 0.5  # of neighbours equal: noise below a third of a step, which rounds nothing evenly


def without_tail(recording: Recording) -> tuple[Recording, Fault | None]:
    """A free decay with all but the first reading of such a tail set aside, and the notice of it;
    as it is, and None, where the tail is shorter than a free period.
    """
    x, step = recording.samples, reading_step(recording.samples)
    period = crossing_period(x, 1.0)
    if recording.input is not None or step == 0.0 or period is None:
        return recording, None
    last = float(np.median(x[-max(int(period), 1) :]))
    moving = np.flatnonzero(np.abs(x - last) > WITHIN * step)
    first = int(moving[-1]) + 2 if moving.size else x.size
    repeated = float(np.mean(np.diff(x[first:]) == 0.0)) if first <= x.size - period else 0.0
    if repeated < REPEATED:
        return recording, None
    used = np.ones(x.size, dtype=bool) if recording.used is None else recording.used.copy()
    used[first:] = False
    return replace(recording, used=used), _notice(recording, first, repeated)


def _notice(recording: Recording, first: int, repeated: float) -> Fault:
    """The rest from a sample on as a record; nothing is to be done about it."""
    at, count = file_time(recording, first), recording.samples.size
    return Fault(
        id="recording_rest",
        recording=recording.name,
        spans=((first, count),),
        start_s=at,
        end_s=file_time(recording, count - 1),
        size=float(count - first),
        unit="samples",
        statement=f"at rest from {at:.4g} s on: readings in one step, {count - first} of {count}, "
        "count once",
        remedy="",
        strength=repeated,
        threshold=REPEATED,
        action="notice",
    )
