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
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.faults.fault import Fault, gaussian_threshold
from bayesimpact.data.faults.find import applied
from bayesimpact.data.faults.local import robust_sd
from bayesimpact.data.faults.spikes import lone_spikes
from bayesimpact.data.gaps import Mask
from bayesimpact.diagnosis.selection.outcome import leaves_something
from bayesimpact.diagnosis.thresholds import LARGE
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.onsets import without_onsets
from bayesimpact.inference.refitted import refitted

Array = NDArray[np.float64]

WIDE = 11  # samples of a running median: spikes of five do not show in it
HALF_WITHIN = 0.6745  # standard deviations of Gaussian noise


def residual_spikes(fit: Fit, *, contacts: bool = True) -> tuple[Fault, ...]:
    """Spikes in the residuals of a fit; samples that are set aside count as missed by as much as
    those beside them: a fit that misses all by a slow error misses none there by a spike.

    contacts : whether the fit may have missed brief ones; where it has not, accelerations at the
        onsets that it shows count as fitted too: they lie on one side of a jump or the other
    """
    found: list[Fault] = []
    campaign = fit.density.oscillator.campaign
    counted = campaign if contacts else without_onsets(fit)
    rows = zip(campaign.recordings, counted.recordings, fit.residuals, strict=True)
    for recording, other, residual in rows:
        kept = residual if recording.used is None else _bridged(residual, recording.used)
        if other is not recording and other.used is not None:
            at_onset = ~other.used if recording.used is None else recording.used & ~other.used
            kept = np.where(at_onset, 0.0, kept)
        missed = replace(recording, samples=kept)
        found += lone_spikes(missed, contacts=contacts, residual=True)
    return tuple(found)


def _bridged(residual: Array, used: Mask) -> Array:
    """A residual (n,) that follows the median of what is used near by across what is not: one bad
    reading beside it does not count.
    """
    place = np.arange(residual.size)
    slow = median_filter(residual[used], WIDE, mode="nearest")
    return np.where(used, residual, np.interp(place, place[used], slow))


def beside_spikes(fit: Fit) -> tuple[tuple[Fault, ...], Fit] | None:
    """Spikes of a fit, and the model's mode without them, where that leaves no more than noise: a
    contact that the model missed would have moved all that comes after it.

    What the mode without them explains is none: it is counted again, from that mode.
    """
    campaign = fit.density.oscillator.campaign
    if campaign.keep_faults or _misses_most(fit):
        return None
    spikes = residual_spikes(fit, contacts=False)
    clean = refitted(fit, faults_set_aside(campaign, spikes)) if spikes else fit
    if not spikes or leaves_something(clean):
        return None
    lasting = _still_off(campaign, clean, spikes)
    if len(lasting) < len(spikes):
        counted = faults_set_aside(campaign, lasting) if lasting else campaign
        clean = refitted(fit, counted, start=clean)
    return lasting, clean


def _misses_most(fit: Fit) -> bool:
    """Whether half of the readings are missed by more than a large misfit would: no fit is needed
    to see that spikes are not all.
    """
    noise, found = fit.density.likelihood.noise, list[Array]()
    recordings = fit.density.oscillator.campaign.recordings
    for recording, residual in zip(recordings, fit.residuals, strict=True):
        kept = residual if recording.used is None else residual[recording.used]
        found.append(np.abs(kept) / (noise.level * noise.scales[recording.order]))
    return bool(np.median(np.concatenate(found)) > LARGE * HALF_WITHIN)


def _still_off(campaign: Campaign, clean: Fit, faults: Sequence[Fault]) -> tuple[Fault, ...]:
    """Those faults of a campaign with a reading that the fit without all of them misses as well."""
    kept = list[Fault]()
    rows = zip(campaign.recordings, clean.predicted, clean.residuals, strict=True)
    for recording, predicted, residual in rows:
        missed = np.abs(recording.samples - predicted)
        least = gaussian_threshold(missed.size) * robust_sd(residual)
        own = (fault for fault in faults if fault.recording == recording.name)
        kept += [f for f in own if max(missed[a:b].max() for a, b in f.spans) > least]
    return tuple(kept)


def faults_set_aside(campaign: Campaign, faults: Sequence[Fault]) -> Campaign:
    """The campaign with these faults set aside."""
    recordings = []
    for recording in campaign.recordings:
        own = [f for f in faults if f.recording == recording.name]
        recordings.append(applied(recording, own)[0] if own else recording)
    notes = tuple(f"{f.recording}, {f.statement}" for f in faults)
    return replace(campaign, recordings=tuple(recordings), notes=(*campaign.notes, *notes))
