"""A notice: readings in steps coarser than the noise, which then is the step's."""

from __future__ import annotations

from bayesimpact.data.faults.fault import Fault, amount, file_time
from bayesimpact.data.faults.flat import equal_share, reading_step
from bayesimpact.data.recording import Recording

COARSE = 0.2  # of neighbours equal: a step of about the noise's standard deviation and more


def find_quantised(recording: Recording) -> list[Fault]:
    """The step, where a fifth of all neighbours are equal because of it."""
    step, share = reading_step(recording.samples), equal_share(recording.samples)
    if step == 0.0 or share < COARSE:
        return []
    return [
        Fault(
            id="recording_quantised",
            recording=recording.name,
            spans=((0, recording.samples.size),),
            start_s=file_time(recording, 0),
            end_s=file_time(recording, recording.samples.size - 1),
            size=step,
            unit=recording.unit,
            statement=f"readings come in steps of {amount(step, recording.unit)}: noise of "
            f"{amount(step / 12**0.5, recording.unit)}",
            remedy="",
            strength=share,
            threshold=COARSE,
            action="notice",
        )
    ]
