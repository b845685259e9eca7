"""Recordings less the steady hums that their spectra show.

A hum that is strong against the noise would be read as speed, and whatever is fitted beside it
leaves a large misfit: a search that knows nothing of it goes astray.
"""

from __future__ import annotations

from dataclasses import replace

from bayesimpact.data.hum import find_hum
from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.faults.outliers import refitted
from bayesimpact.inference.fit import Fit


def without_hum(recording: Recording) -> Recording:
    """A recording less the steady hum that its spectrum shows, if any; a driven one may move so."""
    driven = recording.input is not None
    hum = None if driven else find_hum(recording.samples, recording.interval)
    if hum is None:
        return recording
    return replace(recording, samples=recording.samples - hum.readings(recording.times))


def without_hums(fit: Fit) -> Fit | None:
    """A model's mode for the recordings less their hums; None where they have none, or where more
    is left without them, as where a force moves a mass that meets a stop.
    """
    campaign = fit.target.oscillator.campaign
    quiet = tuple(map(without_hum, campaign.recordings))
    if all(a is b for a, b in zip(quiet, campaign.recordings, strict=True)):
        return None
    found = refitted(fit, replace(campaign, recordings=quiet))
    return found if found.reduced_chi2 < fit.reduced_chi2 else None
