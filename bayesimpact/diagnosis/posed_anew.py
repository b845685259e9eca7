"""A search posed anew, on what a model that is nearly good enough has shown of the readings.

Spikes beside a contact, the instants at which contacts begin and end, where an acceleration jumps,
and noise that is slow show only against a model that leaves little else. Before they are known,
whatever follows them is fitted.
"""

from __future__ import annotations

from dataclasses import dataclass

from bayesimpact.diagnosis.faults.compare import Compared
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
from bayesimpact.inference.onsets import without_onsets


@dataclass(frozen=True, eq=False)
class Posed:
    """A search posed anew: from which base model, from which other one if any, without what."""

    base: Fit
    first: Fit | None
    spikes: tuple[Compared, ...] = ()


def posed_anew(base: Fit, state: State, say: Progress) -> Posed | None:
    """The search without the readings that spoil it, or under the slow noise that is all that a
    model leaves.
    """
    found = state.candidate.fit
    if not (state.is_white and found is base):
        posed = _without_readings(base, found, say)
        if posed is not None:
            return posed
    noise = None if state.is_white or is_large(found) else remaining_noise(found)
    if noise is None:
        return None
    say("what remains is slow noise: once more under that")
    first = under_noise(found, noise) if found is not base else None
    return Posed(under_noise(base, noise), first)


def _without_readings(base: Fit, found: Fit, say: Progress) -> Posed | None:
    """Without spikes that are all that a model leaves, and without accelerations at the onsets that
    it shows, which a base fit with a large misfit has elsewhere. As long as such a reading lies on
    the wrong side of its jump, it may look like a spike.
    """
    campaign, clean = found.target.oscillator.campaign, found
    spikes = all_that_remains(found)
    if spikes:
        clean = refitted(found, faults_set_aside(campaign, spikes))
        spikes = still_off(found, clean, spikes)
        campaign = faults_set_aside(campaign, spikes)
        clean = refitted(found, campaign, clean)
    if not is_large(clean) and without_onsets(clean) is not campaign:
        campaign = without_onsets(clean)
        clean = refitted(found, campaign, clean)
    if clean is found:
        return None
    say("readings that only a good model shows to be off: once more without them")
    change = found.reduced_chi2, clean.reduced_chi2
    told = tuple(Compared(fault, campaign, *change) for fault in spikes)
    if found is base:
        return Posed(clean, None, told)
    return Posed(refitted(base, campaign), clean, told)


def is_spoilt(fit: Fit) -> bool:
    """Whether readings are off, or jump, that only a model as good as this one shows: what is
    fitted to these decides nothing.
    """
    if all_that_remains(fit):
        return True
    return not (is_large(fit) or without_onsets(fit) is fit.target.oscillator.campaign)
