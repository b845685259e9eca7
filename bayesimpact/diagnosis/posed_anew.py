"""A search posed anew, on what a model that is nearly good enough has shown of the readings.

Spikes beside a contact, readings that jump within the posterior, and noise that is slow show only
against a model that leaves nothing else. Before they are known, whatever follows them is fitted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayesimpact.diagnosis.faults.compare import Compared
from bayesimpact.diagnosis.faults.jumps import jumping_readings, without_readings
from bayesimpact.diagnosis.faults.outliers import (
    all_that_remains,
    faults_set_aside,
    refitted,
    still_off,
)
from bayesimpact.diagnosis.models import Progress
from bayesimpact.diagnosis.naming import State, is_large
from bayesimpact.diagnosis.slow_noise import remaining_noise, under_noise
from bayesimpact.inference.fit import Fit


@dataclass(frozen=True, eq=False)
class Posed:
    """A search posed anew: from which base model, from which other one if any, without what."""

    base: Fit
    first: Fit | None
    spikes: tuple[Compared, ...] = ()


def posed_anew(base: Fit, state: State, rng: np.random.Generator, say: Progress) -> Posed | None:
    """The search without the readings that spoil it, or under the slow noise that is all that a
    model leaves.
    """
    found = state.candidate.fit
    if not (state.is_white and found is base):
        posed = _without_readings(base, found, rng, say)
        if posed is not None:
            return posed
    noise = None if state.is_white or is_large(found) else remaining_noise(found)
    if noise is None:
        return None
    say("what remains is slow noise: once more under that")
    first = under_noise(found, noise) if found is not base else None
    return Posed(under_noise(base, noise), first)


def _without_readings(
    base: Fit, found: Fit, rng: np.random.Generator, say: Progress
) -> Posed | None:
    """Without spikes that are all that a model leaves, and without what jumps within its posterior;
    a jump may look like a spike as long as it is on the wrong side.
    """
    campaign, clean = found.target.oscillator.campaign, found
    spikes = all_that_remains(found)
    if spikes:
        clean = refitted(found, faults_set_aside(campaign, spikes))
        spikes = still_off(found, clean, spikes)
        campaign = faults_set_aside(campaign, spikes)
        clean = refitted(found, campaign, clean)
    jumps = () if is_large(clean) else jumping_readings(clean, rng)
    if jumps:
        campaign = without_readings(campaign, jumps)
        clean = refitted(found, campaign, clean)
    if clean is found:
        return None
    say("readings that only a good model shows to be off: once more without them")
    change = found.reduced_chi2, clean.reduced_chi2
    told = tuple(Compared(fault, campaign, *change) for fault in spikes)
    return (
        Posed(clean, None, told) if found is base else Posed(refitted(base, campaign), clean, told)
    )


def spoilt(fit: Fit, rng: np.random.Generator) -> bool:
    """Whether readings are off, or jump, that only a model as good as this one shows: what is
    fitted to these decides nothing.
    """
    return bool(all_that_remains(fit)) or (not is_large(fit) and bool(jumping_readings(fit, rng)))
