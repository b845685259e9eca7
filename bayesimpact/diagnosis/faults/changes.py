"""What changes in mid-record: the gain of the probe, or by knocks the state of the motion.

A gain that changes takes one unknown, a knock two. Without a stop the readings of a linear
oscillator after a knock are nearly as much larger ones where the blow fell near the rest position,
so that both are asked, and what is told is the gain unless knocks leave `EXCESS` times less.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from bayesimpact.data.campaign import Campaign
from bayesimpact.diagnosis.faults.compare import Compared
from bayesimpact.diagnosis.faults.gain_step import gain_step_beside
from bayesimpact.diagnosis.faults.knock import knocks_beside
from bayesimpact.diagnosis.faults.recording_faults import Step, fault_as_read
from bayesimpact.diagnosis.selection.outcome import above_noise
from bayesimpact.diagnosis.thresholds import EXCESS
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.refitted import refitted

DIFFER = ("recording_other_rig", "recording_gain", "recording_clock")
"""Faults of a whole recording that differs, as one does of which the second half is another one."""


def changes_beside(base: Fit, found: Fit) -> tuple[tuple[Compared, ...], Fit, Fit] | None:
    """The change of a gain or the knocks that explain what a model leaves; the base model's and the
    model's mode of the recordings with the one corrected, or without what lies beyond the others.
    None where neither does.
    """
    gain, knocks = gain_step_beside(found), knocks_beside(base, found)
    if gain is None:
        return knocks
    compared, first = gain
    if knocks is not None:
        left = above_noise(first, compared.after)
        if left >= EXCESS * above_noise(knocks[2], knocks[0][-1].after):
            return knocks
    plain = first if found is base else refitted(base, compared.campaign)
    return (compared,), plain, first


def change_instead(steps: Sequence[Step], base: Fit, found: Fit, as_read: Campaign) -> Step:
    """The changes in mid-record that, beside a model, explain why a recording differs from the
    others; () where none do, or no step says that one differs.
    """
    differing = {one.fault.recording for step in steps for one in step if one.fault.id in DIFFER}
    told = changes_beside(base, found) if differing else None
    if told is None or differing.isdisjoint(one.fault.recording for one in told[0]):
        return ()
    before = [found.density.oscillator.campaign, *(one.campaign for one in told[0])]
    return tuple(
        replace(one, fault=fault_as_read(one.fault, campaign, as_read))
        for one, campaign in zip(told[0], before, strict=False)
    )
