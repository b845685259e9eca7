"""The loop: fit the base model, ask whether anything is missing, locate, name, model, show."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.html import html_table
from bayesimpact.diagnosis.decision import Decision, Verdict, decide
from bayesimpact.diagnosis.extend import campaign_scales
from bayesimpact.diagnosis.faults.compare import base_failed, gain
from bayesimpact.diagnosis.force import MissingForce
from bayesimpact.diagnosis.heldout import HeldOut, held_out_cases, held_out_recordings
from bayesimpact.diagnosis.intervals import Intervals, intervals
from bayesimpact.diagnosis.learned import LEARNED
from bayesimpact.diagnosis.limits import Limit, limits
from bayesimpact.diagnosis.locate import Location, locate, locate_effect
from bayesimpact.diagnosis.name import name
from bayesimpact.diagnosis.naming import Naming, State, is_large
from bayesimpact.diagnosis.promising import NEAR_MARGIN, RASH
from bayesimpact.diagnosis.recording_faults import Corrected, cleaned_campaign, compared_campaign
from bayesimpact.diagnosis.refit import Candidate
from bayesimpact.diagnosis.scan import scan
from bayesimpact.diagnosis.smoothing import SAVITZKY_GOLAY, proved_smoothing, whole_campaign
from bayesimpact.diagnosis.unknown import with_force
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import Identification, identify
from bayesimpact.inference.spectrum import Fingerprint
from bayesimpact.model.effects import SEARCHED
from bayesimpact.model.effects.effect import Effect, Scales
from bayesimpact.model.threads import linear_algebra_alone

Array = NDArray[np.float64]
Progress = Callable[[str], None]
BESIDE: Mapping[Verdict, Verdict] = {
    "adequate": "named",
    "named": "named",
    "partly": "partly",
    "ambiguous": "ambiguous",
    "unknown": "partly",
}
"""Verdicts where a fault of a recording or a filter has been named already."""


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What was found, with everything it rests on.

    Attributes
    ----------
    verdict : see `bayesimpact.diagnosis.decision`
    identification : of the base model
    naming : all models that were tried
    before, after : base fit and the fit that the verdict stands for (where unknown, the learned
        force or the best of the catalogue)
    effects : that are named, most important first; empty when adequate or unknown
    alternatives : models that fit alike
    location : of everything that is missing; None when adequate
    locations : of every effect by itself
    force : the force that the base model leaves unexplained
    held_out, held_out_cases : predictive gains, or None where there is nothing to compare
    limits : of effects that were not found
    intervals : of the parameters of `after`
    remains : what is left beside the effects, examined; None where that is noise
    scales : physical sizes of the campaign
    filtered : the filter that the noise spectrum proves and campaign.toml does not declare
    corrected : faults of the recordings, set aside or corrected before anything else
    """

    verdict: Verdict
    identification: Identification
    naming: Naming
    before: Fit
    after: Fit
    effects: tuple[Effect, ...]
    alternatives: tuple[Candidate, ...]
    location: Location | None
    locations: tuple[Location, ...]
    force: MissingForce
    held_out: HeldOut | None
    held_out_cases: HeldOut | None
    limits: tuple[Limit, ...]
    intervals: Intervals
    remains: State | None
    scales: Scales
    filtered: Fingerprint | None = None
    corrected: Corrected | None = None

    def __repr__(self) -> str:
        """One line."""
        names = ", ".join(effect.id for effect in self.effects) or "no effect"
        change = f"{self.before.reduced_chi2:.4g} to {self.after.reduced_chi2:.4g}"
        return f"<Diagnosis {self.verdict}: {names}, reduced chi2 {change}>"

    def _repr_html_(self) -> str:
        """Effects with their probabilities, and parameters before and after, for a notebook."""
        found = [
            (e.title, f"probability {self.naming.probability(e.id):.3g}") for e in self.effects
        ]
        layout = self.after.target.oscillator.layout
        for i in layout.roles("physical", "effect"):
            name, unit = layout.names[i], layout.parameters[i].unit
            if not name.startswith(LEARNED):
                low, middle, high = self.intervals.quantiles(name)
                found.append((name, f"{middle:.4g} ({low:.4g} to {high:.4g}) {unit}"))
        return html_table(repr(self), ("", "median (90 %)"), found)


@linear_algebra_alone()
def diagnose(
    campaign: Campaign,
    *,
    rng: np.random.Generator,
    effects: Sequence[Effect] = SEARCHED,
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
    corrected = cleaned_campaign(campaign, rng=rng, search=search)
    options: dict[str, Any] = {"rng": rng, "effects": effects, "progress": say}
    say("comparing the recordings")
    compared = compared_campaign(corrected, rng=rng, search=search)
    if base_failed(corrected.identification.fit):  # no physics is worth a search yet
        return _of_corrected(compared, **options)
    again = None
    if compared is not corrected and gains_more(compared, corrected, effects, rng=rng):
        again = _of_corrected(compared, **options)
        if again.verdict in ("adequate", "named"):
            return again
    found = _of_corrected(corrected, **options)
    if compared is corrected or not is_doubtful(found):
        return found
    again = again or _of_corrected(compared, **options)
    simpler = len(again.effects) + len(compared.compared) <= len(found.effects)
    settled = again.verdict in ("adequate", "named")
    return again if settled and (simpler or found.verdict != "named") else found


def gains_more(
    compared: Corrected, before: Corrected, effects: Sequence[Effect], *, rng: np.random.Generator
) -> bool:
    """Whether correcting faults gains more than any single effect promises: faults come first then.

    Where physics is missing, recordings of different amplitude show it each in its own way.
    """
    fit = before.identification.fit
    found = scan(fit, effects, campaign_scales(fit), rng=rng)
    most = max((score.gain for score in found.best()), default=0.0)
    first, last = compared.compared[0], compared.compared[-1]
    return gain(first.before, last.after, last.campaign) > RASH * most + NEAR_MARGIN


def is_doubtful(found: Diagnosis) -> bool:
    """Whether what was found may be a fault of a recording: nothing that holds for all recordings
    alike explains them.

    Physics shows differently in recordings of different amplitude.
    """
    own = any(p.scope != "campaign" for e in found.effects for p in e.parameters if not p.circular)
    return own or found.verdict in ("partly", "ambiguous", "unknown")


def _of_corrected(
    corrected: Corrected,
    *,
    rng: np.random.Generator,
    effects: Sequence[Effect],
    progress: Progress,
) -> Diagnosis:
    """The diagnosis of a campaign whose faults are set aside or corrected."""
    for fault in corrected.faults:
        progress(f"set aside or corrected: {fault.recording}: {fault.statement} ({fault.id})")
    identification = corrected.identification
    campaign = identification.fit.target.oscillator.campaign
    filtered = proved_smoothing(campaign)
    if filtered is None:
        found = diagnose_fit(identification, rng=rng, effects=effects, progress=progress)
    else:
        progress("the noise spectrum proves a filter: fitting through it")
        measurement = replace(campaign.measurement, smoothing=filtered.smoothing)
        through = identify(replace(campaign, measurement=measurement), rng=rng, search=False)
        found = diagnose_fit(through, rng=rng, effects=effects, progress=progress)
        found = with_smoothing(found, identification, filtered)
    if not corrected.faults:
        return replace(found, corrected=corrected)
    return replace(found, verdict=BESIDE[found.verdict], corrected=corrected)


def with_smoothing(
    found: Diagnosis, identification: Identification, filtered: Fingerprint
) -> Diagnosis:
    """The diagnosis made through the filter, told from the fit that knew nothing of it."""
    return replace(
        found,
        verdict=BESIDE[found.verdict],
        identification=replace(found.identification, search=identification.search),
        before=identification.fit,
        effects=(SAVITZKY_GOLAY, *found.effects),
        location=found.location or whole_campaign(identification),
        filtered=filtered,
    )


@linear_algebra_alone()
def diagnose_fit(
    identification: Identification,
    *,
    rng: np.random.Generator,
    effects: Sequence[Effect] = SEARCHED,
    progress: Progress | None = None,
) -> Diagnosis:
    """The loop from a base fit on."""
    say = progress or (lambda message: None)
    base = identification.fit
    if base.target.oscillator.smoothing is not None:  # a chain has one filter
        effects = [e for e in effects if e.id != SAVITZKY_GOLAY.id]
    scales = campaign_scales(base)
    naming = name(base, effects, scales, rng=rng, progress=say)
    decision = decide(naming)
    after, state = extension(naming, decision, scales, say)
    location, held, cases = None, None, None
    locations: tuple[Location, ...] = ()
    if decision.verdict != "adequate":
        say("locating")
        location = locate(base, after, naming.unknown, decision.effects)
        locations = tuple(locate_effect(naming, e, after) for e in decision.effects)
        if len(base.target.oscillator.campaign.recordings) > 1:
            say("predicting held-out recordings")
            held = held_out_recordings(base, after)
        if len(base.target.oscillator.campaign.cases) > 1:
            cases = held_out_cases(base, after)
    chosen = naming.chosen
    return Diagnosis(
        decision.verdict,
        identification,
        naming,
        base,
        after,
        decision.effects,
        decision.rivals,
        location,
        locations,
        naming.base.force,
        held,
        cases,
        limits(chosen.candidate.fit, chosen.scan, scales),
        intervals(after, state),
        state,
        scales,
    )


def extension(
    naming: Naming, decision: Decision, scales: Scales, say: Progress
) -> tuple[Fit, State | None]:
    """The fit that a verdict stands for, never worse than the base fit, and what it leaves.

    Where something remains, a residual force beside the effects, or in the place of all, is taken
    when it makes the model likelier.
    """
    base, chosen = naming.base, naming.chosen
    if decision.verdict in ("adequate", "named", "ambiguous"):
        return chosen.candidate.fit, None
    choices = [(chosen.candidate, chosen), (base.candidate, base)]
    choices += [
        (c, chosen) for ids, c in naming.residual.items() if ids == set(chosen.candidate.ids)
    ]
    if decision.verdict == "unknown" and not is_large(base.candidate.fit):
        learned = naming.residual.get(frozenset())
        if learned is None or naming.unknown is not base.unknown:  # a force in contact alone
            say("learning the force")
            learned = with_force(base.candidate, naming.unknown, scales)
        choices.append((learned, base))
    least = base.candidate.fit.reduced_chi2
    choices = [(c, s) for c, s in choices if c.fit.reduced_chi2 <= least]
    candidate, state = max(choices, key=lambda choice: naming.log_odds(choice[0]))
    return candidate.fit, state
