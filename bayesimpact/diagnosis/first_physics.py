"""Faults that comparing the recordings shows beside the physics that they ask for first.

Where strong physics is missing from the base model, a clock or a gain that is off in one recording
is lost beside it; and a search for physics that does not know of it adds law after law. Beside the
law that the equation of motion asks for first it may be all that is left: then every recording by
itself leaves nothing, and all of them together do not agree.
"""

from __future__ import annotations

from collections.abc import Sequence

from bayesimpact.data.campaign import Campaign
from bayesimpact.diagnosis.extend import campaign_scales
from bayesimpact.diagnosis.faults.alone import SharedModel, own_fit
from bayesimpact.diagnosis.faults.compare import LEAST, base_failed, misfits
from bayesimpact.diagnosis.likely_sets import LikelySets
from bayesimpact.diagnosis.naming import is_large, is_more_than_noise, leaves_something
from bayesimpact.diagnosis.recording_faults import (
    Corrected,
    Step,
    comparisons,
    shared_effects,
    values_of,
)
from bayesimpact.diagnosis.refit import fit_from
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect

MOST = 2  # effects beside which recordings are compared


def faults_beside_physics(
    before: Corrected, as_read: Campaign, effects: Sequence[Effect], by_base: Sequence[Step] = ()
) -> tuple[Step, ...]:
    """Faults that leave nothing beside the likeliest law, or pair of laws, along the measured
    motion; () where there are none, no misfit that is large, or where the faults that comparing
    `by_base` model shows leave nothing either.
    """
    fit = before.identification.fit
    campaign, noise = fit.target.oscillator.campaign, fit.target.likelihood.noise
    told = len(campaign.recordings) >= LEAST and is_large(fit) and not base_failed(fit)
    enough = bool(by_base) and not is_more_than_noise(by_base[-1][-1].after, noise)
    if campaign.keep_faults or not told or enough:
        return ()
    scales = campaign_scales(fit)
    for chosen in LikelySets(fit, effects, scales).best(MOST):
        if len(shared_effects(chosen.effects)) < len(chosen.effects):
            continue
        whole = fit_from(fit, chosen.effects, chosen.values, scales).fit
        if not misfits(whole):
            return ()  # physics is enough
        model = SharedModel(noise, chosen.effects, values_of(whole))
        if not all(_leaves_nothing(own_fit(campaign, r, model)) for r in campaign.recordings):
            continue
        steps = comparisons(before, as_read, chosen.effects, whole)
        if steps and _leaves_nothing(model.fitted(steps[-1][-1].campaign)):
            return steps
    return ()


def _leaves_nothing(fit: Fit | None) -> bool:
    """Whether there is a fit and what it leaves is no more than noise."""
    return fit is not None and not leaves_something(fit)
