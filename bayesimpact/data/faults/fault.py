"""What every detector hands back: a fault with its place, its size and the remedy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.recording import Recording

Array = NDArray[np.float64]
Span = tuple[int, int]
Action = Literal["exclude", "cut", "skip", "notice"]

NOT_FREE = "the motion is not yet free {time}"

FALSE_ALARM = 1e-6
"""Chance per recording that a detector errs on stationary Gaussian noise.

Thresholds in standard deviations follow from it and the number of samples. What motion leaves in a
statistic is no Gaussian; each detector says how it guards against that, and the controls of the
blind trials measure the whole.
"""


@dataclass(frozen=True)
class Fault:
    """A fault of one recording.

    Attributes
    ----------
    id : of the family `recording`
    recording : its name
    spans : first and last-plus-one sample of every place, in the recording as it was read
    start_s, end_s : from the first to the last place, s on the file's own clock
    size, unit : how large
    error : standard error of the size, in its unit; 0 where it is counted or not known
    statement : one sentence for a report
    remedy : the line of campaign.toml that deals with it; "" for a notice
    strength, threshold : test statistic, and the value from which on it counts
    false_alarm : chance per recording of that value without the fault
    action : exclude the spans, cut them off an end, skip the recording, or nothing (a notice)
    """

    id: str
    recording: str
    spans: tuple[Span, ...]
    start_s: float
    end_s: float
    size: float
    unit: str
    statement: str
    remedy: str
    strength: float
    threshold: float
    action: Action = "exclude"
    false_alarm: float = FALSE_ALARM
    error: float = 0.0


def fault_document(fault: Fault) -> dict[str, Any]:
    """A fault as a JSON object: what scripts and scores read."""
    return {
        "id": fault.id,
        "recording": fault.recording,
        "start_s": float(fault.start_s),
        "end_s": float(fault.end_s),
        "samples": [[int(first), int(end)] for first, end in fault.spans],
        "size": float(fault.size) if np.isfinite(fault.size) else None,
        "unit": fault.unit,
        "statement": fault.statement,
        "remedy": fault.remedy,
        "strength": float(fault.strength) if np.isfinite(fault.strength) else None,
        "threshold": float(fault.threshold),
    }


def gaussian_threshold(count: int) -> float:
    """Standard deviations that `count` Gaussian numbers exceed with probability `FALSE_ALARM`."""
    from scipy.stats import norm

    return float(norm.isf(0.5 * FALSE_ALARM / max(count, 1)))


def file_time(recording: Recording, sample: float) -> float:
    """Time of a sample (or of a place between two) on the file's own clock, s."""
    return recording.start + sample * recording.interval


def start_fault(
    recording: Recording, first: int, strength: float, threshold: float, words: str = NOT_FREE
) -> Fault:
    """A start that is no free motion: readings before `first`, to be cut. In the `words` stand
    {seconds} for how long it is, or {time} for the first so many seconds and samples.
    """
    seconds = f"{first * recording.interval:.3g} s"
    time = f"for the first {seconds} ({first} samples)"
    return Fault(
        id="recording_start",
        recording=recording.name,
        spans=((0, first),),
        start_s=file_time(recording, 0),
        end_s=file_time(recording, first - 1),
        size=first * recording.interval,
        unit="s",
        statement=words.format(seconds=seconds, time=time),
        remedy=f"start_s = {file_time(recording, first - 0.4):.9g}",
        strength=strength,
        threshold=threshold,
        action="cut",
    )


def times_of(recording: Recording, spans: Sequence[Span]) -> str:
    """The times of places in words, the first few one by one."""
    named = [f"{file_time(recording, first):.6g} s" for first, _ in spans[:4]]
    more = f" and {len(spans) - 4} more" if len(spans) > 4 else ""
    return ", ".join(named) + more


def amount(value: float, unit: str) -> str:
    """A displacement in um or mm, an angle in degrees, other readings in their SI unit."""
    if unit == "rad":
        return f"{np.degrees(value):.3g} degrees"
    if unit != "m":
        return f"{value:.3g} {unit}"
    return f"{value * 1e3:.3g} mm" if abs(value) >= 1e-4 else f"{value * 1e6:.3g} um"
