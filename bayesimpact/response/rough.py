"""Rough values of all parameters where more acts on the oscillator than a stop on one side.

They need no model of the contact: the longest half swing tells the stiffness of the suspension, the
decay of the turning points the damping, the end of a recording its reading at rest, the first
samples its start. A stop is taken half as far away as the motion reaches, and as stiff as the
shortest half swing asks for.
"""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.gaps import before_gap
from bayesimpact.data.recording import Recording
from bayesimpact.errors import InputError
from bayesimpact.response import local
from bayesimpact.response.estimates import Estimates
from bayesimpact.response.half_cycles import HalfCycles, half_cycles, rough_period

Floats = NDArray[np.float64]

LAST = 3.0  # rough periods at the end of a recording: their mean is the reading at rest
START = 0.06  # of a rough period: so long is the motion a parabola


def rough_estimates(campaign: Campaign) -> Estimates:
    """Estimates without standard errors from free decays of a displacement or an angle.

    Raises
    ------
    InputError : the recordings show no oscillation above the noise
    """
    campaign = replace(campaign, recordings=tuple(map(before_gap, campaign.recordings)))
    swings = [_half_cycles(r) for r in campaign.recordings]
    seconds = np.concatenate(
        [s.durations * r.interval for s, r in zip(swings, campaign.recordings, strict=True)]
    )
    if seconds.size < 3:
        found = "no oscillation above the noise"
        raise InputError(f"campaign {campaign.name!r}", found, "decays of two periods or more")
    mass = campaign.mass
    longest, shortest = (float(np.quantile(seconds, q)) for q in (0.98, 0.02))
    k1 = mass * (np.pi / longest) ** 2
    stiffest = max(mass * (np.pi / shortest) ** 2 - k1, 0.1 * k1)
    rates = [_decay(s) / r.interval for s, r in zip(swings, campaign.recordings, strict=True)]
    c1 = max(2 * mass * float(np.median(rates)), 1e-4 * float(np.sqrt(k1 * mass)))
    rest = {r.name: _rest(r) for r in campaign.recordings}
    starts = {r.name: _start(r, rest[r.name]) for r in campaign.recordings}
    highest = max(float(r.samples.max()) - rest[r.name] for r in campaign.recordings)
    noise = {
        r.name: local.noise_level(r.samples, rough_period(r.samples)) for r in campaign.recordings
    }
    estimates = Estimates(
        k1=k1,
        c1=c1,
        g=0.5 * highest if campaign.stop else float("inf"),
        c2=c1 if campaign.stop else 0.0,
        k2=MappingProxyType({case: stiffest for case in campaign.cases}),
        offset=MappingProxyType(rest),
        y0=MappingProxyType({name: start[0] for name, start in starts.items()}),
        v0=MappingProxyType({name: start[1] for name, start in starts.items()}),
        noise=MappingProxyType(noise),
        sd=MappingProxyType({}),
        impacts=MappingProxyType({r.name: 1 for r in campaign.recordings}),
    )
    return estimates.with_unknown_errors()


def _half_cycles(recording: Recording) -> HalfCycles:
    period = rough_period(recording.samples)
    noise = local.noise_level(recording.samples, period)
    return half_cycles(recording.samples, _rest(recording), period, noise)


def _rest(recording: Recording) -> float:
    """Middle of the last swings: half way between the means of their two turning points."""
    period = rough_period(recording.samples)
    last = recording.samples[-max(int(LAST * period), 8) :]
    return float(0.5 * (np.quantile(last, 0.95) + np.quantile(last, 0.05)))


def _decay(swings: HalfCycles) -> float:
    """Rate at which the turning points decay, per sample."""
    if swings.amplitudes.size < 3:
        return 0.0
    slope = np.polyfit(swings.peaks, np.log(swings.amplitudes), 1)[0]
    return float(max(-slope, 0.0))


def _start(recording: Recording, rest: float) -> tuple[float, float]:
    """Displacement and velocity at the first sample, from a parabola."""
    count = max(int(START * rough_period(recording.samples)), 5)
    times = recording.times[:count]
    fit = np.polynomial.Polynomial.fit(times, recording.samples[:count] - rest, 2)
    return float(fit(0.0)), float(fit.deriv()(0.0))
