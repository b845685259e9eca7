"""Accelerations at the very instant of a contact's onset or end are set aside.

A contact with damping begins and ends with a jump of the acceleration, c2 v / m. Which side of it a
sample beside it takes turns on a shift of the motion far below its standard deviation, so the
likelihood would have a step of many nats there, which no derivative knows of; and no accelerometer
is fast enough to show such a jump. Without the one sample next to it an event may move by half a
sampling interval before it reaches another, and the likelihood is smooth. Displacements and
velocities do not jump. Behind a declared filter there is no single sample to set aside.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.recording import Recording
from bayesimpact.inference.fit import Fit
from bayesimpact.model.parameters import SLOTS

Array = NDArray[np.float64]
_GAP = SLOTS.index("g")


def without_onsets(fit: Fit) -> Campaign:
    """The fit's campaign without the accelerations at the contacts that the fit shows.

    The same object where there are none, or where a filter smears them.
    """
    oscillator = fit.density.oscillator
    campaign = oscillator.campaign
    if not (campaign.stop and np.any(oscillator.orders == 2)) or oscillator.smoothing is not None:
        return campaign
    gaps = oscillator.layout.slots(fit.mode)[:, _GAP]
    rows = zip(campaign.recordings, oscillator.displacements(fit.mode), gaps, strict=True)
    kept = tuple(_without(r, y - g) if r.order == 2 else r for r, y, g in rows)
    count = sum(r.count for r in campaign.recordings) - sum(r.count for r in kept)
    if count == 0:
        return campaign
    note = f"{count} accelerations at the instant at which a contact begins or ends are set aside"
    return replace(campaign, recordings=kept, notes=(*campaign.notes, note))


def _without(recording: Recording, depth: Array) -> Recording:
    """Without the samples next to where `depth` (n,), m, beyond the gap changes sign."""
    before = np.flatnonzero((depth[:-1] < 0) != (depth[1:] < 0))
    share = depth[before] / (depth[before] - depth[before + 1])
    used = np.ones(depth.size, dtype=bool) if recording.used is None else recording.used.copy()
    used[before + (share > 0.5)] = False
    return replace(recording, used=used)
