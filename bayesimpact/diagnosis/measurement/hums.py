"""Recordings less the steady hums that their spectra show.

A hum that is strong against the noise would be read as speed, and whatever is fitted beside it
leaves a large misfit: a search that knows nothing of it goes astray.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from bayesimpact.data.hum import Hum, find_hum, hum_at
from bayesimpact.data.recording import Recording
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.refitted import refitted


def recordings_without_hums(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """Recordings less the steady hums that their spectra show, if any.

    One that shows none may have the one that the others share. Driven motions may be steady lines
    themselves, and stay as they are.
    """
    hums = [None if r.input else find_hum(r.samples, r.interval) for r in recordings]
    told = [hum for hum in hums if hum is not None]
    shared = _shared(told, min(r.duration for r in recordings))
    found = list[Recording]()
    for recording, hum in zip(recordings, hums, strict=True):
        if hum is None and shared is not None and recording.input is None:
            hum = hum_at(recording.samples, recording.interval, shared)
        found.append(recording if hum is None else _less(recording, hum))
    return tuple(found)


def _shared(told: Sequence[Hum], shortest: float) -> Hum | None:
    """The middle one of hums of one frequency, as far as recordings of `shortest` s resolve it."""
    if not told:
        return None
    middle = sorted(told, key=lambda hum: hum.frequency)[len(told) // 2]
    same = [hum for hum in told if abs(hum.frequency - middle.frequency) * shortest < 1.0]
    return middle if len(same) == len(told) else None


def _less(recording: Recording, hum: Hum) -> Recording:
    return replace(recording, samples=recording.samples - hum.readings(recording.times))


def fit_without_hums(fit: Fit) -> Fit | None:
    """A model's mode for the recordings less their hums; None where they have none, or where more
    is left without them, as where a force moves a mass that meets a stop.
    """
    campaign = fit.density.oscillator.campaign
    recordings = recordings_without_hums(campaign.recordings)
    if all(a is b for a, b in zip(recordings, campaign.recordings, strict=True)):
        return None
    found = refitted(fit, replace(campaign, recordings=recordings))
    return found if found.reduced_chi2 < fit.reduced_chi2 else None
