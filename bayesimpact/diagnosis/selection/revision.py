"""A revised search, on what a model that is nearly good enough has shown of the readings.

Spikes beside a contact, the instants at which contacts begin and end, where an acceleration jumps,
a gain or a clock that is off, a gain that changes, a knock, noise that is slow, and what an input
did between its samples show only against a model that leaves little else. Before they are known,
what follows them is fitted.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.diagnosis.faults.beside_model import fault_beside, without_own
from bayesimpact.diagnosis.faults.changes import changes_beside
from bayesimpact.diagnosis.faults.compare import Compared, log_likelihood_gain
from bayesimpact.diagnosis.faults.outliers import beside_spikes
from bayesimpact.diagnosis.measurement.growing_noise import growing_noise
from bayesimpact.diagnosis.measurement.input_noise import input_noise
from bayesimpact.diagnosis.measurement.slow_noise import remaining_noise
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import fit_from
from bayesimpact.diagnosis.score_test.directions import is_periodic, is_steady
from bayesimpact.diagnosis.selection.models import Progress
from bayesimpact.diagnosis.selection.outcome import ExaminedModel, is_large, leaves_something
from bayesimpact.diagnosis.selection.unknown import with_free_force
from bayesimpact.diagnosis.thresholds import DECISIVE
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.inference.onsets import without_onsets
from bayesimpact.inference.refitted import refitted

Array = NDArray[np.float64]

MOST = 12  # things that are off, each told once but for recordings: set by hand
JUMP = 2.0  # of the noise: a reading on the wrong side of one costs 2 nats, half its square


@dataclass(frozen=True, eq=False)
class Revision:
    """A revised search: from which base model, from which other one if any, without what; and
    whether inputs are taken for band-limited.
    """

    base: Fit
    first: Fit | None
    faults: tuple[Compared, ...] = ()
    band_limited: bool = False

    @property
    def found(self) -> Fit:
        """The model from which it begins."""
        return self.base if self.first is None else self.first

    def followed_by(self, other: Revision) -> Revision:
        """Another revision, made on this one's."""
        return replace(
            other,
            faults=(*self.faults, *other.faults),
            band_limited=self.band_limited or other.band_limited,
        )


def revised(
    base: Fit, examined: ExaminedModel, say: Progress, told: Revision | None = None
) -> Revision | None:
    """The search without the readings that spoil it, with recordings corrected, with the inputs
    between their samples that a model asks for, under the noise of its inputs and the slow one that
    is all that it leaves; None where there is nothing of these.

    Several may be off at once: each is asked of the model with what was `told` before it.
    """
    found = examined.candidate.fit
    begun = Revision(base, None if found is base else found)
    revision = told or begun
    steps = () if examined.is_white and found is base else READINGS
    steps = (*steps, _under_noise_of_inputs, *([] if examined.is_white else [_under_slow_noise]))
    for _ in range(MOST):
        asked = (step(revision.base, revision.found, say) for step in steps)
        other = next((one for one in asked if one is not None), None)
        if other is None:
            break
        revision = revision.followed_by(other)
    return None if revision is begun else revision


def _under_noise_of_inputs(base: Fit, found: Fit, say: Progress) -> Revision | None:
    """Under the noise of the inputs that a model tells."""
    return _under(base, found, _of_inputs(base, found), "the noise of the input matters", say)


def _under_slow_noise(base: Fit, found: Fit, say: Progress) -> Revision | None:
    """Under the slow noise that is all that a model leaves."""
    noise = None if is_large(found) else remaining_noise(found)
    return _under(base, found, noise, "what remains is slow noise", say)


def _under_growing_noise(base: Fit, found: Fit, say: Progress) -> Revision | None:
    """Under noise that grows with the motion, which is all that a model leaves."""
    noise = None if is_large(found) else growing_noise(found)
    return _under(base, found, noise, "what remains is noise that grows with the motion", say)


def _under(base: Fit, found: Fit, noise: Noise | None, what: str, say: Progress) -> Revision | None:
    if noise is None:
        return None
    say(f"{what}: once more under that")
    first = refitted(found, noise=noise) if found is not base else None
    return Revision(refitted(base, noise=noise), first)


def _of_inputs(base: Fit, found: Fit) -> Noise | None:
    """The noise of the inputs that a model tells; where the base model could, it has it already."""
    return input_noise(found) if is_large(base) and not is_large(found) else None


def _with_a_recording_corrected(base: Fit, found: Fit, say: Progress) -> Revision | None:
    """With the gain or the clock of one recording corrected that the model shows to be off, unless
    a force that all recordings share explains as much.
    """
    told = fault_beside(base, found)
    if told is None:
        return None
    compared, first = told
    shared = without_own(base, found)
    campaign = found.density.oscillator.campaign
    free = np.inf if shared is None else with_free_force(shared).reduced_chi2
    if log_likelihood_gain(free, compared.after, campaign) < DECISIVE:
        return None
    say(f"{compared.fault.recording}: {compared.fault.statement}: once more with that corrected")
    return Revision(refitted(base, compared.campaign), first, (compared,))


def _without_a_change(base: Fit, found: Fit, say: Progress) -> Revision | None:
    """With the change of a gain in mid-record corrected that the model shows, or without what lies
    beyond knocks, unless a force that all recordings share leaves nothing: of several changes one
    is told at a time, so that another explanation may leave less than it does.
    """
    told = changes_beside(base, found)
    if told is None:
        return None
    compared, plain, first = told
    if not leaves_something(with_free_force(found)):
        return None
    for one in compared:
        say(f"{one.fault.recording}: {one.fault.statement}: once more with that put right")
    return Revision(plain, None if found is base else first, compared)


def _with_band_limited_inputs(base: Fit, found: Fit, say: Progress) -> Revision | None:
    """With inputs that are band-limited between their samples, not lines, where that explains
    decisively more, or as much as a steady force: the change is small, and tells nothing beside a
    large misfit.
    """
    other = None if is_large(found) else band_limited(found)
    if other is None:
        return None
    better = other.log_posterior > found.log_posterior + DECISIVE
    first = other if better else without_lines(base, found)
    if first is None:
        return None
    say("inputs are band-limited between their samples: once more with these")
    if not first.density.oscillator.effects:
        return Revision(first, None, band_limited=True)
    smooth = refitted(base, first.density.oscillator.campaign)
    return Revision(smooth, first, band_limited=True)


def without_lines(base: Fit, found: Fit) -> Fit | None:
    """A model without its steady lines, with inputs that are band-limited between their samples;
    None where it has none, or fits decisively worse: what lines between samples take from a steady
    input, a force of its frequency would give back.
    """
    effects = found.density.oscillator.effects
    rest = [e for e in effects if not (is_periodic(e) and is_steady(e))]
    if len(rest) == len(effects):
        return None
    values = dict(zip(found.names, map(float, found.mode), strict=True))
    plain = fit_from(base, rest, values, campaign_scales(base)).fit if rest else base
    other = band_limited(plain)
    if other is None or other.log_likelihood < found.log_likelihood - DECISIVE:
        return None
    return other


def band_limited(fit: Fit) -> Fit | None:
    """The model's mode with inputs that are band-limited between their samples; None where there
    are none that are not, or lines between them are stated.
    """
    campaign = fit.density.oscillator.campaign
    inputs = [r.input for r in campaign.recordings if r.input is not None]
    if all(given.band_limited or given.lines_stated for given in inputs):
        return None
    recordings = [
        replace(r, input=replace(r.input, band_limited=True))
        if r.input and not r.input.lines_stated
        else r
        for r in campaign.recordings
    ]
    return refitted(fit, replace(campaign, recordings=tuple(recordings)))


def _without_readings(base: Fit, found: Fit, say: Progress) -> Revision | None:
    """Without spikes that are all that a model leaves, and without accelerations at the onsets that
    it shows, which a base fit with a large misfit has elsewhere. As long as such a reading lies on
    the wrong side of its jump, it may look like a spike.
    """
    spikes, clean = beside_spikes(found) or ((), found)
    change = found.reduced_chi2, clean.reduced_chi2
    told = tuple(Compared(f, clean.density.oscillator.campaign, *change) for f in spikes)
    gained = not spikes and clean.log_posterior > found.log_posterior + DECISIVE
    if misses_onsets(clean):
        clean = refitted(found, without_onsets(clean), start=clean)
    campaign = clean.density.oscillator.campaign
    is_same = campaign is found.density.oscillator.campaign
    if is_same and not gained:
        return None
    say("readings that only a good model shows to be off: once more without them")
    if found is base:
        return Revision(clean, None, told)
    return Revision(base if is_same else refitted(base, campaign), clean, told)


READINGS = (
    _under_growing_noise,
    _without_readings,
    _with_a_recording_corrected,
    _without_a_change,
    _with_band_limited_inputs,
)


def first_revision(base: Fit, found: Fit, say: Progress) -> Revision | None:
    """The first thing that is off and only a model as good as this one shows, of readings or of an
    input's: what is fitted to these decides nothing. None where there is none.
    """
    steps = [_under_growing_noise, _without_readings, _under_noise_of_inputs]
    if found is not base:
        steps.append(_with_a_recording_corrected)  # before a knock, which halves a clock's misfit
    steps.append(_without_a_change)
    told = (step(base, found, say) for step in steps)
    return next((one for one in told if one is not None), None)


def misses_onsets(fit: Fit) -> bool:
    """Whether accelerations count, beside a fit that leaves no large misfit, at onsets that it
    shows to jump by more than the noise. No residual tells: parameters that such a reading has bent
    until it stands on its side of the jump leave none.
    """
    campaign = fit.density.oscillator.campaign
    cleaned = campaign if is_large(fit) else without_onsets(fit)
    noise = fit.density.likelihood.noise
    rows = zip(campaign.recordings, cleaned.recordings, fit.predicted, strict=True)
    for before, after, predicted in rows:
        if after.used is not None and after is not before:
            at = ~after.used if before.used is None else before.used & ~after.used
            least = JUMP * noise.level * noise.scales[before.order]
            if np.any(_jumps(predicted)[at] > least):
                return True
    return False


def _jumps(x: Array) -> Array:
    """By how much samples (n,) jump before or behind each: a step between them beyond those on
    either side, which no mere change of slope takes.
    """
    steps = np.diff(x)
    beside = np.pad(steps, 1, mode="edge")
    least, most = np.minimum(beside[:-2], beside[2:]), np.maximum(beside[:-2], beside[2:])
    alone = np.maximum(np.maximum(steps - most, least - steps), 0.0)
    return np.asarray(np.maximum(np.append(0.0, alone), np.append(alone, 0.0)))
