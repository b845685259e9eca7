"""`recording_clipped`: the probe or the recorder reached the end of its range."""

from __future__ import annotations

from bayesimpact.data.faults.fault import Fault, amount, file_time, times_of
from bayesimpact.data.faults.flat import Flat, flats, reading_step
from bayesimpact.data.gaps import excluded
from bayesimpact.data.period import noise_level
from bayesimpact.data.recording import Recording

LEAST = 3  # equal readings in a row at the extreme
MISSED = 3.0  # steps (or standard deviations of the noise) that the motion would have made
SEVERAL = 2  # half cycles cut, or one with as many samples as below
LONG = 12


def find_clipped(recording: Recording) -> list[Fault]:
    """Runs at the largest or the smallest reading that hide a motion beyond it.

    A turning point that the readings' step flattens hides less than a step; three steps, and three
    standard deviations of the noise, count. A run at the beginning may be a rest, unless another
    one has the same reading.
    """
    x = recording.samples
    unit = max(reading_step(x), noise_level(x))
    found = []
    for extreme, side in ((float(x.max()), "largest"), (float(x.min()), "smallest")):
        cut = [
            run for run in flats(x, LEAST) if run.value == extreme and run.missed > MISSED * unit
        ]
        if len(cut) >= SEVERAL or any(run.size >= LONG and run.first > 0 for run in cut):
            found.append(_fault(recording, extreme, side, cut, unit))
    return found


def _fault(recording: Recording, extreme: float, side: str, cut: list[Flat], unit: float) -> Fault:
    x = recording.samples
    # what stands alone at the extreme between two runs was cut as well
    spans = tuple((run.first, run.end) for run in flats(x, 1) if run.value == extreme)
    hidden = max(run.missed for run in cut)
    return Fault(
        id="recording_clipped",
        recording=recording.name,
        spans=spans,
        start_s=file_time(recording, spans[0][0]),
        end_s=file_time(recording, spans[-1][1] - 1),
        size=extreme,
        unit=recording.unit,
        statement=f"clipped at its {side} reading, {amount(extreme, recording.unit)}, in "
        f"{len(cut)} half cycle(s), first at {times_of(recording, spans[:1])}",
        remedy=excluded(recording, spans),
        strength=hidden / unit if unit else float("inf"),
        threshold=MISSED,
    )
