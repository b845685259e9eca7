"""Recordings before a declared high-pass, as start values and the measured motion need them.

The filter loses a constant and nothing else: a signal is its reading and w times the integral of
that, up to a constant. But an offset of the reading is a line after it, and noise adds up. The
likelihood never sees this: it passes simulations through the filter.
"""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import numpy as np

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.recording import Recording
from bayesimpact.inference.initial.estimates import Estimates
from bayesimpact.response.measured_motion import before_high_pass


def campaign_before_high_pass(campaign: Campaign) -> Campaign:
    """The campaign as its probes saw it; itself where no recording came through a high-pass."""
    if not any(r.high_pass for r in campaign.recordings):
        return campaign
    recordings = tuple(before_high_pass(r, _rest(r)) for r in campaign.recordings)
    return replace(campaign, recordings=recordings)


def of_readings(estimates: Estimates, campaign: Campaign) -> Estimates:
    """Estimates from signals before their high-pass as those of a campaign's readings: the
    constant of a signal is what its filter had settled on.
    """
    passed = [r for r in campaign.recordings if r.high_pass]
    if not passed:
        return estimates
    states = {r.name: -estimates.offset[r.name] for r in passed}
    offsets = {**estimates.offset, **{r.name: _rest(r) for r in passed}}
    unknown = {
        f"{kind}[{r.name}]": np.inf for r in passed for kind in ("offset", "high_pass_state")
    }
    return replace(
        estimates,
        offset=MappingProxyType(offsets),
        high_pass_state=MappingProxyType(states),
        sd=MappingProxyType({**estimates.sd, **unknown}),
    )


def _rest(recording: Recording) -> float:
    """Mean of the second half of the readings, where the filter has settled best."""
    used = np.ones(recording.samples.size, dtype=np.bool_)
    used = used if recording.used is None else recording.used
    second = slice(recording.samples.size // 2, None)
    kept = recording.samples[second][used[second]]
    return float(np.mean(kept if kept.size else recording.samples))
