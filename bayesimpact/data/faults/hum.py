"""`recording_hum`: a steady line of the spectrum, as the mains put into a cable; told, kept in.

A diagnosis weighs it as `sensor_hum` (in the readings) against `harmonic_forcing` (of the mass).
"""

from __future__ import annotations

from bayesimpact.data.faults.fault import FALSE_ALARM, Fault, amount, file_time
from bayesimpact.data.hum import find_hum
from bayesimpact.data.recording import Recording


def find_hum_notice(recording: Recording) -> list[Fault]:
    """The steady line that stands out most beside the motion's own."""
    hum = find_hum(recording.samples, recording.interval)
    if hum is None:
        return []
    end = recording.samples.size
    return [
        Fault(
            id="recording_hum",
            recording=recording.name,
            spans=((0, end),),
            start_s=file_time(recording, 0),
            end_s=file_time(recording, end - 1),
            size=hum.amplitude,
            unit=recording.unit,
            statement=f"a steady line of {hum.frequency:.4g} Hz, "
            f"{amount(hum.amplitude, recording.unit)}, through the whole recording: a hum in the "
            "readings, or of a force or a mode that hardly decays",
            remedy="",
            strength=hum.strength,
            threshold=hum.threshold,
            action="notice",
            false_alarm=FALSE_ALARM,
        )
    ]
