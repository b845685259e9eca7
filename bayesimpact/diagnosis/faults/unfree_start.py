"""A start that is no free decay yet, where only a fit shows it: a hand lets go of a moving mass.

A pull or a rest shows in the readings themselves (`data.faults.start`). A push that ends while the
mass swings does not; but a model that leaves much of a whole recording, and little of the same one
without its first instants, was kept from fitting by these. Each recording is fitted alone, whole
and from later instants on, and both fits are held against the same readings. A missing force does
the same where the motion decays, by as much as it grows with the amplitude: only what goes beyond
that counts.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayesimpact.data.faults.fault import Fault, start_fault
from bayesimpact.data.recording import Recording
from bayesimpact.inference.fit import Fit, PosteriorDensity
from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.mode import find_mode
from bayesimpact.inference.priors import Priors
from bayesimpact.model.oscillator import build_oscillator

INSTANTS = (0.25, 0.5, 1.0, 2.0, 3.0)  # of a free period
SHARE = 0.25  # of a recording, at most: what follows has to say what it is fitted by
POWER = 3  # of the amplitude, that a force grows with; it leaves the square of that of the power
BETTER = 4.0  # times less left of the same readings: three quarters of the misfit are the start's
NEARLY = 0.5  # of the best such ratio: the earliest instant that reaches so much is taken
ITERATIONS = 25


def unfree_starts(fit: Fit) -> tuple[Fault, ...]:
    """First instants of recordings that keep a fit with a large misfit from the rest of them."""
    campaign, stiffness = fit.density.oscillator.campaign, fit.value("k1")
    if not stiffness > 0.0:
        return ()
    period = 2 * np.pi * float(np.sqrt(campaign.mass / stiffness))
    found = []
    for r, recording in enumerate(campaign.recordings):
        firsts = [round(share * period / recording.interval) for share in INSTANTS]
        firsts = [first for first in firsts if first <= SHARE * recording.samples.size]
        if recording.input is not None or not firsts:
            continue
        whole = _alone(fit, r, 0)
        ratios = [
            _ratio(whole, _alone(fit, r, first), first) / _decayed(recording, first)
            for first in firsts
        ]
        if max(ratios) > BETTER:
            at = next(i for i, x in enumerate(ratios) if x >= max(BETTER, NEARLY * max(ratios)))
            found.append(start_fault(recording, firsts[at], ratios[at], BETTER))
    return tuple(found)


def _alone(fit: Fit, r: int, first: int) -> Fit:
    """One recording from a sample on, fitted by itself from where the fit has it then."""
    o, noise = fit.density.oscillator, fit.density.likelihood.noise
    recording = o.campaign.recordings[r]
    campaign = replace(o.campaign, recordings=(recording.part(first, recording.samples.size),))
    oscillator = build_oscillator(campaign, o.effects, smoothing=o.smoothing)
    names = oscillator.layout.names
    own, whole = oscillator.layout, o.layout
    at = np.full(own.size, fit.density.likelihood.sigma_columns[r])  # but for the noise:
    known = own.columns[0] >= 0
    at[own.columns[0, known]] = whole.columns[r, known]  # channels share what has one name
    if oscillator.gains[0] >= 0:
        at[oscillator.gains[0]] = o.gains[r]
    priors = Priors(tuple(fit.density.priors.parameters[i] for i in at))
    start, sd = fit.mode[at], fit.sd[at]
    y = fit.displacements[r]
    start[names.index(f"y0[{recording.name}]")] = y[first]
    start[names.index(f"v0[{recording.name}]")] = np.gradient(y, recording.interval)[first]
    density = PosteriorDensity(Likelihood(oscillator, noise), priors, fit.density.replaced)
    return find_mode(density, start, steps=0.05 * sd, max_iterations=ITERATIONS)


def _ratio(whole: Fit, later: Fit, first: int) -> float:
    """What the fit of the whole leaves of the later readings over what their own fit does."""
    if not np.isfinite(later.log_posterior):
        return 0.0
    before, after = whole.residuals[0][first:], later.residuals[0]
    level = whole.density.likelihood.noise.level * float(whole.density.likelihood.scales[0])
    return float(before @ before) / max(float(after @ after), after.size * level**2)


def _decayed(recording: Recording, first: int) -> float:
    """How many times less a missing force leaves of the rest, whose amplitude is less.

    Of 160 simulated decays beside a stop that a model missed by much (damping ratios of 0.005 to
    0.1; alone, with a cubic spring, drag or dry friction) three quarters reached `BETTER` at three
    periods without this, and none with it.
    """
    used = np.ones(recording.samples.size, bool) if recording.used is None else recording.used
    rest = recording.samples[first:][used[first:]]
    if rest.size == 0:
        return np.inf
    whole = np.ptp(recording.samples[used])
    return float((whole / max(np.ptp(rest), 1e-300)) ** (2 * POWER))
