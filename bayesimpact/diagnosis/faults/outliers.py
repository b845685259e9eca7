"""Spikes that only show against the fit: few readings far off, at a contact that hides them.

Near an impact neither side foretells a reading, so that `data.faults.spikes` must be silent there.
In the residual of a fit there are no impacts, unless the model is wrong: what it leaves of a brief
contact then looks like a spike, but comes back with every period, for which `lone_spikes` allows
and `data.faults.bursts` does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.faults.fault import Fault
from bayesimpact.data.faults.find import applied
from bayesimpact.data.faults.spikes import lone_spikes
from bayesimpact.inference.fit import Fit


def residual_spikes(fit: Fit) -> tuple[Fault, ...]:
    """Spikes in the residuals of a fit; samples that are set aside count as fitted."""
    found: list[Fault] = []
    recordings = fit.target.oscillator.campaign.recordings
    for recording, residual in zip(recordings, fit.residuals, strict=True):
        kept = residual if recording.used is None else np.where(recording.used, residual, 0.0)
        found += lone_spikes(replace(recording, samples=kept))
    return tuple(found)


def faults_set_aside(campaign: Campaign, faults: Sequence[Fault]) -> Campaign:
    """The campaign with these faults set aside."""
    recordings = []
    for recording in campaign.recordings:
        own = [f for f in faults if f.recording == recording.name]
        recordings.append(applied(recording, own)[0] if own else recording)
    notes = tuple(f"{f.recording}, {f.statement}" for f in faults)
    return replace(campaign, recordings=tuple(recordings), notes=(*campaign.notes, *notes))
