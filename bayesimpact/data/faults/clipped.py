"""`recording_clipped`: the probe or the recorder reached the end of its range."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayesimpact.data.campaign import Smoothing
from bayesimpact.data.faults.fault import Fault, amount, file_time, times_of
from bayesimpact.data.faults.flat import Flat, flats, reading_step
from bayesimpact.data.gaps import excluded
from bayesimpact.data.period import noise_level
from bayesimpact.data.recording import Recording

LEAST = 3  # equal readings in a row at the extreme
MISSED = 3.0  # steps (or standard deviations of the noise) that the motion would have made
SEVERAL = 2  # half cycles cut, or one with as many samples as below
LONG = 12
SCATTER = 0.005
"""Of the range of the readings: how far those at the end of a recorder's range may scatter, where
it is analogue or its gain is adjusted afterwards."""
FLAT = 5.0
"""Times the scatter that the motion would have made: a turning point that nothing cuts makes one
time of it within such a run, as its slopes at the ends tell. One half cycle suffices where as many
times what counts is hidden."""


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
        most: list[Flat] = []
        for scatter in (0.0, *([SCATTER * float(np.ptp(x))] if not recording.case else [])):
            at_end = np.where(np.abs(x - extreme) <= scatter, extreme, x)
            least = max(MISSED * unit, FLAT * scatter)
            cut = [
                run for run in flats(at_end, LEAST) if run.value == extreme and run.missed() > least
            ]
            if len(cut) > len(most) and (
                len(cut) >= SEVERAL
                or any(
                    run.first > 0 and (run.size >= LONG or run.missed() > FLAT * least)
                    for run in cut
                )
            ):
                # what stands alone at the extreme between two runs was cut as well
                most, alone = cut, [run for run in flats(at_end, 1) if run.value == extreme]
        if most:
            found.append(_fault(recording, side, most, alone))
    return found


def behind_filter(fault: Fault, recording: Recording, smoothing: Smoothing | None) -> Fault:
    """A fault of a recording, with what a filter's window made of clipped readings.

    Only where all of the window was cut are the readings alike: as many on either side as half of
    it hold cut ones too, besides those that any gap behind a filter loses.
    """
    if fault.id != "recording_clipped" or smoothing is None or smoothing.kind != "savgol":
        return fault
    reach, size = smoothing.window // 2, recording.samples.size
    spans = tuple((max(a - reach, 0), min(b + reach, size)) for a, b in fault.spans)
    return replace(fault, spans=spans, remedy=excluded(recording, spans))


def _fault(recording: Recording, side: str, cut: list[Flat], places: list[Flat]) -> Fault:
    x = recording.samples
    unit = max(reading_step(x), noise_level(x))
    extreme = cut[0].value
    spans = tuple((run.first, run.end) for run in places)
    hidden = max(run.missed() for run in cut)
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
