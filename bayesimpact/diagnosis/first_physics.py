"""Faults that comparing the recordings shows beside the physics that they ask for first.

Where strong physics is missing from the base model, a clock or a gain that is off in one recording
is lost beside it; and a search for physics that does not know of it adds law after law. Beside the
law that the equation of motion asks for first it may be all that is left: then every recording by
itself leaves nothing, and all of them together do not agree. What a stop does is asked of periods
ahead, of recordings that each have a stop of their own, so that no wrong label has a part in it.
"""

from __future__ import annotations

from collections.abc import Sequence

from bayesimpact.data.campaign import Campaign
from bayesimpact.diagnosis.extend import campaign_scales, extend
from bayesimpact.diagnosis.faults.alone import SharedModel, own_fit
from bayesimpact.diagnosis.faults.compare import LEAST, base_failed, misfits
from bayesimpact.diagnosis.faults.own_stops import (
    labels_are_doubted,
    share_stops,
    shared_values,
    with_own_stops,
)
from bayesimpact.diagnosis.likely_sets import LikelySets
from bayesimpact.diagnosis.naming import is_large, is_more_than_noise, leaves_something
from bayesimpact.diagnosis.period_sets import PeriodSets
from bayesimpact.diagnosis.recording_faults import (
    Corrected,
    Step,
    comparisons,
    shared_effects,
    values_of,
)
from bayesimpact.diagnosis.refit import fit_from
from bayesimpact.diagnosis.thresholds import EXCESS
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect

MOST = 2  # effects beside which recordings are compared
MOST_AT_STOPS = 3  # of those that periods ahead ask for


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
        values = values_of(whole)
        model = SharedModel(noise, chosen.effects, values)
        if not all(_leaves_nothing(own_fit(campaign, r, model)) for r in campaign.recordings):
            continue
        steps = comparisons(before, as_read, chosen.effects, values)
        if steps and _leaves_nothing(model.fitted(steps[-1][-1].campaign)):
            return steps
    return _labels_beside_physics(before, as_read, effects)


def _labels_beside_physics(
    before: Corrected, as_read: Campaign, effects: Sequence[Effect]
) -> tuple[Step, ...]:
    """Faults without which the likeliest laws leave `EXCESS` times less, where the stiffnesses that
    recordings with stops of their own show beside these doubt a label, and leave as much less.
    """
    fit = before.identification.fit
    if not share_stops(fit.target.oscillator.campaign):
        return ()
    scales, own = campaign_scales(fit), with_own_stops(fit)
    sets = PeriodSets(own, effects, scales).best(MOST_AT_STOPS)
    if not sets or not labels_are_doubted(fit.target.oscillator.campaign, sets[-1].values):
        return ()
    apart = fit_from(own, sets[-1].effects, sets[-1].values, scales).fit
    layout = extend(fit, sets[-1].effects, scales).oscillator.layout
    values = shared_values(apart, layout)
    together = fit_from(fit, sets[-1].effects, values, scales).fit
    most = together.reduced_chi2 / EXCESS
    if apart.reduced_chi2 > most:
        return ()
    steps = comparisons(before, as_read, sets[-1].effects, values)
    return steps if steps and steps[-1][-1].after <= most else ()


def _leaves_nothing(fit: Fit | None) -> bool:
    """Whether there is a fit and what it leaves is no more than noise."""
    return fit is not None and not leaves_something(fit)
