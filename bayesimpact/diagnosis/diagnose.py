"""The whole way: faults of the recordings and missing physics, told from one another.

1. What recordings show of themselves is set aside, and the base model fitted, through the filter
   that the noise proves if it does. So are starts that the equation of motion shows to be pushed.
2. What comparing them shows is corrected, step by step, as long as a step gains more than any
   effect promises. Where physics then leaves something, once more without these corrections, unless
   one gained more than all effects together promise.
3. Physics is searched. Where that ends in doubt, the recordings are compared beside it, and it is
   searched once more with the other steps corrected, unless an answer that explains everything
   needs all of its effects beside these: the simpler of two such answers stays.
4. An answer that explains everything keeps the corrections of 2 and 3 only where, beside its
   effects, the recordings as they were still differ by more than chance.
5. A start that is no free decay yet may only show against a fit with that physics: then once more
   without it. Spikes, gains and clocks that only show there, and slow noise, are found by the
   search itself.

All searches have one budget of computing, which begins with the first. What is left of it after one
is the next one's; where that is too little, the next one is not begun. An answer that was not
compared with another search, or not to its end, says so and is `ambiguous` instead of `named`: the
faults that were not asked about might do what its effects do.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.faults.fault import Fault
from bayesimpact.diagnosis.budget import Budget, begin
from bayesimpact.diagnosis.candidates.promising import NEAR_MARGIN, SCORE_UNDERESTIMATE
from bayesimpact.diagnosis.faults.changes import change_instead
from bayesimpact.diagnosis.faults.compare import base_failed, log_likelihood_gain, misfits
from bayesimpact.diagnosis.faults.first_physics import faults_beside_physics
from bayesimpact.diagnosis.faults.forced_start import forced_starts
from bayesimpact.diagnosis.faults.pushed_start import pushed_starts
from bayesimpact.diagnosis.faults.recording_faults import (
    Corrected,
    Step,
    cleaned_campaign,
    comparisons,
    fitted_beside,
    shared_effects,
    values_of,
    with_faults,
    with_steps,
    without_faults,
)
from bayesimpact.diagnosis.faults.simpler import (
    OPEN,
    is_complete,
    is_simpler,
    makes_idle,
    may_be_simpler,
)
from bayesimpact.diagnosis.faults.soft_release import soft_releases
from bayesimpact.diagnosis.faults.unfree_start import BETTER, unfree_starts
from bayesimpact.diagnosis.loop import Diagnosis, Progress, diagnose_fit
from bayesimpact.diagnosis.measurement.high_pass import behind_high_pass
from bayesimpact.diagnosis.measurement.smoothing import SAVITZKY_GOLAY, whole_campaign
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.score_test.scan import scan
from bayesimpact.diagnosis.selection.decision import Verdict
from bayesimpact.diagnosis.selection.outcome import is_large
from bayesimpact.formula.law import is_formula
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import Identification, identify
from bayesimpact.inference.noise.spectrum import Fingerprint
from bayesimpact.model.effects import SEARCHED
from bayesimpact.model.effects.effect import Effect
from bayesimpact.model.jit.compiled import compilation_left_out
from bayesimpact.model.jit.threads import linear_algebra_alone
from bayesimpact.model.jit.workload import workload_counted

Array = NDArray[np.float64]

SLOWEST = 2.0
"""Times as slow as `workload` expects that a machine may be before its own seconds count."""

BESIDE: Mapping[Verdict, Verdict] = {
    "adequate": "named",
    "named": "named",
    "partly": "partly",
    "ambiguous": "ambiguous",
    "unknown": "partly",
}
"""Verdicts where a fault of a recording or a filter has been named already."""

Better = Callable[[Diagnosis, Diagnosis], bool]


@dataclass(frozen=True, eq=False)
class Searches:
    """Searches of physics on one campaign, differently corrected, with one budget."""

    rng: np.random.Generator
    effects: Sequence[Effect]
    progress: Progress
    budget: Budget
    as_read: Campaign

    def search(self, corrected: Corrected, first: Fit | None = None) -> Diagnosis:
        """With what is left of the budget, from the model of `first` on where that is given."""
        return _of_corrected(
            corrected,
            rng=self.rng,
            effects=self.effects,
            progress=self.progress,
            budget=self.budget,
            first=first,
            as_read=self.as_read,
        )

    def again(
        self,
        found: Diagnosis,
        corrected: Callable[[], Corrected],
        is_better: Better,
        first: Fit | None = None,
    ) -> Diagnosis:
        """An answer, or the one with other corrections where that `is_better`.

        Without time to ask for the other one, or to ask to the end, the answer is not finished.
        """
        if not self.budget.may_search_again():
            return unfinished(found)
        other = self.search(corrected(), first)
        if is_better(other, found):
            return other
        return found if other.selection.finished else unfinished(found)


@linear_algebra_alone()
def diagnose(
    campaign: Campaign,
    *,
    rng: np.random.Generator,
    effects: Sequence[Effect] = SEARCHED,
    search: bool = True,
    progress: Progress | None = None,
    clock: Callable[[], float] | None = None,
) -> Diagnosis:
    """Locate, name and model what the base oscillator leaves out of a campaign's recordings.

    Parameters
    ----------
    campaign : the recordings
    rng : source of all random numbers
    effects : the catalogue, and effects of one's own
    search : False leaves out the global search and trusts the quick estimates
    progress : called with a few words before every longer step
    clock : s, of the budget, from the first search of physics on; compiling does not count. Without
        one that of what is simulated, so that no other work of the machine changes an answer, as
        long as the machine is not `SLOWEST` times slower than that expects

    Raises
    ------
    InputError : a recording shows no oscillation
    """
    say = progress or (lambda message: None)
    process = clock or time.process_time
    with compilation_left_out(process) as computing, workload_counted() as simulated:
        begun = computing()

        def reading() -> float:
            return computing() if clock else max(simulated(), (computing() - begun) / SLOWEST)

        return _diagnosed(campaign, rng, effects, search, say, reading)


def _diagnosed(
    campaign: Campaign,
    rng: np.random.Generator,
    effects: Sequence[Effect],
    search: bool,
    say: Progress,
    clock: Callable[[], float],
) -> Diagnosis:
    """Stage by stage, see above."""
    say("fitting the base model")
    cleaned = cleaned_campaign(campaign, rng=rng, search=search)
    cleaned, passed = behind_high_pass(cleaned, campaign, effects, rng=rng, search=search)
    first = cleaned.identification.fit
    pushed = _pushed(cleaned, effects) if is_large(first) and passed is None else ()
    if pushed:
        cleaned = without_faults(cleaned, pushed, campaign, rng=rng)
    elif base_failed(first) and passed is None:
        cleaned = _by_a_free_rest(cleaned, campaign, rng)
    say("comparing the recordings")
    doubtful = list(_compared(cleaned, campaign, passed))
    fit = cleaned.identification.fit
    if changed := change_instead(doubtful, fit, fit, campaign):
        cleaned = with_steps(cleaned, [changed], rng=rng, search=search)
        passed, doubtful = None, list(comparisons(cleaned, campaign))
    certain, proved = cleaned, False
    beside_physics = (
        faults_beside_physics(cleaned, campaign, effects, doubtful) if passed is None else ()
    )
    if beside_physics:
        certain = with_steps(cleaned, beside_physics, rng=rng, search=search)
        doubtful, proved = [], True
    while doubtful:
        fit = certain.identification.fit
        promised = promised_gains(fit, effects, rng=rng)
        if not gains_more_than(doubtful[0], fit, float(promised.max(initial=0.0))):
            break
        proved = proved or gains_more_than(doubtful[0], fit, float(promised.sum()))
        certain = with_steps(certain, [doubtful.pop(0)], rng=rng, search=search)
    searches = Searches(rng, effects, say, begin(clock), campaign)
    found = searches.search(certain, passed if certain is cleaned else None)
    beside = [e for e in found.effects if e in found.after.density.oscillator.effects]
    if shared_effects(beside) and is_doubtful(found):
        say("comparing the recordings beside what is missing")
        doubtful = list(comparisons(certain, campaign, beside, values_of(found.after))) or doubtful
    if doubtful and is_doubtful(found) and may_be_simpler(doubtful, certain, found):
        found = _beside_faults(found, certain, doubtful, searches, search)
    elif certain is not cleaned and not proved and found.verdict not in OPEN:
        found = searches.again(found, lambda: cleaned, lambda other, _: is_complete(other))
    found = _without_needless_faults(found, cleaned, searches)
    found = _without_unfree_start(found, campaign, searches)
    undecided = found.corrected is not None and found.corrected.is_open
    return replace(found, verdict="ambiguous") if undecided and is_complete(found) else found


def _compared(cleaned: Corrected, as_read: Campaign, passed: Fit | None) -> tuple[Step, ...]:
    """`comparisons`, beside the high-pass of a fit where there is one."""
    if passed is None:
        return comparisons(cleaned, as_read)
    return comparisons(cleaned, as_read, passed.density.oscillator.effects, values_of(passed))


def _pushed(cleaned: Corrected, effects: Sequence[Effect]) -> tuple[Fault, ...]:
    """Starts that the equation of motion shows to be pushed, or held."""
    base = cleaned.identification.fit
    scales = campaign_scales(base)
    rested = [f.recording for f in cleaned.own if f.id == "recording_start"]
    pushed = pushed_starts(base, effects, scales)
    return pushed or (() if base_failed(base) else soft_releases(base, effects, scales, rested))


def _by_a_free_rest(cleaned: Corrected, as_read: Campaign, rng: np.random.Generator) -> Corrected:
    """A base fit that failed, or one without a forced start that does not: no search of physics
    about the former would mean anything.
    """
    starts = forced_starts(cleaned.identification.fit)
    if not starts:
        return cleaned
    rest = without_faults(cleaned, starts, as_read, rng=rng)
    return cleaned if base_failed(rest.identification.fit) else rest


def promised_gains(fit: Fit, effects: Sequence[Effect], *, rng: np.random.Generator) -> Array:
    """What single effects promise to gain over a base fit, nats, (E,); () where it is no fit."""
    if base_failed(fit):
        return np.zeros(0)
    found = scan(fit, effects, campaign_scales(fit), rng=rng)
    return np.array([score.gain for score in found.best()])


def gains_more_than(step: Step, fit: Fit, promised: float) -> bool:
    """Whether correcting faults gains more than `promised`, nats, by effects that are missing.

    Where physics is missing, recordings of different amplitude show it each in its own way.
    """
    last = step[-1]
    gained = log_likelihood_gain(fit.reduced_chi2, last.after, last.campaign)
    return base_failed(fit) or gained > SCORE_UNDERESTIMATE * promised + NEAR_MARGIN


def is_doubtful(found: Diagnosis) -> bool:
    """Whether what was found may be a fault of a recording: nothing that holds for all recordings
    alike explains them.

    Physics shows differently in recordings of different amplitude.
    """
    parameters = [p for e in found.effects for p in e.parameters]
    own = any(p.scope != "campaign" and not (p.circular or p.initial) for p in parameters)
    own = own or any(map(is_formula, found.effects))
    return own or not is_complete(found)


def unfinished(found: Diagnosis) -> Diagnosis:
    """The answer where the time was up before it was compared with another one."""
    verdict: Verdict = "ambiguous" if found.verdict == "named" else found.verdict
    return replace(found, verdict=verdict, selection=replace(found.selection, finished=False))


def _beside_faults(
    found: Diagnosis, before: Corrected, steps: Sequence[Step], searches: Searches, search: bool
) -> Diagnosis:
    """The answer, or a simpler one with further faults corrected; a settled one stays where these
    do nothing that its effects do.
    """

    def corrected() -> Corrected:
        return with_steps(before, steps, rng=searches.rng, search=search)

    if not is_complete(found) or not searches.budget.may_go_on():
        return searches.again(found, corrected, is_simpler)
    again = corrected()
    if not makes_idle(again, found):
        return found
    return searches.again(found, lambda: again, is_simpler)


def _without_needless_faults(found: Diagnosis, before: Corrected, searches: Searches) -> Diagnosis:
    """The answer without faults that comparing showed, where beside its effects all recordings
    agree as they were: had its physics been known, nothing would have been compared.
    """
    more = found.corrected is not None and len(found.corrected.compared) > len(before.compared)
    beside = [e for e in found.effects if e in found.after.density.oscillator.effects]
    if not (more and beside and is_complete(found)):
        return found
    fit = fitted_beside(before, beside, found.after)
    if fit is None or misfits(fit):
        return found
    first = None if any(map(is_formula, beside)) else fit  # a search finds formulas by itself
    return searches.again(found, lambda: before, is_simpler, first)


def _without_unfree_start(found: Diagnosis, as_read: Campaign, searches: Searches) -> Diagnosis:
    """Where much remains unexplained: the answer without first instants that keep a model from the
    rest, or that a force moved, if that leaves far less of it, or less open.
    """
    corrected, left = found.corrected, without_uncertain_formulas(found)
    if as_read.keep_faults or corrected is None:
        return found
    starts = unfree_starts(left) if is_large(left) else ()
    if not starts and found.verdict not in OPEN:
        starts = forced_starts(left)
    if not starts:
        return found

    def is_better(other: Diagnosis, found: Diagnosis) -> bool:
        far_less = BETTER * without_uncertain_formulas(other).reduced_chi2 < left.reduced_chi2
        return far_less or (found.verdict not in OPEN and is_simpler(other, found))

    return searches.again(
        found, lambda: without_faults(corrected, starts, as_read, rng=searches.rng), is_better
    )


def without_uncertain_formulas(found: Diagnosis) -> Fit:
    """The fit that is shown, or where it has a formula that is not named, the catalogue's alone."""
    effects = found.after.density.oscillator.effects
    known = {e.id for e in effects if not is_formula(e)}
    if len(known) == len(effects) or (found.formulas is not None and found.formulas.named):
        return found.after
    rest = [c.fit for c in found.selection.tried if set(c.ids) == known]
    return rest[0] if rest else found.before


def _of_corrected(
    corrected: Corrected,
    *,
    rng: np.random.Generator,
    effects: Sequence[Effect],
    progress: Progress,
    budget: Budget,
    first: Fit | None,
    as_read: Campaign,
) -> Diagnosis:
    """The diagnosis of a campaign whose faults are set aside or corrected."""
    for fault in corrected.faults:
        progress(f"set aside or corrected: {fault.recording}: {fault.statement} ({fault.id})")
    through = corrected.identification
    if corrected.filtered is not None:
        progress("the noise spectrum proves a filter: fitted through it")
    found = diagnose_fit(
        through, rng=rng, effects=effects, progress=progress, budget=budget, first=first
    )
    if found.selection.faults:
        corrected = with_faults(corrected, found.identification, found.selection.faults, as_read)
        through = found.identification
    if corrected.filtered is not None:
        campaign = through.fit.density.oscillator.campaign
        measurement = replace(campaign.measurement, smoothing=None)
        plain = identify(replace(campaign, measurement=measurement), rng=rng, search=False)
        found = with_smoothing(found, plain, corrected.filtered)
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
        before=identification.fit,
        effects=(SAVITZKY_GOLAY, *found.effects),
        location=found.location or whole_campaign(identification),
        filtered=filtered,
    )
