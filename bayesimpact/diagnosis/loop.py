"""The loop: fit the base model, ask whether anything is missing, locate, name, model, show."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import Campaign
from bayesimpact.diagnosis.extend import campaign_scales
from bayesimpact.diagnosis.force import MissingForce
from bayesimpact.diagnosis.heldout import HeldOut, held_out_cases, held_out_recordings
from bayesimpact.diagnosis.honest import Widened, widened
from bayesimpact.diagnosis.limits import Limit, limits
from bayesimpact.diagnosis.locate import Location, locate
from bayesimpact.diagnosis.name import name
from bayesimpact.diagnosis.naming import Naming, is_gross
from bayesimpact.diagnosis.refit import Candidate
from bayesimpact.diagnosis.smoothing import SAVITZKY_GOLAY, proved_smoothing, whole_campaign
from bayesimpact.diagnosis.unknown import learn_force
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import Identification, identify
from bayesimpact.inference.spectrum import Fingerprint
from bayesimpact.model.effects import EFFECTS
from bayesimpact.model.effects.effect import Effect, Scales
from bayesimpact.model.threads import linear_algebra_alone

Array = NDArray[np.float64]
NEARLY_ALL = 0.9  # of the squared residual

Verdict = Literal["adequate", "named", "ambiguous", "unknown"]
Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What was found, with everything it rests on.

    Attributes
    ----------
    verdict : adequate, named, ambiguous or unknown
    identification : of the base model
    naming : all models that were tried
    before, after : base fit and the fit that the verdict stands for (the learned force when
        unknown)
    effects : that `after` adds, most important first; empty when adequate or unknown
    alternatives : models that fit alike, when ambiguous
    location : None when adequate
    force : the force that the base model leaves unexplained
    held_out, held_out_cases : predictive gains, or None where there is nothing to compare
    limits : of effects that were not found
    honest : parameters of `after` with what stays unexplained carried into their intervals
    scales : physical sizes of the campaign
    filtered : the filter that the noise spectrum proves and campaign.toml does not declare
    """

    verdict: Verdict
    identification: Identification
    naming: Naming
    before: Fit
    after: Fit
    effects: tuple[Effect, ...]
    alternatives: tuple[Candidate, ...]
    location: Location | None
    force: MissingForce
    held_out: HeldOut | None
    held_out_cases: HeldOut | None
    limits: tuple[Limit, ...]
    honest: Widened
    scales: Scales
    filtered: Fingerprint | None = None

    @property
    def remains(self) -> bool:
        """True when something small is left beside the effects that were named."""
        return self.verdict in ("named", "ambiguous") and not self.naming.chosen.is_white


@linear_algebra_alone()
def diagnose(
    campaign: Campaign,
    *,
    rng: np.random.Generator,
    effects: Sequence[Effect] = EFFECTS,
    search: bool = True,
    progress: Progress | None = None,
) -> Diagnosis:
    """Locate, name and model what the base oscillator leaves out of a campaign's recordings.

    Parameters
    ----------
    campaign : the recordings
    rng : source of all random numbers
    effects : the catalogue, and effects of one's own
    search : False leaves out the global search and trusts the quick estimates
    progress : called with a few words before every longer step

    Raises
    ------
    InputError : a recording shows no oscillation
    """
    say = progress or (lambda message: None)
    say("fitting the base model")
    identification = identify(campaign, rng=rng, search=search)
    filtered = proved_smoothing(campaign)
    if filtered is None:
        return diagnose_fit(identification, rng=rng, effects=effects, progress=say)
    say("the noise spectrum proves a filter: fitting through it")
    measurement = replace(campaign.measurement, smoothing=filtered.smoothing)
    through = identify(replace(campaign, measurement=measurement), rng=rng, search=False)
    found = diagnose_fit(through, rng=rng, effects=effects, progress=say)
    return with_smoothing(found, identification, filtered)


def with_smoothing(
    found: Diagnosis, identification: Identification, filtered: Fingerprint
) -> Diagnosis:
    """The diagnosis made through the filter, told from the fit that knew nothing of it."""
    location = found.location or whole_campaign(identification)
    return replace(
        found,
        verdict="named" if found.verdict == "adequate" else found.verdict,
        identification=replace(found.identification, search=identification.search),
        before=identification.fit,
        effects=(SAVITZKY_GOLAY, *found.effects),
        location=location,
        filtered=filtered,
    )


@linear_algebra_alone()
def diagnose_fit(
    identification: Identification,
    *,
    rng: np.random.Generator,
    effects: Sequence[Effect] = EFFECTS,
    progress: Progress | None = None,
) -> Diagnosis:
    """The loop from a base fit on."""
    say = progress or (lambda message: None)
    base = identification.fit
    if base.target.oscillator.smoothing is not None:  # a chain has one filter
        effects = [e for e in effects if e.id != SAVITZKY_GOLAY.id]
    scales = campaign_scales(base)
    naming = name(base, effects, scales, rng=rng, progress=say)
    verdict = judge(naming)
    chosen = naming.chosen
    after = chosen.candidate.fit
    if verdict == "unknown":
        say("learning the force")
        after = learn_force(base, naming.unknown, scales)
    added = ordered(naming, chosen.candidate.effects) if verdict in ("named", "ambiguous") else ()
    location = held = cases = None
    if verdict != "adequate":
        say("locating")
        location = locate(base, after, naming.unknown, added)
        if len(identification.fit.target.oscillator.campaign.recordings) > 1:
            say("predicting held-out recordings")
            held = held_out_recordings(base, after)
        if len(identification.fit.target.oscillator.campaign.cases) > 1:
            cases = held_out_cases(base, after)
    return Diagnosis(
        verdict,
        identification,
        naming,
        base,
        after,
        added,
        naming.rivals() if verdict == "ambiguous" else (),
        location,
        naming.base.force,
        held,
        cases,
        limits(chosen.candidate.fit, chosen.scan, scales),
        widened(chosen if verdict != "unknown" else naming.base),
        scales,
    )


def judge(naming: Naming) -> Verdict:
    """The verdict that the evidence supports.

    What remains beside the chosen effects must be white. One exception: where the base model misses
    by far more than the noise, effects that explain nearly all of it are named although something
    small remains (which the summary says).
    """
    chosen = naming.chosen
    if not chosen.candidate.effects:
        return "adequate" if chosen.is_white else "unknown"
    if naming.prefers_learned_force():
        return "unknown"
    if not chosen.is_white and not explains_gross_misfit(naming):
        return "unknown"
    return "ambiguous" if naming.rivals() else "named"


def explains_gross_misfit(naming: Naming) -> bool:
    """True when the base residual dwarfs the noise and the chosen effects take nearly all of it
    away.
    """
    base, chosen = naming.base.candidate.fit, naming.chosen.candidate.fit
    return (
        is_gross(base)
        and (base.reduced_chi2 - chosen.reduced_chi2) > NEARLY_ALL * base.reduced_chi2
    )


def ordered(naming: Naming, effects: tuple[Effect, ...]) -> tuple[Effect, ...]:
    """Effects by how much evidence the model loses without them."""
    if len(effects) < 2:
        return effects
    chosen = set(naming.chosen.candidate.ids)
    left: Mapping[frozenset[str], Candidate] = {frozenset(c.ids): c for c in naming.tried}

    def loss(effect: Effect) -> float:
        smaller = left.get(frozenset(chosen - {effect.id}))
        return -np.inf if smaller is None else smaller.log_evidence

    return tuple(sorted(effects, key=loss))
