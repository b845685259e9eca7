"""A gain that changes in mid-record: from one sample on, readings are larger or smaller.

A range that is switched, a loose connector or a probe that was knocked multiply all later readings.
Against a model with the physics in it that is one more column of one recording, its readings from a
sample on (see `change_point`), whose score proposes the place and the size. What it proposes is
then done: the later readings are divided by the step, the place is where readings as they were
begin to fit worse than these, and the campaign has to fit.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.faults.fault import FALSE_ALARM, Fault, file_time
from bayesimpact.data.gaps import without
from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.faults.beside_model import is_promised
from bayesimpact.diagnosis.faults.change_point import (
    change_scores,
    change_window,
    parameter_basis,
)
from bayesimpact.diagnosis.faults.compare import Compared, log_likelihood_gain
from bayesimpact.diagnosis.faults.correct import percent_off
from bayesimpact.diagnosis.faults.together import CERTAIN
from bayesimpact.diagnosis.selection.outcome import above_noise, leaves_something
from bayesimpact.diagnosis.thresholds import EXCESS, LARGE
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.refitted import refitted

PLACE = 0.5 * float(chi2.isf(1e-3, 1))  # nats: less likely places than this are no candidates
NEAR = 2  # samples beside these: switching takes its time
ROUNDS = 5  # of a correction, and what the mode with it says of its size and place
CONVERGED = 0.1  # standard errors of the size: less is no correction


@dataclass(frozen=True)
class GainStep:
    """From a sample on, readings of a recording are e^value times what they were before.

    Attributes
    ----------
    recording : its position in the campaign
    place : first sample after the step, the likeliest
    earliest, latest : between which it lies
    value, sd : logarithm of the step, with its standard error
    promised : nats, by its score at the noise that is left without it
    """

    recording: int
    place: int
    earliest: int
    latest: int
    value: float
    sd: float
    promised: float


def gain_step_beside(found: Fit) -> tuple[Compared, Fit] | None:
    """The change of a gain that explains what a model leaves, and the mode of the model with the
    later readings corrected; None where there is none.

    It must leave no large misfit, and `EXCESS` times less than the model without it.
    """
    campaign = found.density.oscillator.campaign
    if campaign.keep_faults or not leaves_something(found):
        return None
    step = _likeliest(found)
    if step is None or not is_promised(found, step.promised):
        return None
    refined = _refined(found, step)
    if refined is None:
        return None
    step, fit = refined
    after = _left(fit, step)
    nats = log_likelihood_gain(found.reduced_chi2, after, campaign)
    enough = EXCESS * above_noise(fit, after) <= above_noise(found)
    if nats < CERTAIN or after > LARGE**2 or not enough:
        return None
    fault = _fault(campaign.recordings[step.recording], step, nats)
    corrected = fit.density.oscillator.campaign
    return Compared(fault, corrected, found.reduced_chi2, after), fit


def _likeliest(fit: Fit) -> GainStep | None:
    """The step that explains most of what a fit leaves, by its score; None where none gains what
    white noise reaches at one of the samples with a chance of `FALSE_ALARM`.
    """
    noise, bases = fit.density.likelihood.noise, parameter_basis(fit)
    power, count = float(fit.sums.sum()), float(fit.density.likelihood.sizes.sum())
    best, most = None, 0.0
    for r, recording in enumerate(fit.density.oscillator.campaign.recordings):
        scores = change_scores(fit, r, recording.samples, bases)
        begin, end = (max(edge - scores.first, 0) for edge in change_window(fit, r))
        explained = scores.explained[:end]
        explained[:begin] = 0.0
        place = int(np.argmax(explained)) if explained.size else 0
        nats = 0.5 * explained[place] / noise.level**2 if explained.size else 0.0
        if nats <= max(most, 0.5 * chi2.isf(FALSE_ALARM / recording.samples.size, 1)):
            continue
        size, at = float(scores.size[place]), place + scores.first
        value = float(scores.slope[place]) / size
        sd = float(np.sqrt((power - explained[place]) / count / size))
        promised = float(0.5 * count * explained[place] / power)
        best, most = GainStep(r, at, at, at, value, sd, promised), float(nats)
    return best


def _refined(fit: Fit, step: GainStep) -> tuple[GainStep, Fit] | None:
    """The step with the size and place at which the mode asks for no other ones, and that mode;
    None where that would leave too few readings, or no fit.
    """
    whole, now, r = fit.density.oscillator.campaign, fit, step.recording
    for _ in range(ROUNDS):
        try:
            now = refitted(now, _corrected(whole, step))
        except ValueError:  # it may lie nearly anywhere
            return None
        corrected = now.density.oscillator.campaign.recordings[r]
        scores = change_scores(now, r, corrected.samples, parameter_basis(now))
        place = step.place - scores.first
        if not (np.isfinite(now.reduced_chi2) and 0 <= place < scores.size.size):
            return None
        size = float(scores.size[place])
        if not size > 0.0:
            return None
        further = float(scores.slope[place]) / size
        sd = float(np.sqrt(now.sums.sum() / now.density.likelihood.sizes.sum() / size))
        moved = _placed(now, whole.recordings[r], replace(step, value=step.value + further, sd=sd))
        if moved.place == step.place and abs(further) < CONVERGED * sd:
            break
        step = moved
    return step, now


def _placed(fit: Fit, recording: Recording, step: GainStep) -> GainStep:
    """The step where readings as they were begin to fit worse than corrected ones."""
    noise, predicted = fit.density.likelihood.noise, fit.predicted[step.recording]
    both = np.stack([recording.samples, recording.samples * np.exp(-step.value)]) - predicted
    signals, start = noise.in_time(
        noise.whitened(recording, both), recording.samples.size, recording.interval, recording.used
    )
    before, after = 0.5 * np.square(signals) / float(fit.reduced_chi2 * noise.level**2)
    lost = np.cumsum(np.append(0.0, before - after)[:-1])  # nats, by a step at every sample
    first = round(start / recording.interval)
    begin, end = (max(edge - first, 0) for edge in change_window(fit, step.recording))
    lost[:begin] = lost[end:] = np.inf
    near = np.flatnonzero(lost < lost.min() + PLACE)
    if not near.size:
        return step
    earliest, place, latest = (first + int(i) for i in (near[0], np.argmin(lost), near[-1]))
    return replace(step, place=place, earliest=earliest, latest=latest)


def _corrected(campaign: Campaign, step: GainStep) -> Campaign:
    """The campaign with the later readings as the earlier ones are, without those where the step
    may lie. Raises `ValueError` when less than a fifth of the readings would be left.
    """
    recordings = list(campaign.recordings)
    recording = recordings[step.recording]
    samples = recording.samples.copy()
    samples[step.place :] *= np.exp(-step.value)
    spans = [(step.earliest - NEAR, step.latest + NEAR)]
    recordings[step.recording] = without(replace(recording, samples=samples), spans)
    return replace(campaign, recordings=tuple(recordings))


def _left(fit: Fit, step: GainStep) -> float:
    """Reduced chi-squared of the readings as they were, whose noise shrinks or grows with them."""
    later = fit.density.oscillator.campaign.recordings[step.recording].samples.size - step.place
    total = float(fit.density.likelihood.sizes.sum())
    return float(fit.reduced_chi2 * np.exp(2 * step.value * later / total))


def _fault(recording: Recording, step: GainStep, nats: float) -> Fault:
    """The step as a record; its remedy keeps the longer part."""
    size = recording.samples.size
    if step.earliest >= size - step.latest:
        remedy = f"end_s = {file_time(recording, step.earliest - NEAR - 0.6):.9g}"
    else:
        remedy = f"start_s = {file_time(recording, step.latest + NEAR - 0.4):.9g}"
    when, by = file_time(recording, step.place), float(np.expm1(step.value))
    return Fault(
        id="recording_gain",
        recording=recording.name,
        spans=((step.earliest - NEAR, size),),
        start_s=file_time(recording, step.earliest - NEAR),
        end_s=file_time(recording, size - 1),
        size=100 * by,
        unit="%",
        statement=f"from {when:.4g} s on its readings are {percent_off(by, step.sd)} off those "
        "before: the gain of the probe changed",
        remedy=remedy,
        strength=nats,
        threshold=CERTAIN,
        action="notice",
        false_alarm=float(np.exp(-CERTAIN)),
        error=100 * (1 + by) * step.sd,
    )
