"""Faults that comparing the recordings shows beside the physics that they ask for first.

Where strong physics is missing from the base model, a clock or a gain that is off in one recording
is lost beside it; and a search for physics that does not know of it adds law after law. Beside the
law that the equation of motion asks for first, or periods ahead where that tells nothing, it may be
all that is left: then most recordings by themselves leave nothing, and all of them together do not
agree. What a stop does is asked of periods ahead, of recordings that each have a stop of their own,
so that no wrong label has a part in it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayesimpact.data.campaign import Campaign
from bayesimpact.diagnosis.candidates.likely_sets import LikelySets
from bayesimpact.diagnosis.candidates.period_sets import PeriodSets
from bayesimpact.diagnosis.candidates.term_sets import EffectSet, TermSets
from bayesimpact.diagnosis.faults.alone import SharedModel, own_fit
from bayesimpact.diagnosis.faults.changes import change_instead
from bayesimpact.diagnosis.faults.compare import (
    LEAST,
    SHARE,
    Compared,
    base_failed,
    log_likelihood_gain,
    misfits,
)
from bayesimpact.diagnosis.faults.correct import as_fault, corrected
from bayesimpact.diagnosis.faults.own_stops import (
    share_stops,
    shared_values,
    shown_label,
    with_own_stops,
)
from bayesimpact.diagnosis.faults.recording_faults import (
    Corrected,
    Step,
    comparisons,
    fault_as_read,
    shared_effects,
    values_of,
)
from bayesimpact.diagnosis.faults.together import CERTAIN, Hypothesis, Weighed
from bayesimpact.diagnosis.refits.extend import campaign_scales, extend
from bayesimpact.diagnosis.refits.refit import fit_from
from bayesimpact.diagnosis.selection.outcome import is_large, is_more_than_noise, leaves_something
from bayesimpact.diagnosis.selection.unknown import with_free_force
from bayesimpact.diagnosis.thresholds import EXCESS
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.effects.effect import Effect
from bayesimpact.model.oscillator import build_oscillator
from bayesimpact.model.parameters import Layout

MOST = 2  # effects beside which recordings are compared
MOST_AT_STOPS = 3  # of those that periods ahead ask for, beside which labels are doubted


def faults_beside_physics(
    before: Corrected, as_read: Campaign, effects: Sequence[Effect], by_base: Sequence[Step] = ()
) -> tuple[Step, ...]:
    """Faults that leave nothing beside the likeliest law, or pair of laws, along the measured
    motion; () where there are none, no misfit that is large, or where the faults that comparing
    `by_base` model shows leave nothing either.
    """
    fit = before.identification.fit
    campaign, noise = fit.density.oscillator.campaign, fit.density.likelihood.noise
    told = len(campaign.recordings) >= LEAST and is_large(fit) and not base_failed(fit)
    enough = bool(by_base) and not is_more_than_noise(by_base[-1][-1].after, noise)
    if campaign.keep_faults or not told or enough:
        return ()
    scales = campaign_scales(fit)
    along: TermSets = LikelySets(fit, effects, scales)
    if not along.terms and campaign.stop:  # of readings that can be made no displacement
        along = PeriodSets(fit, shared_effects(effects), scales)
    for chosen in along.best(MOST):
        if len(shared_effects(chosen.effects)) < len(chosen.effects):
            continue
        whole = fit_from(fit, chosen.effects, chosen.values, scales).fit
        if not misfits(whole):
            return ()  # physics is enough
        values = values_of(whole)
        model = SharedModel(noise, chosen.effects, values)
        if not _most_leave_nothing(campaign, model):
            continue
        steps = comparisons(before, as_read, chosen.effects, values)
        if steps and _leaves_nothing(model.fitted(steps[-1][-1].campaign)):
            if _leaves_nothing(with_free_force(whole)):
                return ()  # so is physics that no law of the catalogue is
            changed = change_instead(steps, fit, whole, as_read)
            return (changed,) if changed else steps
    return _label_beside_physics(before, as_read, effects)


def _label_beside_physics(
    before: Corrected, as_read: Campaign, effects: Sequence[Effect]
) -> tuple[Step, ...]:
    """A wrong label that the contact stiffnesses of recordings with stops of their own show beside
    the likeliest laws, where with the right one these leave `EXCESS` times less.
    """
    fit = before.identification.fit
    campaign, noise = fit.density.oscillator.campaign, fit.density.likelihood.noise
    if not share_stops(campaign):
        return ()
    scales, own = campaign_scales(fit), with_own_stops(fit)
    for chosen in PeriodSets(own, shared_effects(effects), scales).best(MOST_AT_STOPS)[::-1]:
        shown = shown_label(campaign, chosen.values)
        if shown is None:
            continue
        place, case = shown
        label = Weighed(Hypothesis("recording_case", place, case=case), 0.0)
        right = corrected(campaign, place, label)
        layout = extend(own, chosen.effects, scales).oscillator.layout
        given, put_right = (
            _left_by(chosen, layout, labelled, noise) for labelled in (campaign, right)
        )
        if given > EXCESS * put_right:
            recording, gained = (
                campaign.recordings[place],
                log_likelihood_gain(given, put_right, right),
            )
            fault = as_fault(recording, label, gained, CERTAIN)
            told = fault_as_read(fault, campaign, as_read)
            return ((Compared(told, right, given, put_right),),)
    return ()


def _left_by(chosen: EffectSet, own: Layout, campaign: Campaign, noise: Noise) -> float:
    """Reduced chi-squared of laws with the values of recordings with own stops, those of a
    campaign's labels put together; infinite where it allows no fit.
    """
    shared = build_oscillator(campaign, chosen.effects).layout
    values = shared_values(chosen.values, own, shared)
    found = SharedModel(noise, chosen.effects, values).fitted(campaign)
    return np.inf if found is None else found.reduced_chi2


def _most_leave_nothing(campaign: Campaign, model: SharedModel) -> bool:
    """Whether what recordings leave alone is no more than noise, but for as many as may be faulty:
    one with samples lost does not fit alone either.
    """
    may_be_faulty = int(SHARE * len(campaign.recordings))
    for recording in campaign.recordings:
        may_be_faulty -= not _leaves_nothing(own_fit(campaign, recording, model))
        if may_be_faulty < 0:
            return False
    return True


def _leaves_nothing(fit: Fit | None) -> bool:
    """Whether there is a fit and what it leaves is no more than noise."""
    return fit is not None and not leaves_something(fit)
