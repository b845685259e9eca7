"""The small rig with two channels on every release: a probe and an accelerometer."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import small_rig

from bayesimpact.data.campaign import Campaign
from bayesimpact.trial.rig.measuring_chain import MeasuringChain
from bayesimpact.trial.rig.recordings import Effects

LEVELS: dict[Any, float] = {"displacement": 5e-6, "acceleration": 1e-2}
RATES = {"displacement": 1000.0, "acceleration": 800.0}


def channels(seed: int, effects: Effects | None = None) -> Campaign:
    """Three releases: recordings a, b, c of the probe, then a_acc, ... of another sampling rate."""
    rng, found = np.random.default_rng(seed), []
    for quantity, level in LEVELS.items():
        campaign = small_rig.record(
            effects=effects, chain=MeasuringChain(), quantity=quantity, rate=RATES[quantity]
        )
        for r in campaign.recordings:
            samples = r.samples + level * rng.standard_normal(r.samples.size)
            name = r.name if quantity == "displacement" else f"{r.name}_acc"
            found.append(replace(r, name=name, samples=samples, motion_name=r.name))
    return replace(campaign, recordings=tuple(found))
