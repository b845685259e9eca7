"""The loop on a base fit: ask whether anything is missing, locate, name, model, show."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from bayesimpact.diagnosis.budget import Budget, begin
from bayesimpact.diagnosis.faults.recording_faults import Corrected
from bayesimpact.diagnosis.formulas.listing import Formulas
from bayesimpact.diagnosis.formulas.search import Answer, with_formulas
from bayesimpact.diagnosis.held_out import HeldOut, held_out_cases, held_out_recordings
from bayesimpact.diagnosis.intervals import Intervals, intervals
from bayesimpact.diagnosis.limits import Limit, limits
from bayesimpact.diagnosis.location import Location, locate, locate_effect
from bayesimpact.diagnosis.measurement.smoothing import SAVITZKY_GOLAY
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import Candidate
from bayesimpact.diagnosis.residual_force.gaussian_process import MissingForce
from bayesimpact.diagnosis.selection.comparable import Comparable, alike_in_misfit, alike_in_odds
from bayesimpact.diagnosis.selection.decision import Decision, Verdict, decide
from bayesimpact.diagnosis.selection.outcome import ExaminedModel, Selection, is_large
from bayesimpact.diagnosis.selection.revision import band_limited
from bayesimpact.diagnosis.selection.search import select_model
from bayesimpact.diagnosis.selection.told_sizes import of_told_size
from bayesimpact.diagnosis.selection.unknown import with_force
from bayesimpact.diagnosis.thresholds import EXCESS
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import Identification
from bayesimpact.inference.noise.spectrum import Fingerprint
from bayesimpact.model.effects import SEARCHED
from bayesimpact.model.effects.effect import Effect, Scales
from bayesimpact.model.jit.threads import linear_algebra_alone

Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What was found, with everything it rests on.

    Attributes
    ----------
    verdict : see `bayesimpact.diagnosis.selection.decision`
    identification : of the base model
    selection : all models that were tried
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
    formulas : for a learned force, where something is unknown
    either : groups of effects that the recordings cannot tell apart, one of each of which is needed
    families : of effects of which some are needed, and what of each was fitted
    """

    verdict: Verdict
    identification: Identification
    selection: Selection
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
    remains: ExaminedModel | None
    scales: Scales
    filtered: Fingerprint | None = None
    corrected: Corrected | None = None
    formulas: Formulas | None = None
    either: tuple[tuple[Effect, ...], ...] = ()
    families: Mapping[str, tuple[Effect, ...]] = field(default_factory=dict)

    @property
    def groups(self) -> tuple[tuple[Effect, ...], ...]:
        """Effects of which some are needed: one of each group, one or more of each family."""
        return (*self.either, *self.families.values())

    def __repr__(self) -> str:
        """One line."""
        names = ", ".join(effect.id for effect in self.effects) or "no effect"
        change = f"{self.before.reduced_chi2:.4g} to {self.after.reduced_chi2:.4g}"
        return f"<Diagnosis {self.verdict}: {names}, reduced chi2 {change}>"


@linear_algebra_alone()
def diagnose_fit(
    identification: Identification,
    *,
    rng: np.random.Generator,
    effects: Sequence[Effect] = SEARCHED,
    progress: Progress | None = None,
    budget: Budget | None = None,
    first: Fit | None = None,
) -> Diagnosis:
    """The loop from a base fit on; with a budget of its own where none is given.

    The search begins with the model of `first`, where that is given.
    """
    say, budget = progress or (lambda message: None), budget or begin()
    base = identification.fit
    if base.density.oscillator.smoothing is not None:  # a chain has one filter
        effects = [e for e in effects if e.id != SAVITZKY_GOLAY.id]
    scales = campaign_scales(base)
    smooth = _with_smooth_inputs(base) if first is None else None
    begun = smooth or base
    selection = select_model(
        begun, effects, scales, rng=rng, progress=say, budget=budget, first=first
    )
    selection = replace(selection, band_limited=selection.band_limited or smooth is not None)
    if selection.base.candidate.fit is not base:  # revised, see `revision`
        base = selection.base.candidate.fit
        noise = base.density.likelihood.noise
        identification = replace(identification, fit=base, noise=noise)
    decision = decide(selection)
    after, examined = extension(selection, decision, scales, say)
    answer = Answer(selection, decision, after, examined)
    answer = with_formulas(answer, effects, scales, rng=rng, progress=say, budget=budget)
    selection, decision, after, examined = (
        answer.selection,
        answer.decision,
        answer.after,
        answer.examined,
    )
    ranges = intervals(
        after,
        remains=examined is not None,
        known=selection.own,
        beside=_beside(selection, decision, after, examined),
    )
    decision = of_told_size(decision, ranges, after)
    location, held_out, cases = None, None, None
    locations: tuple[Location, ...] = ()
    if decision.verdict != "adequate":
        say("locating")
        location = locate(base, after, selection.unknown, decision.effects)
        locations = tuple(locate_effect(selection, e, after) for e in decision.effects)
        if len(base.density.oscillator.campaign.recordings) > 1:
            say("predicting held-out recordings")
            held_out = held_out_recordings(base, after)
        if len(base.density.oscillator.campaign.cases) > 1:
            cases = held_out_cases(base, after)
    chosen = shown(selection, decision)
    return Diagnosis(
        decision.verdict,
        identification,
        replace(selection, chosen=chosen, own=None),  # large, of use for the intervals alone
        base,
        after,
        decision.effects,
        decision.rivals,
        location,
        locations,
        selection.base.force,
        held_out,
        cases,
        limits(chosen.candidate.fit, chosen.scan, scales),
        ranges,
        examined,
        scales,
        formulas=answer.formulas,
        either=decision.either,
        families=decision.families,
    )


def _with_smooth_inputs(base: Fit) -> Fit | None:
    """A base fit with a large misfit, with inputs that are band-limited between their samples where
    these leave far less; a smaller gain shows beside a better model only, see `revised`.
    """
    smooth = band_limited(base) if is_large(base) else None
    far_less = smooth is not None and EXCESS * smooth.reduced_chi2 < base.reduced_chi2
    return smooth if far_less else None


def _beside(
    selection: Selection, decision: Decision, after: Fit, examined: ExaminedModel | None
) -> Comparable | None:
    """Models that do not stand out from the one that is shown."""
    if examined is not None:
        return alike_in_misfit(selection, after)
    if decision.verdict != "ambiguous":
        return None
    return alike_in_odds(selection, selection.chosen.candidate, decision.rivals)


def shown(selection: Selection, decision: Decision) -> ExaminedModel:
    """The chosen model; where nothing is missing, the base model, whatever was chosen."""
    nothing = decision.verdict == "adequate" and selection.chosen.candidate.effects
    return selection.base if nothing else selection.chosen


def extension(
    selection: Selection, decision: Decision, scales: Scales, say: Progress
) -> tuple[Fit, ExaminedModel | None]:
    """The fit that a verdict stands for, never worse than the base fit, and what it leaves.

    Where the misfit is large, named effects are shown as the catalogue's model has them: beside a
    residual force, which may take their place, their sizes mean nothing. Where nothing is named,
    the model that explains most; a residual force beside effects only where the misfit is small,
    else one in the place of all of them.
    """
    base, chosen = selection.base, selection.chosen
    if decision.verdict in ("adequate", "named", "ambiguous"):
        return shown(selection, decision).candidate.fit, None
    least = base.candidate.fit.reduced_chi2
    if decision.verdict == "partly" and chosen.candidate.fit.reduced_chi2 <= least:
        beside = selection.residual.get(frozenset(chosen.candidate.ids), chosen.candidate)
        large = is_large(base.candidate.fit) or beside.fit.reduced_chi2 > least
        likelier = selection.log_odds(beside) > selection.log_odds(chosen.candidate) and not large
        return (beside if likelier else chosen.candidate).fit, chosen
    choices = [
        (c, selection.examined_models.get(frozenset(c.ids), chosen)) for c in selection.tried
    ]
    learned = selection.residual.get(frozenset())
    if is_large(base.candidate.fit):
        choices += [] if learned is None else [(learned, base)]
    else:
        choices += [(c, chosen) for c in selection.residual.values()]
        if learned is None or selection.unknown is not base.unknown:  # a force in contact alone
            say("learning the force")
            learned = with_force(base.candidate, selection.unknown, scales)
        choices.append((learned, base))
    choices = [(c, s) for c, s in choices if c.fit.reduced_chi2 <= least]
    candidate, examined = max(choices, key=lambda choice: selection.promise(choice[0]))
    return candidate.fit, examined
