"""Start values where recordings came through a stated high-pass: from what came into it."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import numpy as np

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.high_pass import as_it_came, settled_reading
from bayesimpact.inference.initial.estimates import Estimates


def campaign_before_high_pass(campaign: Campaign) -> Campaign:
    """The campaign as its probes saw it; itself where no recording came through a high-pass."""
    if not any(r.high_pass for r in campaign.recordings):
        return campaign
    recordings = tuple(as_it_came(r) for r in campaign.recordings)
    return replace(campaign, recordings=recordings)


def of_readings(estimates: Estimates, campaign: Campaign) -> Estimates:
    """Estimates from signals before their high-pass as those of a campaign's readings: the
    constant of a signal is what its filter had settled on.
    """
    passed = [r for r in campaign.recordings if r.high_pass]
    if not passed:
        return estimates
    states = {r.name: -estimates.offset[r.name] for r in passed}
    offsets = {**estimates.offset, **{r.name: settled_reading(r) for r in passed}}
    unknown = {
        f"{kind}[{r.name}]": np.inf for r in passed for kind in ("offset", "high_pass_state")
    }
    return replace(
        estimates,
        offset=MappingProxyType(offsets),
        high_pass_state=MappingProxyType(states),
        sd=MappingProxyType({**estimates.sd, **unknown}),
    )
