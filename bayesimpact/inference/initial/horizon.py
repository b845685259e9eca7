"""Fits that begin with the beginning of the recordings and then take in ever more of them.

Over many cycles a small error of frequency adds up to whole cycles, and the misfit has a side
minimum for each: an ascent with the whole recordings ends in one of them. Over few cycles the
misfit is smooth, and what they tell brings the next, longer stretch within reach (Ribeiro, Tiels,
Umenberger, Schoen and Aguirre 2020, Automatica 121:109158, on the smoothness of the misfit over the
length of a simulation).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import Campaign
from bayesimpact.inference.fit import Fit, PosteriorDensity
from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.mode import find_mode
from bayesimpact.model.oscillator import Oscillator

Array = NDArray[np.float64]

CYCLES = 3.0  # of free vibration in the first stretch
ROUGHLY = 0.3  # standard deviations: last step of an ascent that only leads to the next one
SOON = 12  # iterations of such an ascent


def growing_horizon(
    density: PosteriorDensity,
    start: Array,
    *,
    steps: Array | None = None,
    fixed: Sequence[int] = (),
    tolerance: float = 1e-3,
    max_iterations: int = 60,
    goal: float = -np.inf,
) -> Fit:
    """Ascend from `start` (d,) to a mode by way of the modes for ever longer stretches.

    Parameters `fixed` stay where they start until the whole recordings count: what a short stretch
    does not tell, it should not move. Other arguments as for `find_mode`, of the last ascent.
    """
    theta = by_stretches(density, start, steps=steps, fixed=fixed)
    return find_mode(
        density, theta, steps=steps, tolerance=tolerance, max_iterations=max_iterations, goal=goal
    )


def by_stretches(
    density: PosteriorDensity,
    start: Array,
    *,
    steps: Array | None = None,
    fixed: Sequence[int] = (),
) -> Array:
    """Where the modes for ever longer stretches lead from `start` (d,); arguments as above."""
    theta = start
    k1 = float(start[density.oscillator.layout.index("k1")])
    for duration in stretches(density.oscillator.campaign, k1):
        there = find_mode(
            shortened(density, duration), theta,
            steps=steps, fixed=fixed, tolerance=ROUGHLY, max_iterations=SOON,
        )  # fmt: skip
        theta = there.mode if np.isfinite(there.log_posterior) else theta
    return theta


def best_ascent(
    density: PosteriorDensity, start: Array, *, steps: Array | None = None, max_iterations: int = 60
) -> Fit:
    """The mode over growing horizons or, where an input drives a recording, at once if better.

    The first stretch of an input may tell nothing, and a driven motion forgets how it began.
    """
    grown = growing_horizon(density, start, steps=steps, max_iterations=max_iterations)
    if density.oscillator.inputs is None:
        return grown
    direct = find_mode(density, start, steps=steps, max_iterations=max_iterations)
    return max(direct, grown, key=lambda fit: fit.log_posterior)


def stretches(campaign: Campaign, k1: float) -> list[float]:
    """Durations, s: a few cycles, doubled up to three quarters of the longest recording."""
    longest = max(r.duration for r in campaign.recordings)
    duration = CYCLES * 2 * np.pi / np.sqrt(k1 / campaign.mass)
    result = []
    while duration < 0.75 * longest:
        result.append(float(duration))
        duration *= 2
    return result


def shortened(density: PosteriorDensity, duration: float) -> PosteriorDensity:
    """The posterior that the first part of the recordings, s, leads to."""
    o = density.oscillator
    oscillator = Oscillator(o.campaign.truncated(duration), o.effects, o.layout, o.smoothing)
    return replace(density, likelihood=Likelihood(oscillator, density.likelihood.noise))
