"""Odds of the models of a search, and which effects may still matter."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayesimpact.diagnosis.candidates.promising import refit_candidates
from bayesimpact.diagnosis.measurement.repetition import residual_repetition
from bayesimpact.diagnosis.refits.refit import (
    LITTLE,
    Candidate,
    Enough,
    grown,
    in_words,
    tempered_evidence,
)
from bayesimpact.diagnosis.residual_force.discrepancy import Discrepancy, discrepancy
from bayesimpact.diagnosis.score_test.directions import is_periodic
from bayesimpact.diagnosis.score_test.scan import Scan
from bayesimpact.diagnosis.score_test.scores import Score
from bayesimpact.diagnosis.selection.models import UNCONVERGED_SHORTFALL, Models
from bayesimpact.diagnosis.selection.outcome import ExaminedModel, is_large, leaves_something
from bayesimpact.diagnosis.thresholds import DECISIVE
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect
from bayesimpact.model.effects.harmonic_forcing import EFFECT as HARMONIC_FORCING

MOST_EFFECTS = 3
MOST_LARGE = 5  # where the base misfit is large: several strong effects act at once
# Nats by which an effect alone must fall behind the base model to be given up: more than five times
# `DECISIVE`, for beside others it may still be right, and trying it costs one refit.
CONTRADICTED = 30.0


class Ranked(Models):
    """Models with their odds."""

    @property
    def cost(self) -> float:
        """Nats per added effect, for multiplicity."""
        return float(np.log(2 * len(self.effects)))

    @property
    def is_large(self) -> bool:
        """Whether the base model's misfit is large."""
        return is_large(self.examined_models[frozenset()].candidate.fit)

    @property
    def most(self) -> int:
        """Effects of a model."""
        return MOST_LARGE if self.is_large else MOST_EFFECTS

    def promise(self, candidate: Candidate) -> float:
        """A model's log posterior odds on the way: every sample counts, for what remains may yet be
        explained, and so may a line that is refused as long as something does, where the equation
        of motion asked for it.
        """
        evidence, lines = candidate.log_evidence, [e for e in candidate.effects if is_periodic(e)]
        asked = self.is_driven and [e.id for e in lines] == [HARMONIC_FORCING.id]
        if asked and candidate.refused is not None:
            evidence = candidate.refused
        return evidence - candidate.price(self.cost)

    def log_odds(self, candidate: Candidate) -> float:
        """Log posterior odds up to a constant: beside the force of time that remains where one does
        (`weigh_remainder`), else each independent sample counted once.
        """
        if self.left is None or not np.isfinite(candidate.log_evidence):
            return self.tempered_odds(candidate)
        alone = candidate.log_evidence
        gained = self.left.log_evidence_gain(candidate.fit, alone)
        return alone + gained - candidate.price(self.cost)

    def tempered_odds(self, candidate: Candidate) -> float:
        """Log posterior odds up to a constant, each independent sample counted once."""
        evidence = tempered_evidence(candidate, self.repetition())
        return evidence - candidate.price(self.cost)

    def weigh_remainder(self) -> None:
        """From now on models are compared beside what the nearest one leaves, where the misfit was
        large and that is a force of time: many samples of it are no evidence by themselves.
        """
        nearest = min(self.tried.values(), key=lambda c: c.fit.reduced_chi2).fit
        left = self.remainder(nearest) if self.is_large and leaves_something(nearest) else None
        self.left = left if left is not None and left.leaves_noise else None

    def remainder(self, fit: Fit) -> Discrepancy | None:
        """The force of time that a fit leaves; that of the last one asked for is kept."""
        if self.last is None or self.last[0] is not fit:
            self.last = fit, discrepancy(fit)
        return self.last[1]

    def repetition(self) -> float:
        """Samples per independent one in the residual of the best model so far."""
        best = min(self.tried.values(), key=lambda c: c.fit.reduced_chi2)
        if self.repeated is None or self.repeated[0] is not best:
            self.repeated = best, residual_repetition(best.fit)
        return self.repeated[1]

    def leads_on(self, examined: ExaminedModel, larger: Candidate) -> bool:
        """Whether a larger model is the next one. Of what a large misfit has become, where that is
        no more than the noise, odds must demand more: such an effect would be left out again.
        """
        if self.is_large and not leaves_something(examined.candidate.fit):
            return self.log_odds(larger) >= self.log_odds(examined.candidate) + DECISIVE
        return self.promise(larger) > self.promise(examined.candidate)

    def force_gain(self) -> float:
        """What a free force in place of all effects would gain, as far as scores tell, each
        independent sample counted once.
        """
        base = self.examined_models[frozenset()]
        return self.log_odds(base.candidate) + base.unknown.log_evidence / self.repetition()

    def enough(self, rival: Candidate | None = None) -> Enough:
        """When ascents may end early. Where the misfit is large, as near to the mode as odds ask
        for, which count each repeated sample of a residual once.
        """
        least = LITTLE * self.repetition() if self.is_large else 0.0
        return Enough(self.goal(rival), least)

    def at_its_mode(self, examined: ExaminedModel) -> ExaminedModel:
        """The same model where its ascent, which ended early, leads in the end (`enough`)."""
        candidate = examined.candidate
        if candidate.fit.converged or not (candidate.effects and self.is_large):
            return examined
        self.tell(f"fitting {in_words(candidate.effects)} to the end")
        return self.examine(grown(candidate, candidate.effects, self.scales))

    def goal(self, rival: Candidate | None = None) -> float:
        """Log likelihood that a model must reach to come within the decisive odds of a `rival`, and
        of one that leaves nothing: no evidence is above the largest likelihood. Minus infinity
        without one.
        """
        known = [s.candidate for s in self.examined_models.values() if s.is_white]
        known += [] if rival is None else [rival]
        reached = max(map(self.tempered_odds, known), default=-np.inf)
        return self.repetition() * (reached - DECISIVE)

    def best(self, size: int) -> Candidate:
        """The likeliest model tried with at most so many effects."""
        return self.ranked([c for c in self.tried.values() if len(c.effects) <= size])[0]

    def ranked(self, candidates: Sequence[Candidate]) -> list[Candidate]:
        """Models, likeliest first. An unconverged fit decides nothing near the best one.

        Unless a free force wins anyhow, or the misfit is large: then the next step repairs it.
        """
        best = max((self.log_odds(c) for c in candidates), default=0.0)
        models = {frozenset(c.ids): c for c in candidates}
        if self.is_large or self.force_gain() > best + UNCONVERGED_SHORTFALL:
            best = np.inf
        near = [key for key, c in models.items() if self.log_odds(c) > best - UNCONVERGED_SHORTFALL]
        for key in near:
            if len(near) > 1 and not models[key].fit.converged:
                models[key] = self.finished(models[key])
        return sorted(models.values(), key=self.log_odds, reverse=True)

    def refit_candidates(self, scan: Scan, least: float = 0.0) -> list[Score]:
        """Effects that promise something, but for those that have proved to be wrong here."""
        return [s for s in refit_candidates(scan, least) if not self.is_contradicted(s.effect)]

    def is_contradicted(self, effect: Effect) -> bool:
        """Whether an effect alone loses more than there is to gain, by what a free force gains.

        One that was refused says nothing of itself beside others.
        """
        alone, base = self.tried.get(frozenset([effect.id])), self.examined_models[frozenset()]
        if alone is None or alone.log_evidence == -np.inf:
            return False
        lost = self.log_odds(base.candidate) - self.log_odds(alone)
        return lost > max(CONTRADICTED, base.unknown.log_evidence)
