"""Leaving effects out of a model, and putting others in their place."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from bayesimpact.diagnosis.candidates.promising import (
    NEAR_BEST,
    families,
    in_place_of,
    is_redundant,
)
from bayesimpact.diagnosis.refits.refit import Candidate
from bayesimpact.diagnosis.score_test.scan import Scan
from bayesimpact.diagnosis.score_test.scores import Score
from bayesimpact.diagnosis.selection.models import NOTHING, SAME
from bayesimpact.diagnosis.selection.outcome import ExaminedModel, is_large
from bayesimpact.diagnosis.selection.ranked import Ranked
from bayesimpact.diagnosis.thresholds import DECISIVE
from bayesimpact.formula.law import is_formula
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect

EXCHANGES = 3  # rounds of leaving out and exchanging effects
END = 1e-3  # of a shape's range, in which it lies at an end: ascents stop there


class Elimination(Ranked):
    """Effects left out and exchanged."""

    def extended(self, examined: ExaminedModel) -> list[Candidate]:
        """Models with one more effect."""
        raise NotImplementedError

    def exchanged(self, examined: ExaminedModel) -> ExaminedModel:
        """The model that neither leaving out nor exchanging an effect improves."""
        for _ in range(EXCHANGES):
            self.weigh_remainder()
            examined = self.eliminated(examined)
            for candidate in self.near(examined):
                if self.may_go_on():
                    self.exchange(candidate)
            best = self.best(len(examined.candidate.effects))
            more = [*self.beside_rival(examined), *self.with_one_without_size(examined)]
            best = max([best, *more], key=self.log_odds)
            if best is examined.candidate:  # the same set with a better end is exchanged once more
                return examined
            examined = self.examine(best)
        return self.eliminated(examined)  # what the last exchange led to may need less too

    def eliminated(self, examined: ExaminedModel) -> ExaminedModel:
        """Leave out effects, the least useful first, that the recordings do not demand, and put the
        law that one refines in its place.

        An effect stays when the model without it is decisively worse, or leaves something. When
        time is up and something remains, all stay: what is needed is compared then (`decision`).
        """
        while (examined.is_white or self.may_go_on()) and (smaller := self.smaller(examined)):
            best = max(smaller, key=self.log_odds)
            lost = self.log_odds(examined.candidate) - self.log_odds(best)
            complete = examined.is_white and not self.examine(best).is_white
            if lost >= DECISIVE or (lost > 0 and complete):
                return examined
            examined = self.examine(best)
        return examined

    def smaller(self, examined: ExaminedModel) -> list[Candidate]:
        """Models with one effect less, or with a simpler one: at the end of its range, a law is the
        one that it refines.
        """
        chosen = examined.candidate
        found = [self.drop(chosen, e) for e in chosen.effects if len(chosen.effects) > 1]
        if self.may_go_on():
            found += [c for e in chosen.effects for c in self.simplified(chosen, e)]
        return found

    def near(self, examined: ExaminedModel) -> list[Candidate]:
        """The chosen model and those of at most its size that it does not beat decisively."""
        least = self.log_odds(examined.candidate) - DECISIVE
        return [
            c
            for c in self.ranked(list(self.tried.values()))
            if self.log_odds(c) >= least and len(c.effects) <= len(examined.candidate.effects)
        ]

    def beside_rival(self, examined: ExaminedModel) -> list[Candidate]:
        """Extensions by one effect of the likeliest model that lacks an effect of one that leaves
        nothing, and comes near it: a law of free shape may have taken the place of two.
        """
        chosen = examined.candidate
        least = self.log_odds(chosen) - 2 * DECISIVE
        rivals = [
            c
            for c in self.ranked(list(self.tried.values()))
            if self.log_odds(c) >= least
            and len(c.effects) <= min(len(chosen.effects), self.most - 1)
            and not set(chosen.ids) <= set(c.ids)
        ]
        if not (examined.is_white and rivals and self.may_go_on()):
            return []
        return self.extended(self.examine(rivals[0]))

    def with_one_without_size(self, examined: ExaminedModel) -> list[Candidate]:
        """Models with one more effect that is there or not, of one that leaves nothing: no score,
        which is of first order in a size, tells whether it is missing.
        """
        chosen = examined.candidate
        if not (examined.is_white and chosen.effects) or len(chosen.effects) >= self.most:
            return []
        ranked = sorted(examined.scan.scores, key=lambda s: s.gain)  # the best shape of each
        scores = {s.effect.id: s for s in ranked if not s.effect.has_size}
        return [
            self.fit_one(chosen, examined.scan, score, chosen)
            for score in scores.values()
            if self.may_go_on() and not is_redundant(chosen, score.effect)
        ]

    def exchange(self, chosen: Candidate) -> None:
        """Put every other effect in the place of each chosen one.

        Where the misfit was large, several of its own family together too: two damping laws make a
        third one. Where it was not, all single effects have been fitted beside the base model.
        """
        for effect in chosen.effects:
            self.beside_untried(chosen, effect)
        if len(chosen.effects) < 2 and not self.is_large:
            return
        for effect in chosen.effects:
            if is_formula(effect):  # compared with all others of the grammar
                continue
            rest = self.drop(chosen, effect)
            if self.is_large and self.may_go_on():
                self.simplified(chosen, effect)
            found = self.scanned(rest, self.effects)
            large = is_large(rest.fit)
            instead = effect.id if self.leaves_nothing(chosen) else ""
            asked, seen = self.asked.first(rest, chosen, instead) if self.is_large else NOTHING
            if self.is_large and not seen:
                others = [[s for s in j if s.effect.id != effect.id] for j in families(found)]
                for joint in others:
                    if len(joint) > 1 and joint[0].effect.family == effect.family:
                        self.fit_more(rest, joint)
            scores = self.asked_beside(rest, (asked, seen), found, self.refit_candidates(found))
            promising = in_place_of(effect, scores, large, asked if large else ())
            for score in promising:
                if self.may_go_on() and not is_redundant(rest, score.effect):
                    self.fit_one(rest, found, score, chosen)
                    if not score.effect.has_size:
                        self.exchange_in_place(chosen, effect, score.effect)
            for score in promising:
                self.begin_at_refined(rest, score.effect)
            alike = _alike(effect, self.effects)
            wanted = set(alike) if is_at_an_end(chosen.fit, effect) else _without_size(alike)
            if not _is_seen(effect, found, rest, chosen):
                # where the rest of a large misfit stands in a side minimum, scores see none of them
                wanted |= set(asked)
            for new in _unseen(found, wanted - {effect.id}, promising):
                if self.may_go_on() and not is_redundant(rest, new):
                    self.exchange_in_place(chosen, effect, new)

    def beside_untried(self, chosen: Candidate, effect: Effect) -> None:
        """Put what is not looked for by itself in the place of what else an obstacle does: a name
        is none while what is so much like it was not compared.
        """
        for other in self.untried if effect.needs_stop else ():
            known = other.id in chosen.ids or is_redundant(chosen, other)
            if not known and self.may_go_on():
                self.exchange_in_place(chosen, effect, other)

    def leaves_nothing(self, candidate: Candidate) -> bool:
        """Whether a model has been examined, and nothing was missing from it."""
        examined = self.examined_models.get(frozenset(candidate.ids))
        return examined is not None and examined.candidate is candidate and examined.is_white

    def simplified(self, chosen: Candidate, effect: Effect) -> list[Candidate]:
        """What an effect refines in its place, whatever scores on a model without both say."""
        found = []
        for simpler in self.effects:
            if simpler.id == effect.prefer and simpler.id not in chosen.ids:
                self.exchange_in_place(chosen, effect, simpler)
                found.append(self.tried[frozenset(chosen.ids) - {effect.id} | {simpler.id}])
        return found

    def begin_at_refined(self, rest: Candidate, law: Effect) -> None:
        """A law that has reached less than the one that it refines, in the same place, begins once
        more from where that one stands: it ended in a side minimum.
        """
        own = self.tried.get(frozenset((*rest.ids, law.id)))
        for simpler in self.effects:
            less = self.tried.get(frozenset((*rest.ids, simpler.id)))
            if simpler.id != law.prefer or own is None or less is None or not self.may_go_on():
                continue
            if less.fit.log_likelihood > own.fit.log_likelihood + SAME:
                self.exchange_in_place(less, simpler, law)


def _is_seen(effect: Effect, found: Scan, rest: Candidate, chosen: Candidate) -> bool:
    """Whether scores on a model see, of the effect that was left out of it, what it is known to do:
    then they can be believed about others in its place.
    """
    own = max((s.gain for s in found.best() if s.effect.id == effect.id), default=0.0)
    return own > NEAR_BEST * (chosen.fit.log_likelihood - rest.fit.log_likelihood)


def is_at_an_end(fit: Fit, effect: Effect) -> bool:
    """Whether a shape of an effect lies at an end of its range: it is not the law that is asked."""
    parameters, lower = fit.density.oscillator.layout.parameters, fit.density.priors.lower
    upper = fit.density.priors.upper
    shapes = {f"{effect.id}.{p.name}" for p in effect.parameters if p.is_shape and not p.circular}
    for i, parameter in enumerate(parameters):
        low, high = max(parameter.lower, lower[i]), min(parameter.upper, upper[i])
        if parameter.name.split("[")[0] in shapes and np.isfinite(high - low):
            inside = min(fit.mode[i] - low, high - fit.mode[i])
            if inside < END * (high - low):
                return True
    return False


def _alike(effect: Effect, effects: Sequence[Effect]) -> dict[str, Effect]:
    """Those of an effect's family, by their ids."""
    return {e.id: e for e in effects if e.family == effect.family}


def _without_size(effects: Mapping[str, Effect]) -> set[str]:
    """Ids of those that are there or not: no score, which is of first order in a size, tells."""
    return {i for i, e in effects.items() if not e.has_size}


def _unseen(found: Scan, asked: Collection[str], promising: Sequence[Score]) -> list[Effect]:
    """Effects that are asked for and can stand beside a model, but are not promising by scores."""
    known = {s.effect.id for s in promising}
    return [s.effect for s in found.best() if s.effect.id in asked and s.effect.id not in known]
