"""Rough values of all parameters where more acts on the oscillator than a stop on one side.

They need no model of the contact: the longest half cycle tells the stiffness of the suspension, the
decay of the turning points the damping, the end of a recording its reading at rest, the first
samples its start. A stop is taken half as far away as the motion reaches, and as stiff as the
shortest half cycle asks for.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import SECOND_STOP, Campaign
from bayesimpact.data.gaps import before_gap
from bayesimpact.data.recording import Recording
from bayesimpact.errors import InputError
from bayesimpact.inference.initial.estimates import Estimates, estimate
from bayesimpact.response import local
from bayesimpact.response.displacement import displacement_of
from bayesimpact.response.half_cycles import HalfCycles, half_cycles, spectral_period

Floats = NDArray[np.float64]

LAST = 3.0  # rough periods at the end of a recording: their mean is the reading at rest
START = 0.06  # of a rough period: so long is the motion a parabola


def rough_estimates(campaign: Campaign) -> Estimates:
    """Estimates without standard errors; where an input drives, those of a stop on one side.

    Raises
    ------
    InputError : the recordings show no oscillation above the noise
    """
    if any(r.input is not None for r in campaign.recordings):
        return estimate(campaign)
    campaign = replace(campaign, recordings=tuple(map(before_gap, campaign.recordings)))
    both = SECOND_STOP in campaign.declared
    seen = [_seen(r, both) for r in campaign.recordings]
    seconds = np.concatenate([one.halves.durations * one.interval for one in seen])
    if seconds.size < 3:
        found = "no oscillation above the noise"
        raise InputError(f"campaign {campaign.name!r}", found, "decays of two periods or more")
    mass = campaign.mass
    longest, shortest = (float(np.quantile(seconds, q)) for q in (0.98, 0.02))
    k1 = mass * (np.pi / longest) ** 2
    stiffest = max(mass * (np.pi / shortest) ** 2 - k1, 0.1 * k1)
    rates = [_decay(one.halves) / one.interval for one in seen]
    c1 = max(2 * mass * float(np.median(rates)), 1e-4 * float(np.sqrt(k1 * mass)))
    starts = {
        one.name: first_state(one.samples, one.interval, spectral_period(one.samples))
        for one in seen
    }
    highest = max(float(one.samples.max()) for one in seen)
    estimates = Estimates(
        k1=k1,
        c1=c1,
        g=0.5 * highest if campaign.stop else float("inf"),
        c2=c1 if campaign.stop else 0.0,
        k2=MappingProxyType({case: stiffest for case in campaign.cases}),
        offset=MappingProxyType({one.name: one.offset for one in seen}),
        y0=MappingProxyType({name: start[0] for name, start in starts.items()}),
        v0=MappingProxyType({name: start[1] for name, start in starts.items()}),
        noise=MappingProxyType({one.name: one.noise for one in seen}),
        sd=MappingProxyType({}),
        impacts=MappingProxyType({r.name: 1 for r in campaign.recordings}),
    )
    return estimates.with_unknown_errors()


@dataclass(frozen=True, eq=False)
class _Seen:
    """A recording as a displacement about its reading at rest.

    Attributes
    ----------
    samples : (n,) m
    offset, noise : at rest, and standard deviation of the noise, in the reading's unit
    """

    name: str
    interval: float
    samples: Floats
    offset: float
    noise: float
    halves: HalfCycles


def _seen(recording: Recording, both: bool) -> _Seen:
    found = displacement_of(recording, both=both)
    period = spectral_period(found.samples)
    rest = _rest(found.samples, period)
    samples = found.samples - rest
    level = local.noise_level(samples, period)
    halves = half_cycles(samples, 0.0, period, level)
    offset = rest if found.bias is None else found.bias
    return _Seen(recording.name, recording.interval, samples, offset, found.noise, halves)


def _rest(samples: Floats, period: float) -> float:
    """Middle of the last cycles: half way between the means of their two turning points."""
    last = samples[-max(int(LAST * period), 8) :]
    return float(0.5 * (np.quantile(last, 0.95) + np.quantile(last, 0.05)))


def _decay(halves: HalfCycles) -> float:
    """Rate at which the turning points decay, per sample."""
    if halves.amplitudes.size < 3:
        return 0.0
    slope = np.polyfit(halves.peaks, np.log(halves.amplitudes), 1)[0]
    return float(max(-slope, 0.0))


def first_state(samples: Floats, interval: float, period: float) -> tuple[float, float]:
    """Displacement and velocity at the first of `samples` (n,), from a parabola.

    `period` of the motion is in samples.
    """
    count = max(int(START * period), 5)
    fit = np.polynomial.Polynomial.fit(interval * np.arange(count), samples[:count], 2)
    return float(fit(0.0)), float(fit.deriv()(0.0))
