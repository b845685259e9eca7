"""The campaign with a fault of one recording corrected, and the fault in words."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.faults.fault import Action, Fault, file_time
from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.faults.alone import inverted
from bayesimpact.diagnosis.faults.together import Weighed
from bayesimpact.model.units import decimals, number, signed

UNITS = (1e-6, 1e-3, 1e3, 1e6)
NEAR = 0.05  # of a power of a thousand, in the logarithm: a unit, not a gain


def corrected(campaign: Campaign, number: int, found: Weighed) -> Campaign:
    """The campaign with the recording's gain, clock or label put right; without another rig's."""
    recordings = list(campaign.recordings)
    one = recordings[number]
    kind = found.hypothesis.id
    if kind == "recording_other_rig":
        del recordings[number]
    elif kind == "recording_gain":
        recordings[number] = replace(one, samples=one.samples * factor(found))
    elif kind == "recording_clock":
        recordings[number] = replace(one, interval=one.interval * ratio(found))
    elif kind == "recording_reversed":
        recordings[number] = inverted(one)
    elif found.hypothesis.case is not None:
        recordings[number] = replace(one, case=found.hypothesis.case)
    return replace(campaign, recordings=tuple(recordings))


def factor(found: Weighed) -> float:
    """What the readings have to be multiplied by: a power of a thousand where one is near."""
    value = float(np.exp(-found.value))
    near = [unit for unit in UNITS if abs(np.log(value / unit)) < NEAR]
    return near[0] if near else value


def ratio(found: Weighed) -> float:
    """True time over the file's time."""
    return float(np.exp(-found.value))


def as_fault(recording: Recording, found: Weighed, gain: float, threshold: float) -> Fault:
    """The fault as a record; `gain` is the log odds that it needs `threshold` of."""
    words, remedy, size, unit = _words(found)
    action: Action = "skip" if found.hypothesis.id == "recording_other_rig" else "notice"
    return Fault(
        id=found.hypothesis.id,
        recording=recording.name,
        spans=((0, recording.samples.size),),
        start_s=file_time(recording, 0),
        end_s=file_time(recording, recording.samples.size - 1),
        size=size,
        unit=unit,
        statement=words,
        remedy=remedy,
        strength=gain,
        threshold=threshold,
        action=action,
        false_alarm=float(np.exp(-threshold)),
        error=(100 + size) * found.sd if unit == "%" else 0.0,  # sd is of the logarithm
    )


def _words(found: Weighed) -> tuple[str, str, float, str]:
    """Sentence, line of campaign.toml, size and its unit."""
    kind, sd = found.hypothesis.id, found.sd
    if kind == "recording_reversed":
        return "recorded with the other sign", "invert = true", -1.0, "-"
    if kind == "recording_case":
        case = found.hypothesis.case
        return f"shows the obstacle of case {case}", f'case = "{case}"', float("nan"), "-"
    if kind == "recording_gain":
        by = factor(found)
        if by in UNITS:
            return (
                f"its unit is off: readings {1 / by:g} times too large",
                f"scale = {by:g}",
                by,
                "-",
            )
        words = (
            f"its readings are {percent_off(1 / by - 1, sd)} off those of the others: the gain of "
            "the probe, or a gap of its own by as much, which one recording cannot tell apart"
        )
        return words, f"scale = {by:.6g}", 100 * (1 / by - 1), "%"
    if kind == "recording_clock":
        by = ratio(found)
        words = f"its clock runs {percent_off(1 / by - 1, sd)} off the others'"
        return words, f"clock_ratio = {by:.8g}", 100 * (1 / by - 1), "%"
    off = 100 * float(np.expm1(found.value))
    what = found.hypothesis.what
    return (
        f"comes from another rig: its {what} is {percent_off(0.01 * off, sd)} off the others'",
        f'skip = "another rig: {what} {off:+.3g} %"',
        off,
        "%",
    )


def percent_off(part: float, sd: float) -> str:
    """A difference in per cent with its standard error, to two digits of this."""
    places = decimals(100 * sd, 2)
    return f"{signed(100 * part, places)} % ± {number(100 * sd, places)} %"
