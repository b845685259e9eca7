"""Fits that begin with the beginning of the recordings and then take in ever more of them.

Over many swings a small error of frequency adds up to whole cycles, and the misfit has a side
minimum for each: a climb with the whole recordings ends in one of them. Over few swings the misfit
is smooth, and what they tell brings the next, longer stretch within reach (Ribeiro, Tiels,
Umenberger, Schoen and Aguirre 2020, Automatica 121:109158, on the smoothness of the misfit over the
length of a simulation).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.recording import Recording
from bayesimpact.inference.fit import Fit, Target
from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.mode import find_mode
from bayesimpact.model.oscillator import build_oscillator
from bayesimpact.response.swings import rough_period

Array = NDArray[np.float64]

SHORTEST = 2.0  # periods of the first stretch
FEWEST = 40  # samples of it
GROWTH = 2.0  # of a stretch over the one before
ROUGHLY = 0.3  # standard deviations: last step of a climb that only leads to the next one
SOON = 12  # iterations of such a climb


def growing_horizon(
    target: Target,
    start: Array,
    *,
    steps: Array | None = None,
    held: Sequence[int] = (),
    tolerance: float = 1e-3,
    max_iterations: int = 60,
) -> Fit:
    """Climb from `start` (d,) to a mode by way of the modes for ever longer stretches.

    Parameters `held` stay where they start until the whole recordings count: what a short stretch
    does not tell, it should not move. Other arguments as for `find_mode`.
    """
    theta = start
    for share in stretches(target):
        there = find_mode(
            shortened(target, share), theta,
            steps=steps, held=held, tolerance=ROUGHLY, max_iterations=SOON,
        )  # fmt: skip
        theta = there.mode if np.isfinite(there.log_posterior) else theta
    return find_mode(target, theta, steps=steps, tolerance=tolerance, max_iterations=max_iterations)


def stretches(target: Target) -> list[float]:
    """Shares of the recordings that the climbs before the last one take, growing."""
    recordings = target.oscillator.campaign.recordings
    shortest = max(
        max(SHORTEST * rough_period(r.samples), FEWEST) / r.samples.size for r in recordings
    )
    count = max(0, int(np.log(1.0 / shortest) / np.log(GROWTH)))
    return [GROWTH**-k for k in range(count, 0, -1)]


def shortened(target: Target, share: float) -> Target:
    """The posterior that the first part of every recording leads to."""
    o = target.oscillator
    recordings = tuple(_beginning(r, share) for r in o.campaign.recordings)
    oscillator = build_oscillator(
        replace(o.campaign, recordings=recordings),
        o.effects,
        smoothing=o.smoothing,
        sigma_per_recording=o.layout.roles("noise").size > 1,
    )
    return replace(target, likelihood=Likelihood(oscillator, target.likelihood.noise))


def _beginning(recording: Recording, share: float) -> Recording:
    return replace(recording, samples=recording.samples[: int(share * recording.samples.size)])
