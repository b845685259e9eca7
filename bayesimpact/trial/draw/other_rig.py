"""A recording of another rig among those of one: its spring, damping or obstacle is another."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from bayesimpact.data.campaign import Campaign
from bayesimpact.trial.draw.designs import DrawnRig, log_uniform
from bayesimpact.trial.rig.recordings import Effects, Rig, record

OTHER_RIG = "other_rig"
SIZES = {"k1": (0.003, 0.15), "k2": (0.03, 0.5), "c1": (0.3, 3.0)}
"""By how much a parameter differs, of itself: from what a weak spring changes to another part."""


def another_rig(
    campaign: Campaign, design: DrawnRig, effects: Effects, rng: np.random.Generator
) -> tuple[Campaign, dict[str, Any]]:
    """The campaign with one release recorded on another rig, and the truth about it."""
    number = int(rng.integers(len(campaign.recordings)))
    one, release = campaign.recordings[number], design.releases[number]
    what = str(rng.choice(["k1", "k2", "c1"] if campaign.stop else ["k1", "c1"]))
    factor = 1.0 + log_uniform(rng, SIZES[what]) * (1.0 if what == "c1" else rng.choice([-1, 1]))
    samples = record(
        _changed(design.rig, what, release.case, factor),
        release,
        effects,
        design.chain,
        rate=design.rate,
        duration=design.duration,
        rng=rng,
        quantity=design.quantity,
    )
    recordings = list(campaign.recordings)
    recordings[number] = replace(one, samples=samples)
    truth = {
        "id": "recording_other_rig",
        "recording": one.name,
        "start_s": 0.0,
        "end_s": one.duration,
        "size": float(factor),
        "timed": False,
        "what": what,
    }
    return replace(campaign, recordings=tuple(recordings)), truth


def _changed(rig: Rig, what: str, case: str, factor: float) -> Rig:
    if what == "k2":
        return replace(rig, k2={**rig.k2, case: factor * rig.k2[case]})
    return replace(rig, **{what: factor * getattr(rig, what)})
