"""The models of one search: each is fitted once from every start, and scored once.

Of two ends of ascents to one model the better one is kept.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from bayesimpact.diagnosis.budget import Budget, begin
from bayesimpact.diagnosis.candidates.asked import Asked
from bayesimpact.diagnosis.candidates.term_sets import EffectSet
from bayesimpact.diagnosis.measurement.smoothing import is_refuted
from bayesimpact.diagnosis.refits.evidence import model_evidence
from bayesimpact.diagnosis.refits.profile_likelihood import profiled
from bayesimpact.diagnosis.refits.refit import (
    TO_THE_MODE,
    Candidate,
    Enough,
    exchanged,
    fit_from,
    grown,
    in_words,
    refit,
    without,
)
from bayesimpact.diagnosis.residual_force.discrepancy import Discrepancy
from bayesimpact.diagnosis.residual_force.gaussian_process import missing_drift, missing_force
from bayesimpact.diagnosis.score_test.own_band import shakes_in_own_band
from bayesimpact.diagnosis.score_test.scan import Scan, scan
from bayesimpact.diagnosis.score_test.scores import Score
from bayesimpact.diagnosis.selection.outcome import (
    ExaminedModel,
    colour_p,
    is_large,
    leaves_something,
)
from bayesimpact.diagnosis.thresholds import EXCESS, LARGE
from bayesimpact.formula.law import is_formula
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.progress import Refit
from bayesimpact.model.effects import EFFECTS, UNTRIED
from bayesimpact.model.effects.effect import Effect, Scales
from bayesimpact.model.effects.obstacle_mass import EFFECT as OBSTACLE_MASS

STARTS = 2  # points of an effect's shape grid from which it is fitted
# Nats by which a fit that ended unconverged may lie below its mode. Set by hand and generous: too
# large a value finishes more fits, which costs seconds; too small a one loses a model.
UNCONVERGED_SHORTFALL = 60.0
MORE = 2.0  # nats by which a score must promise more than a model has reached to fit it again
SAME = 0.05  # nats; two ascents to one mode differ by less

NOTHING: tuple[set[str], set[str]] = (set(), set())
"""Effects that are asked for first, and all that were asked about: none."""

Progress = Callable[[str], None]


class Models:
    """Models fitted so far, `tried`, and `examined_models`, by the ids of their effects."""

    def __init__(
        self,
        effects: Sequence[Effect],
        scales: Scales,
        rng: np.random.Generator,
        progress: Progress,
        budget: Budget | None = None,
    ) -> None:
        self.effects, self.scales, self.rng, self.progress = effects, scales, rng, progress
        self.budget = budget or begin()
        self.tried: dict[frozenset[str], Candidate] = {}
        self.examined_models: dict[frozenset[str], ExaminedModel] = {}
        self.begun: set[tuple[object, ...]] = set()
        self.dropped: set[tuple[frozenset[str], float, str]] = set()
        self.profiled: set[frozenset[str]] = set()
        self.beside_forces: dict[frozenset[str], tuple[Candidate, Candidate]] = {}
        self.promised: dict[tuple[object, ...], list[tuple[float, Fit, EffectSet]]] = {}
        self.is_driven = False  # the equation of motion asked for a harmonic force
        self.refits = 0
        self.look = 0.0  # s, that the last model took to be scored
        self.repeated: tuple[Candidate, float] | None = None
        self.left: Discrepancy | None = None  # beside every model, see `Ranked.weigh_remainder`
        self.last: tuple[Fit, Discrepancy | None] | None = None  # see `Ranked.remainder`

    def keep(self, candidate: Candidate) -> Candidate:
        """The better end of all ascents to the candidate's model, this one among them."""
        key = frozenset(candidate.ids)
        fit = candidate.fit
        lost = not np.isfinite(fit.log_posterior)  # its mode need not be finite either
        if lost or is_refuted(fit):
            candidate = replace(candidate, log_evidence=-np.inf)
        elif shakes_in_own_band(fit, leaves_something(fit)):
            refused = candidate.log_evidence
            candidate = replace(candidate, log_evidence=-np.inf, refused=refused)
        best_so_far = self.tried.get(key)
        sooner = candidate.fit.converged and not (best_so_far and best_so_far.fit.converged)
        least = SAME * (-1 if sooner else 1)
        if best_so_far is None or _is_above(candidate, best_so_far, least):
            self.tried[key] = candidate
        return self.tried[key]

    def examine(self, candidate: Candidate) -> ExaminedModel:
        """Whether anything is missing from a candidate.

        One whose fit ended on a ridge, and may lack no more than its rest, is finished first.
        """
        candidate = self.keep(candidate)
        best_so_far = self.examined_models.get(frozenset(candidate.ids))
        if best_so_far is not None and best_so_far.candidate is candidate:
            return best_so_far
        self.progress(f"scoring what {in_words(candidate.effects) or 'the base model'} lacks")
        begun = self.budget.left
        found = scan(candidate.fit, self.effects, self.scales, rng=self.rng)
        force = missing_force(candidate.fit, self.scales, rng=self.rng)
        drift = missing_drift(candidate.fit, self.scales, rng=self.rng)
        self.look = begun - self.budget.left
        examined = ExaminedModel(candidate, found, force, drift, colour_p(candidate))
        self.examined_models[frozenset(candidate.ids)] = examined
        unconverged = candidate.effects and not candidate.fit.converged
        # else more is missing than an unfinished fit explains
        if unconverged and examined.unknown.log_evidence < UNCONVERGED_SHORTFALL:
            return self.examine(self.finished(candidate))
        return examined

    def scanned(self, candidate: Candidate, effects: Sequence[Effect]) -> Scan:
        """Scores of effects on a candidate, and of all others where it was examined."""
        best_so_far = self.examined_models.get(frozenset(candidate.ids))
        if best_so_far is not None and best_so_far.candidate is candidate:
            return best_so_far.scan
        return scan(candidate.fit, effects, self.scales, rng=self.rng)

    def fit_one(
        self, candidate: Candidate, found: Scan, score: Score, rival: Candidate | None = None
    ) -> Candidate:
        """One more effect, from the best points of its shape grid, to be compared with a `rival`.

        A model that is known is fitted from here too where the score promises more than it has
        reached: it may have come to rest in a side minimum.
        """
        key = frozenset((*candidate.ids, score.effect.id))
        promised = candidate.fit.log_likelihood + score.gain
        if not self.is_known(key) or promised > self.tried[key].fit.log_likelihood + MORE:
            count = 1 if is_large(candidate.fit) else STARTS  # grids do not tell much there
            for start in found.starts(score, count):
                self.start(candidate, [start], rival)
        return self.tried[key]

    def fit_more(self, candidate: Candidate, scores: Sequence[Score]) -> Candidate:
        """The candidate's model with all of these effects, from where the scores point to."""
        key = frozenset((*candidate.ids, *(s.effect.id for s in scores)))
        if not self.is_known(key):
            self.start(candidate, scores)
        return self.tried[key]

    def start(
        self, candidate: Candidate, scores: Sequence[Score], rival: Candidate | None = None
    ) -> None:
        """Fit a model from where scores on a candidate point to, once.

        It is of no use where it explains less than the candidate, whose effects it has; an effect
        alone may, for beside others it may still be right.
        """
        shapes = tuple((s.effect.id, *sorted(s.shapes.items())) for s in scores)
        begun = (candidate.ids, candidate.fit.log_posterior, shapes)
        if begun not in self.begun:
            self.begun.add(begun)
            self.tell("fitting " + in_words((*candidate.effects, *(s.effect for s in scores))))
            least = candidate.fit.log_likelihood if candidate.effects else -np.inf
            enough = self.enough(rival)
            enough = replace(enough, goal=max(enough.goal, least))
            self.keep(refit(candidate.fit, scores, self.scales, enough=enough))

    def fit_sets(self, fit: Fit, sets: Sequence[EffectSet]) -> list[Candidate]:
        """Models that a problem posed about a fit asks for.

        Larger ones up to the first whose misfit is not large: there scores tell more.
        """
        found = list[Candidate]()
        for chosen in sets:
            if not self.may_go_on():
                break
            found.append(self.no_worse(self.fit_set(fit, chosen)))
            if not is_large(found[-1].fit):
                break
        return found

    def fit_set(self, base: Fit, chosen: EffectSet, goal: float = -np.inf) -> Candidate:
        """The model of a set that the equation of motion asks for, from where it asks for it; of
        use where it reaches a log likelihood of `goal` and what the models in it do.
        """
        key = frozenset(e.id for e in chosen.effects)
        if not self.is_known(key):
            self.tell("fitting " + in_words(chosen.effects))
            goal = max(goal, self.contained(key).fit.log_likelihood)
            self.keep(fit_from(base, chosen.effects, chosen.values, self.scales, goal=goal))
        return self.tried[key]

    def no_worse(self, candidate: Candidate) -> Candidate:
        """A model that has reached no less than what it contains: an ascent that began elsewhere
        and ended lower begins again from there.
        """
        best = self.contained(frozenset(candidate.ids))
        if not best.fit.log_likelihood > candidate.fit.log_likelihood + SAME:
            return candidate
        self.tell(f"fitting {in_words(candidate.effects)} once more")
        return self.keep(grown(best, candidate.effects, self.scales))

    def contained(self, ids: frozenset[str]) -> Candidate:
        """The model with some of these effects, or none, that explains most."""
        parts = [c for key, c in self.tried.items() if key < ids]
        return max(parts, key=lambda c: c.fit.log_likelihood)

    @cached_property
    def untried(self) -> tuple[Effect, ...]:
        """What is not looked for by itself (`UNTRIED`), in a search of the catalogue."""
        if OBSTACLE_MASS not in self.effects:
            return ()
        return tuple(e for e in EFFECTS if e.id in UNTRIED and e not in self.effects)

    @cached_property
    def asked(self) -> Asked:
        """What the equation of motion and periods ahead ask for, where the misfit is large: there
        all of the catalogue is told apart.
        """
        base = self.examined_models[frozenset()].candidate.fit
        return Asked(base, (*self.effects, *self.untried), self.scales)

    def asked_beside(
        self,
        candidate: Candidate,
        asked: tuple[Collection[str], Collection[str]],
        found: Scan,
        promising: Sequence[Score],
    ) -> list[Score]:
        """Scores that are tried beside a model, the `promising` ones; with a large misfit, of what
        is `asked` (those first, and all), those first, and of the promising ones all others.
        """
        if not is_large(candidate.fit):
            return list(promising)
        first, seen = asked
        kept = {*first, *(s.effect.id for s in promising if s.effect.id not in seen)}
        return [s for s in found.best() if s.effect.id in kept]

    def enough(self, rival: Candidate | None = None) -> Enough:
        """When ascents may end early, to models that are to be compared with a `rival`: as long as
        nothing is known, at the mode.
        """
        return TO_THE_MODE

    def may_go_on(self) -> bool:
        """Whether the budget allows for more refits: with time for comparisons, as long as no model
        of the catalogue leaves nothing, which is compared with no force.
        """
        if any(map(_is_complete, self.examined_models.values())):
            return self.budget.may_go_on()
        return self.budget.may_search_on(self.look)

    def tell(self, words: str) -> None:
        """Count a refit, and say which."""
        self.refits += 1
        self.progress(Refit(words, self.refits))

    def is_known(self, key: frozenset[str]) -> bool:
        """Whether a model has its mode; an unconverged fit may do better from elsewhere."""
        return key in self.tried and self.tried[key].fit.converged

    def drop(self, candidate: Candidate, effect: Effect) -> Candidate:
        """The model without one effect, fitted from here even where it was fitted before; to its
        mode only where it may leave so little that a verdict or a score has a use for it.
        """
        step = (frozenset(candidate.ids), candidate.fit.log_posterior, effect.id)
        if step not in self.dropped:
            self.dropped.add(step)
            self.tell("without " + in_words([effect]))
            enough = replace(self.enough(), goal=likelihood_at(candidate.fit, _far_from(candidate)))
            self.keep(without(candidate, effect, self.scales, enough=enough))
        return self.tried[frozenset(i for i in candidate.ids if i != effect.id)]

    def exchange_in_place(self, candidate: Candidate, old: Effect, new: Effect) -> None:
        """An effect in the place of another, fitted from where that one stands, once."""
        begun = (candidate.ids, candidate.fit.log_posterior, old.id, new.id)
        if begun not in self.begun:
            self.begun.add(begun)
            self.tell(f"{new.id} in place of {old.id} in {in_words(candidate.effects)}")
            enough = self.enough(candidate)
            self.keep(exchanged(candidate, old, new, self.scales, enough=enough))

    def finished(self, candidate: Candidate) -> Candidate:
        """A model whose ascent did not converge, at the highest point of its profile likelihood."""
        key = frozenset(candidate.ids)
        if key not in self.profiled:
            self.profiled.add(key)
            self.progress("profile likelihood of " + in_words(candidate.effects))
            fit = profiled(candidate.fit)
            self.keep(Candidate(candidate.effects, fit, model_evidence(fit)))
        return self.tried[key]


def _is_above(candidate: Candidate, best_so_far: Candidate, least: float) -> bool:
    """Whether an end of an ascent lies above another one of the same model by more than `least`."""
    if candidate.refused is not None and best_so_far.refused is not None:
        return candidate.refused > best_so_far.refused + least
    return candidate.log_evidence > best_so_far.log_evidence + least


def _is_complete(examined: ExaminedModel) -> bool:
    """Whether nothing is missing from effects of the catalogue."""
    effects = examined.candidate.effects
    return bool(effects) and examined.is_white and not any(map(is_formula, effects))


def likelihood_at(fit: Fit, reduced_chi2: float) -> float:
    """Log likelihood of a fit to the same recordings that leaves so much, nats."""
    count = float(fit.density.likelihood.sizes.sum())
    return fit.log_likelihood - 0.5 * count * float(np.log(reduced_chi2 / fit.reduced_chi2))


def _far_from(candidate: Candidate) -> float:
    """A misfit so large, and so much above a model's own, that no effect stands in doubt by it."""
    return max(LARGE**2, EXCESS**2 * candidate.fit.reduced_chi2)
