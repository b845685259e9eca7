"""A filter that nobody declared: proved by the noise spectrum, then part of the model like any
effect.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from bayesimpact.data.campaign import Campaign
from bayesimpact.diagnosis.location import Location
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import Identification
from bayesimpact.inference.noise.spectrum import Fingerprint, find_smoothing
from bayesimpact.model.effects import smoothing

LAG = f"{smoothing.EFFECT.id}.time_constant"
UNSURE = 0.1  # of a correlation of noise: three standard errors where 1,000 samples tell it

SAVITZKY_GOLAY = replace(
    smoothing.EFFECT,
    equation="the simulated signal passes the same filter",
    statement="The chain smoothed the recordings: {size}.",
    parameters=(),
    observe=None,
    size=None,
)


def proved_smoothing(campaign: Campaign) -> Fingerprint | None:
    """The filter that the recordings prove and campaign.toml does not declare, or None.

    Free decays only: the spectrum of an input may have gaps as well.
    """
    if campaign.measurement.smoothing is not None or campaign.measurement.unfiltered:
        return None
    free = [r for r in campaign.recordings if r.input is None]
    return find_smoothing(free) if free else None


def is_refuted(fit: Fit) -> bool:
    """Whether a fit has a lag that the noise of its recordings has not passed.

    A filter of the chain filters what noise comes before it: a lag of tau makes neighbouring
    samples' noise correlate by exp(-interval / tau). Without its mark on the noise a long lag is no
    filter, but what else changes a motion's phase, or its first instants.
    """
    names, noise = fit.names, fit.density.likelihood.noise
    if LAG not in names or noise.smoothing is not None:
        return False
    most = min(max(noise.correlation, 0.0) + UNSURE, 1.0 - 1e-9)
    longest = -float(fit.density.oscillator.intervals.min()) / float(np.log(most))
    return fit.value(LAG) > longest


def filter_words(filtered: Fingerprint) -> str:
    """The filter in words."""
    s = filtered.smoothing
    nulls = ", ".join(f"{f:.1f}" for f in filtered.nulls)
    return f"Savitzky-Golay over {s.window} samples, order {s.polyorder} (nulls at {nulls} Hz)"


def filter_parameters(filtered: Fingerprint) -> Mapping[str, Mapping[str, Any]]:
    """Window and order as parameters of diagnosis.json."""
    s = filtered.smoothing
    values = {"smoothing.window": s.window, "smoothing.order": s.polyorder}
    return {
        name: {"unit": "samples" if "window" in name else "1", "median": v, "ci90": [v, v]}
        for name, v in values.items()
    }


def whole_campaign(identification: Identification) -> Location:
    """The place of something in the measuring chain: all recordings, throughout."""
    fit = identification.fit
    campaign = fit.density.oscillator.campaign
    recorded = [r.samples for r in campaign.recordings]
    moved = recorded if fit.density.oscillator.reads_displacements else fit.displacements
    samples = np.concatenate(moved)
    pairs = zip(moved, campaign.recordings, strict=True)
    speed = max(float(np.max(np.abs(np.gradient(y, r.interval)))) for y, r in pairs)
    return Location(
        regime="measurement",
        share=1.0,
        displacement=(float(samples.min()), float(samples.max())),
        velocity=(-speed, speed),
        time=(0.0, max(r.duration for r in campaign.recordings)),
        recordings=tuple(r.name for r in campaign.recordings),
        cases=campaign.cases,
        force_rms=0.0,
        contact_share=0.0,
        agrees=True,
        gain=np.zeros((len(campaign.recordings), 1)),
    )
