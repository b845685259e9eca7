"""Another end for a base fit that misses its recordings by far: by way of periods ahead.

Where strong physics is missing, a simulation of a whole recording is soon out of step, its
posterior has a side minimum for every cycle, and the best of these may have no stop at all. Periods
ahead (`multiple_shooting`) stay in step: their mode lies near the base parameters' own whatever is
missing, and from there the ascent over the whole recordings begins again.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayesimpact.inference.fit import Fit
from bayesimpact.inference.initial.multiple_shooting import Array, multiple_shooting
from bayesimpact.inference.mode import find_mode
from bayesimpact.model.parameters import SLOTS
from bayesimpact.response.displacement import displacement_of
from bayesimpact.response.measured_motion import from_rest

_G, _OFFSET = SLOTS.index("g"), SLOTS.index("offset")
FAR = 0.2  # of the signal: a base fit that leaves more is tried again; set by hand
SHARE = 0.5  # of the largest displacement towards the stop: another gap to begin with
STIFFER = 4.0  # than the suspension: an obstacle to begin with
ROUNDS = 2  # of ascents: the first one's rest readings place the starts of the second
ITERATIONS = 15
STEP = 1e-6  # of a parameter, for differences


def or_by_periods(found: Fit) -> Fit:
    """The likelier of a fit with a stop and the ends that periods ahead lead to, where it leaves
    more than `FAR`.
    """
    o = found.density.oscillator
    if not o.campaign.stop or found.rms <= FAR * found.signal:
        return found
    ends = [found]
    for start in _starts(found):
        theta = _ahead(found, start)
        if theta is not None:
            steps = None if o.is_base and not o.sensors else _steps(theta)
            ends.append(find_mode(found.density, theta, steps=steps))
    return max(ends, key=lambda fit: np.nan_to_num(fit.log_posterior, nan=-np.inf))


def _starts(found: Fit) -> list[Array]:
    """The mode, and one with a gap that is reached and obstacles that are felt."""
    o, theta = found.density.oscillator, found.mode.copy()
    gaps = np.unique(o.layout.columns[:, _G])
    theta[gaps[gaps >= 0]] = SHARE * max(_reach(found, r) for r in range(o.counts.size))
    for case in o.campaign.cases:
        i = o.layout.index(f"k2[{case}]")
        theta[i] = max(theta[i], STIFFER * found.value("k1"))
    return [found.mode, theta]


def _reach(found: Fit, r: int) -> float:
    """Largest displacement of a recording from rest towards the stop, m."""
    o = found.density.oscillator
    recording, gain = o.campaign.recordings[r], o.gains[r]
    offset = float(o.layout.slots(found.mode)[r, _OFFSET])
    own = float(found.mode[gain]) if gain >= 0 else 1.0
    state = o.settled_on(r, found.mode)
    moved = displacement_of(from_rest(recording, offset, own or 1.0, state)).samples
    used = slice(None) if recording.used is None else recording.used
    return float(np.max(moved[used]))


def _ahead(found: Fit, theta: Array) -> Array | None:
    """The mode of periods ahead from a start; None where no period is told, or it is lost."""
    for _ in range(ROUNDS):
        ahead = multiple_shooting(found.density.likelihood, theta)
        if ahead is None:
            return None
        density = replace(found.density, likelihood=ahead)
        theta = find_mode(density, theta, steps=_steps(theta), max_iterations=ITERATIONS).mode
        if not np.isfinite(theta).all():
            return None
    return theta


def _steps(theta: Array) -> Array:
    return np.maximum(STEP * np.abs(theta), 1e-9)
