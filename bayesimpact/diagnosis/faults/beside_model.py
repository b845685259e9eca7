"""A gain or a clock of one recording that is off, as a model with physics in it tells.

Compared one by one, recordings tell such a fault by their own parameters (`together`). Where
physics is missing these differ anyhow, and each fit of its own may fail. A model of all recordings
that leaves little else tells it by what is left of them: to first order readings of a gain e^a are
off by a x, and those of a clock that runs fast by a factor e^a by -a t dx/dt. Each is a direction
of one recording, a score test (`projection`) gives its size and gain, and the mode with the
recording corrected says whether it is one.

Effects with a size of every recording's own can stand for it, so that models are asked without
these.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesimpact.diagnosis.faults.alone import has_own_size
from bayesimpact.diagnosis.faults.compare import LEAST, Compared, log_likelihood_gain
from bayesimpact.diagnosis.faults.correct import as_fault, corrected, factor
from bayesimpact.diagnosis.faults.together import CERTAIN, Hypothesis, Weighed
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import fit_from
from bayesimpact.diagnosis.score_test.directions import whitened
from bayesimpact.diagnosis.score_test.projection import project
from bayesimpact.diagnosis.selection.outcome import above_noise, leaves_something
from bayesimpact.diagnosis.thresholds import DECISIVE, EXCESS, LARGE
from bayesimpact.formula.law import is_formula
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.refitted import refitted

Array = NDArray[np.float64]

KINDS = ("recording_gain", "recording_clock")
ROUNDS = 3  # of a correction and what the mode with it says of its size
CONVERGED = 0.1  # standard errors of the size: less is no correction
TRIED = 2  # the likeliest one, and the one that it has to beat
LOST = 1e-6  # of a direction's size, that parameters leave of it: less is rounding
SLACK = 2.0  # times the misfit that may stay, that a score may promise: it is of first order


@dataclass(frozen=True, eq=False)
class _Guess:
    """A fault of one recording, its size with its error, and the nats that a score promises."""

    hypothesis: Hypothesis
    value: float
    sd: float
    gained: float

    @property
    def weighed(self) -> Weighed:
        """As comparing the recordings' own parameters would give it."""
        return Weighed(self.hypothesis, self.gained, value=self.value, sd=self.sd)


def fault_beside(base: Fit, found: Fit) -> tuple[Compared, Fit] | None:
    """The fault of a recording that explains what a model leaves, or what effects with a size of
    every recording's own do in it; and the mode of the other effects with that corrected. None
    where there is none.

    It must leave no large misfit, `EXCESS` times less of it than the model of the same effects, no
    more than `found`, and decisively less than the next one that its score promises as much of.
    """
    campaign = found.density.oscillator.campaign
    if campaign.keep_faults or len(campaign.recordings) < LEAST:
        return None
    shared = without_own(base, found)
    if shared is None or not leaves_something(shared):
        return None
    guesses = [g for g in _guesses(shared) if is_promised(shared, g.gained)][:TRIED]
    tried = [_refined(shared, g) for g in guesses]
    tried = [one for one in tried if np.isfinite(one[1].reduced_chi2)]
    tried.sort(key=lambda one: _left(*one))
    if not tried:
        return None
    best, fit = tried[0]
    before, after = shared.reduced_chi2, _left(best, fit)
    others = [log_likelihood_gain(_left(*other), after, campaign) for other in tried[1:]]
    nats = log_likelihood_gain(before, after, campaign)
    if nats < CERTAIN or min(others, default=np.inf) < DECISIVE or after > LARGE**2:
        return None
    left = above_noise(fit, after)
    if EXCESS * left > above_noise(shared) or left > above_noise(found):
        return None
    recording = campaign.recordings[best.hypothesis.recording]
    fault = as_fault(recording, best.weighed, nats, CERTAIN)
    return Compared(fault, fit.density.oscillator.campaign, before, after), fit


def without_own(base: Fit, found: Fit) -> Fit | None:
    """The model without effects of which every recording has a size of its own; None where it has
    a formula, or no other effect.
    """
    effects = found.density.oscillator.effects
    rest = [e for e in effects if not has_own_size(e)]
    if not rest or any(map(is_formula, rest)):
        return None
    if len(rest) == len(effects):
        return found
    values = dict(zip(found.names, map(float, found.mode), strict=True))
    return fit_from(base, rest, values, campaign_scales(base)).fit


def _left(guess: _Guess, fit: Fit) -> float:
    """Reduced chi-squared of the readings as they were: where a gain is corrected, their noise
    shrinks or grows with them, and a recording that is shrunk to nothing would leave none.
    """
    if guess.hypothesis.id != "recording_gain":
        return fit.reduced_chi2
    sizes = fit.density.likelihood.sizes
    share = float(sizes[guess.hypothesis.recording] / sizes.sum())
    return float(fit.reduced_chi2 * factor(guess.weighed) ** (-2 * share))


def is_promised(fit: Fit, gained: float) -> bool:
    """Whether nats that a score promises at the noise that a fit leaves, are what a fault must
    gain, or nearly.
    """
    independent = float(fit.density.likelihood.sizes.sum())
    left = fit.reduced_chi2 * (1.0 - 2 * gained / independent)
    most = min(above_noise(fit) / EXCESS, LARGE**2 - 1.0)
    return gained > CERTAIN and left - 1.0 < SLACK * most


def _guesses(fit: Fit) -> list[_Guess]:
    """Every gain and every clock of one recording, the one that promises most first."""
    recordings = fit.density.oscillator.campaign.recordings
    kinds = KINDS if all(r.input is None for r in recordings) else KINDS[:1]
    every = [Hypothesis(kind, r) for r in range(len(recordings)) for kind in kinds]
    found = project(fit, _directions(fit, every))
    information = np.diag(found.information)
    seen = np.flatnonzero((information > 0.0) & (found.kept > LOST))
    guesses = [
        _Guess(
            every[i],
            float(found.score[i] / information[i]),
            float(information[i] ** -0.5),
            float(0.5 * found.score[i] ** 2 / information[i]),
        )
        for i in seen
    ]
    return sorted(guesses, key=lambda g: -g.gained)


def _directions(fit: Fit, faults: Sequence[Hypothesis]) -> list[Array]:
    """What readings change by per unit of every fault, whitened, (n_r, K) per recording."""
    found = []
    rows = zip(fit.density.oscillator.campaign.recordings, fit.predicted, strict=True)
    for r, (recording, predicted) in enumerate(rows):
        part = np.zeros((len(faults), recording.samples.size))
        for k, fault in enumerate(faults):
            if fault.recording == r and fault.id == "recording_gain":
                part[k] = recording.samples
            elif fault.recording == r:
                times = recording.interval * np.arange(recording.samples.size)
                part[k] = -times * np.gradient(predicted, recording.interval)
        found.append(part)
    return [white.T for white in whitened(fit, found)]


def _refined(fit: Fit, guess: _Guess) -> tuple[_Guess, Fit]:
    """The fault with the size at which the mode asks for no other one, and that mode."""
    hypothesis, whole = guess.hypothesis, fit.density.oscillator.campaign
    value, sd, further, now = guess.value, guess.sd, 0.0, fit
    for _ in range(ROUNDS):
        value += further
        step = Weighed(hypothesis, guess.gained, value=value, sd=sd)
        now = refitted(now, corrected(whole, hypothesis.recording, step))
        left = project(now, _directions(now, [hypothesis]))
        information = float(left.information[0, 0])
        if not (np.isfinite(now.reduced_chi2) and information > 0.0):
            break
        further, sd = float(left.score[0]) / information, information**-0.5
        if abs(further) < CONVERGED * sd:
            break
    return _Guess(hypothesis, value, sd, guess.gained), now
