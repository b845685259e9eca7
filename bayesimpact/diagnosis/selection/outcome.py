"""What a selection found: models, their odds, rivals, and whether anything is left.

A hypothesis is a set of effects of the catalogue and at most one residual force. All are compared
by the same log posterior odds: log evidence, less the price of multiplicity for every effect and
for the residual force. While the search goes on, likelihoods are counted once per independent
sample of the best residual. Where it ends with something left that a force of time describes,
every hypothesis has such a force beside it (`discrepancy`): what a model leaves is then no noise,
and many samples are no evidence by themselves.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from bayesimpact.data.short_repr import short_repr
from bayesimpact.diagnosis.faults.compare import Compared
from bayesimpact.diagnosis.measurement.whiteness import whiteness_p
from bayesimpact.diagnosis.refits.refit import Candidate, tempered_evidence
from bayesimpact.diagnosis.residual_force.discrepancy import Discrepancy
from bayesimpact.diagnosis.residual_force.gaussian_process import MissingForce
from bayesimpact.diagnosis.score_test.scan import Scan
from bayesimpact.diagnosis.thresholds import (
    ALPHA,
    DECISIVE,
    DOUBT,
    EXCESS,
    LARGE,
    largest_log_odds,
)
from bayesimpact.formula.law import kind_id
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.noise.whitening import Noise


@dataclass(frozen=True, eq=False)
class ExaminedModel:
    """One model on the way, and whether anything is missing from it.

    Attributes
    ----------
    candidate : the model
    scan : scores of everything it lacks
    force : the force of displacement and velocity that it leaves unexplained
    drift : the change of stiffness and damping with time that it leaves unexplained
    colour_p : of what it leaves above the noise, see `colour_p`
    """

    candidate: Candidate
    scan: Scan
    force: MissingForce
    drift: MissingForce
    colour_p: float = 1.0

    __repr__ = short_repr

    @property
    def is_white(self) -> bool:
        """True when neither the catalogue nor an unknown force explains anything more, and what is
        left above the noise is not of one colour.

        What remains needs decisive odds as every name does: each model on the way is tested anew,
        one in a hundred has a small p-value by chance, and where the noise of an instrument is not
        quite what is assumed of it, more.
        """
        forces = (self.force, self.drift)
        least = min(self.scan.p_value, self.colour_p)
        if largest_log_odds(least) >= DECISIVE:
            return False
        return not any(f.log_evidence >= DECISIVE and f.p_value < ALPHA for f in forces)

    @property
    def unknown(self) -> MissingForce:
        """The likelier one of both free forces."""
        return max(self.force, self.drift, key=lambda f: f.log_evidence)


@dataclass(frozen=True, eq=False)
class Selection:
    """The outcome of the selection.

    Attributes
    ----------
    base, chosen : first and last model
    tried : every model that was fitted, likeliest first
    prior_cost : nats per added effect and per residual force
    repetition : samples per independent one in the best model's residual
    contact : force in contact alone that the base model leaves unexplained, or None
    contact_odds : its log evidence over the base model when it is fitted with the parameters, where
        many chosen effects may imitate it
    examined_models : every model that was examined, by its ids
    residual : models with a residual force beside their effects, fitted in full, by the ids of
        these effects; where something remains beside the chosen model
    finished : False when the budget ended the search, or left none for another one that may say
        otherwise
    beside : the force of time beside every model; None where nothing remains, or something that
        is no force of time
    own : the force of time that the chosen model leaves; None where nothing remains, or a motion
        that none could change
    apart : standard deviations of every chosen effect's size from none at all, with what the
        remainder may have done to it in them (`discrepancy`); empty where nothing remains
    power : of the force of time that models leave about the motion's own frequencies, N2, by their
        ids: the chosen one and those without an effect that may be needed
    faults : of readings and recordings that only a model which left little else showed, set aside
        or corrected
    band_limited : inputs are taken for that between their samples, as a good model asked for
    """

    base: ExaminedModel
    chosen: ExaminedModel
    tried: tuple[Candidate, ...]
    prior_cost: float
    repetition: float = 1.0
    contact: MissingForce | None = None
    contact_odds: float = -np.inf
    examined_models: Mapping[frozenset[str], ExaminedModel] = field(default_factory=dict)
    residual: Mapping[frozenset[str], Candidate] = field(default_factory=dict)
    finished: bool = True
    beside: Discrepancy | None = None
    own: Discrepancy | None = None
    apart: Mapping[str, float] = field(default_factory=dict)
    power: Mapping[frozenset[str], float] = field(default_factory=dict)
    faults: tuple[Compared, ...] = ()
    band_limited: bool = False

    __repr__ = short_repr

    @property
    def unknown(self) -> MissingForce:
        """The likeliest free force that the base model leaves out."""
        forces = [self.base.unknown, *([self.contact] if self.contact else [])]
        return max(forces, key=lambda f: f.log_evidence)

    def log_odds(self, candidate: Candidate) -> float:
        """Log posterior odds of a model against the base model."""
        own, base = self._evidence(candidate), self._evidence(self.base.candidate)
        return own - base - candidate.price(self.prior_cost)

    def _evidence(self, candidate: Candidate) -> float:
        if self.beside is None:
            return tempered_evidence(candidate, self.repetition)
        if not np.isfinite(candidate.log_evidence):
            return candidate.log_evidence
        alone = candidate.log_evidence
        return alone + self.beside.log_evidence_gain(candidate.fit, alone)

    def goal(self, least: float) -> float:
        """Log likelihood that a model must reach for log odds of `least`: no evidence is above the
        largest likelihood. Only as long as no force of time stands beside every model.
        """
        return self.repetition * (least + self._evidence(self.base.candidate))

    def promise(self, candidate: Candidate) -> float:
        """Log posterior odds with every sample counted, up to a constant: how much is explained."""
        return candidate.log_evidence - candidate.price(self.prior_cost)

    def rivals(self) -> tuple[Candidate, ...]:
        """Models that lack a chosen effect and come within the decisive odds, likeliest first.

        One with more effects must be the likelier one: two effects imitate a third more often than
        the price of an effect allows for.
        """
        chosen = self.chosen.candidate
        reached = self.log_odds(chosen)
        found = (
            c
            for c in self.tried
            if self.log_odds(c) > reached - DECISIVE * (len(c.effects) <= len(chosen.effects))
            and not set(chosen.ids) <= set(c.ids)
            and not _is_elaboration(c, chosen)
        )
        return tuple(sorted(found, key=self.log_odds, reverse=True))

    @property
    def force_log_odds(self) -> float:
        """Log odds of one free force in the place of all effects against the base model.

        Where the chosen effects leave nothing, no force can gain more than they do, whatever the
        linearised problem promises. Many effects that may imitate one force in contact are compared
        with that force as it was fitted.
        """
        force, chosen = self.base.unknown, self.chosen.candidate
        evidence = force.log_evidence
        if self.chosen.is_white:
            reached = chosen.fit.log_likelihood - self.base.candidate.fit.log_likelihood
            evidence -= max(0.0, force.gain - reached - DECISIVE)
        return max(evidence / self.repetition, self.contact_odds) - self.prior_cost

    def prefers_learned_force(self) -> bool:
        """True when one free force beats the chosen effects decisively.

        An effect that imitates a force outside the catalogue loses to that force.
        """
        return self.force_log_odds > self.log_odds(self.chosen.candidate) + DECISIVE

    def with_residual_force(self, ids: frozenset[str]) -> float:
        """Log odds of a model, with a residual force beside its effects where that is likelier."""
        alone = [self.log_odds(c) for c in self.tried if frozenset(c.ids) == ids]
        beside = self.residual.get(ids)
        if beside is not None:  # the residual force counts as one of its effects
            alone.append(self.log_odds(beside))
        return max(alone, default=-np.inf)

    def probability(self, effect_id: str) -> float:
        """Probability that an effect, or one that reduces to it, is part of the model, over all
        models tried.
        """
        odds = np.array([self.log_odds(c) for c in self.tried])
        weight = np.exp(odds - odds.max())
        own = kind_id(effect_id)
        kinds = [{k for e in c.effects for k in (kind_id(e.id), e.prefer)} for c in self.tried]
        have = np.array([own in known for known in kinds])
        return float(weight[have].sum() / weight.sum())


def is_large(fit: Fit) -> bool:
    """True when the residual dwarfs the noise."""
    return fit.reduced_chi2 > LARGE**2


def explains_most(found: Candidate, of: Candidate) -> bool:
    """Whether a model leaves less of a large misfit than an imitation would, and no large one."""
    if not is_large(of.fit) or is_large(found.fit) or not np.isfinite(found.log_evidence):
        return False
    return EXCESS * found.fit.reduced_chi2 < of.fit.reduced_chi2


def colour_p(candidate: Candidate) -> float:
    """p-value that readings which are off a model with effects by more than their noise are off
    independently of one another: else its effects stand for something that no force is.

    1 for the base model, which names nothing, and behind a filter, which colours what it leaves.
    """
    fit = candidate.fit
    if not (candidate.effects and leaves_something(fit)):
        return 1.0
    return 1.0 if fit.density.likelihood.noise.smoothing is not None else whiteness_p(fit)


def leaves_something(fit: Fit) -> bool:
    """Whether a residual is above the noise by more than the estimate of the noise is uncertain."""
    return is_more_than_noise(fit.reduced_chi2, fit.density.likelihood.noise)


def above_noise(fit: Fit, chi2: float | None = None) -> float:
    """Reduced chi-squared, that of a fit or another one, above that of the noise, or what that is
    uncertain by.
    """
    error = fit.density.likelihood.noise.level_error
    left = fit.reduced_chi2 if chi2 is None else chi2
    return max(left - 1.0, 2 * DOUBT * (error if np.isfinite(error) else 0.0))


def is_more_than_noise(reduced_chi2: float, noise: Noise) -> bool:
    """Whether a misfit is above the noise by more than the estimate of that is uncertain."""
    error = noise.level_error
    return reduced_chi2 > 1.0 + 2 * DOUBT * (error if np.isfinite(error) else 0.0)


def leaves_far_more(selection: Selection, fit: Fit) -> bool:
    """Whether a fit leaves `EXCESS` times as much misfit as the chosen model."""
    with_it = misfit_above_noise(selection, selection.chosen.candidate.fit)
    return misfit_above_noise(selection, fit) > EXCESS * with_it


def misfit_above_noise(selection: Selection, fit: Fit) -> float:
    """Sum of squares beyond that of the noise, in units of its variance.

    The noise's own sum is what the recordings' noise estimate says, as far as that is certain;
    within its uncertainty it is what the best hypothesis of all leaves.
    """
    chosen = selection.chosen.candidate.fit
    level = chosen.density.likelihood.noise.level**2
    own = float(chosen.density.likelihood.sizes.sum())
    left = float(chosen.sums.sum()) / level
    if left - own < doubtful_misfit(selection):  # as small as the noise's estimate is uncertain
        own = left - 2 * max(selection.chosen.unknown.gain, 0.0) * chosen.reduced_chi2
    return max(float(fit.sums.sum()) / level - own, 1.0)


def doubtful_misfit(selection: Selection) -> float:
    """A sum of squares, in units of the noise's variance, that its estimate may be wrong by."""
    likelihood = selection.chosen.candidate.fit.density.likelihood
    error = likelihood.noise.level_error
    return 2 * DOUBT * (error if np.isfinite(error) else 0.0) * float(likelihood.sizes.sum())


def _is_elaboration(candidate: Candidate, chosen: Candidate) -> bool:
    """True when the candidate only refines the chosen model (`Effect.prefer`)."""
    extra = [e for e in candidate.effects if e.id not in chosen.ids]
    return bool(extra) and all(e.prefer in chosen.ids for e in extra)
