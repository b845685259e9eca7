"""`recording_held`: a reading repeated while the motion went on, zeros, a dead tail."""

from __future__ import annotations

import numpy as np

from bayesimpact.data.faults.fault import (
    FALSE_ALARM,
    Fault,
    amount,
    file_time,
    times_of,
)
from bayesimpact.data.faults.flat import Flat, equal_share, flats, last_digit, reading_step
from bayesimpact.data.gaps import excluded
from bayesimpact.data.recording import Recording

LEAST = 5  # equal readings in a row
MISSED = 4.0  # reading steps that a motion would have made within the run, or at once after
BESIDE = 3  # samples on either side of a run, across which the motion's way is compared
FEW = 20  # places that tell how often readings repeat where the motion is slow
COARSE = 0.02  # of neighbours equal: from here on a decayed motion ends in equal readings


def find_held(recording: Recording) -> list[Fault]:
    """Runs of equal readings that neither noise nor rounding explains.

    Two equal neighbours have a probability p, taken from the recording, where the motion is as slow
    as about the run: at its turning points readings repeat more often. A run of r has n p^(r - 1).
    A run must also hide a motion of four steps of the readings, or end in such a jump, or
    reach to the end. Where readings come in steps, one that is entered by less than a step a sample
    and reaches to the end is rest: the motion died away, or friction holds the mass.
    """
    x = recording.samples
    share = equal_share(x)
    step = last_digit(x)
    level, rounded = float(np.ptp(x)), reading_step(x)
    chosen: list[Flat] = []
    for run in flats(x, LEAST):
        if not _is_rare(x, run, max(share, 1.0 / x.size)):
            continue
        dead = run.end == x.size
        if dead and run.slope < rounded:
            continue
        if max(run.missed(rounded), run.jump) < MISSED * step and not (dead and share < COARSE):
            continue
        if _at_extreme(x, run, level) or not _is_rare(x, run, _share_as_slow(x, run)):
            continue
        chosen.append(run)
    if not chosen:
        return []
    spans = tuple((run.first, run.end) for run in chosen)
    longest = max(chosen, key=lambda run: run.size)
    count = sum(run.size for run in chosen)
    equal = max(share, _share_as_slow(x, longest), 1.0 / x.size)
    log_chance = np.log10(x.size) + (longest.size - 1) * np.log10(equal)
    values = {run.value for run in chosen}
    what = "zeros" if values == {0.0} else "readings held"
    if len(values) == 1 and longest.value != 0.0:
        what += f" at {amount(longest.value, recording.unit)}"
    tail = chosen[-1]
    alone = tail.end == x.size and len(chosen) == 1
    place = "until the end" if alone else f"in {len(chosen)} place(s)"
    return [
        Fault(
            id="recording_held",
            recording=recording.name,
            spans=spans,
            start_s=file_time(recording, spans[0][0]),
            end_s=file_time(recording, spans[-1][1] - 1),
            size=float(count),
            unit="samples",
            statement=f"{count} {what} {place}, at {times_of(recording, spans)}",
            remedy=f"end_s = {file_time(recording, tail.first - 0.6):.9g}"
            if alone
            else excluded(recording, spans),
            strength=float(-log_chance),
            threshold=float(-np.log10(FALSE_ALARM)),
            action="cut" if alone else "exclude",
        )
    ]


def _is_rare(x: np.ndarray, run: Flat, share: float) -> bool:
    """Whether a run is no chance where so many neighbours are equal."""
    return x.size * share ** (run.size - 1) <= FALSE_ALARM


def _share_as_slow(x: np.ndarray, run: Flat) -> float:
    """How often neighbours are equal where the motion gets no farther than across a run and a few
    samples beside it, or at the `FEW` slowest places; the run itself left out.
    """
    first, last = max(run.first - BESIDE, 0), min(run.end - 1 + BESIDE, x.size - 1)
    span = last - first
    far = np.abs(x[span:] - x[:-span])
    middle = np.arange(far.size) + span // 2
    other = (middle + 1 < run.first - span) | (middle > run.end + span)
    middle, far = middle[other], far[other]
    if far.size <= FEW:
        return 0.0
    slow = middle[far <= max(abs(x[last] - x[first]), np.partition(far, FEW)[FEW])]
    return float(np.mean(x[slow] == x[slow + 1]))


def _at_extreme(x: np.ndarray, run: Flat, level: float) -> bool:
    """Whether a run lies at the largest or smallest reading, where clipping is the better word."""
    return level > 0 and (run.value == x.max() or run.value == x.min())
