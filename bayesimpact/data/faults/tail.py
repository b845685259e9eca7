"""Readings in coarse steps after the motion has died away: one reading, however often repeated.

The error of a rounded reading changes from sample to sample while the motion crosses several steps.
At rest it is the same in all of them, up to half a step, and a likelihood that took them as
independent would be the surer of it the longer the recording goes on. It is no fault: nothing is
said but a note.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayesimpact.data.faults.quantised import find_quantised
from bayesimpact.data.period import rough_period
from bayesimpact.data.recording import Recording

WITHIN = 1.5  # steps about the last reading: noise may cross the edge of a step


def without_tail(recording: Recording) -> tuple[Recording, str]:
    """A free decay with all but the first reading of such a tail set aside, and a note; as it is,
    and "", where the tail is shorter than a free period.
    """
    coarse = find_quantised(recording)
    period = rough_period(recording.samples, 1.0)
    if recording.input is not None or not coarse or period is None:
        return recording, ""
    x = recording.samples
    moving = np.flatnonzero(
        np.abs(x - np.median(x[-max(int(period), 1) :])) > WITHIN * coarse[0].size
    )
    first = int(moving[-1]) + 2 if moving.size else 0
    if not 0 < first < x.size - period:
        return recording, ""
    used = np.ones(x.size, dtype=bool) if recording.used is None else recording.used.copy()
    used[first:] = False
    at = recording.start + first * recording.interval
    note = f"{recording.name}, at rest from {at:.4g} s on: readings in one step count once"
    return replace(recording, used=used), note
