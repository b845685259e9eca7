"""Where a search ends with something left: what a verdict compares then."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from bayesimpact.diagnosis.candidates.promising import is_redundant
from bayesimpact.diagnosis.refits.refit import Candidate, in_words
from bayesimpact.diagnosis.residual_force.discrepancy import Discrepancy, discrepancy
from bayesimpact.diagnosis.selection.decision import (
    Group,
    decide,
    group_of,
    in_its_place,
    is_imitated,
    is_needed,
    is_told_apart,
    leads_without,
    may_be_needed,
    misses,
    ordered,
)
from bayesimpact.diagnosis.selection.elimination import EXCHANGES, Elimination
from bayesimpact.diagnosis.selection.families import family, untold_families
from bayesimpact.diagnosis.selection.outcome import (
    ExaminedModel,
    Selection,
    is_large,
    leaves_something,
)
from bayesimpact.diagnosis.selection.unknown import with_force
from bayesimpact.model.effects.effect import Effect

INSTEAD = 3  # effects in the place of a family, until one is no refused line: set by hand


class Remaining(Elimination):
    """Models beside a force of time, and beside a residual force."""

    def with_residuals(self, found: Selection) -> Selection:
        """What `decide` compares where something remains: the likeliest model beside a force of
        time, what it is without each of its effects, and models with a residual force, that in the
        place of all effects first.
        """
        if self.is_no_set(found.chosen.candidate):  # that force is fitted, time up or not
            free = self.with_residual(found.base)
            return replace(found, residual={frozenset(): free})
        nearest = min(self.tried.values(), key=lambda c: c.fit.reduced_chi2)
        left = self.remainder(nearest.fit)
        if left is not None and left.leaves_noise:
            found = self.beside_a_force(found, left)
        chosen = found.chosen.candidate
        if found.chosen.is_white:
            return without_a_force(found)
        smaller = {e.id: self.drop(chosen, e) for e in chosen.effects}
        for effect in chosen.effects:  # whether time is up or not: no law is told without
            self.simplified(chosen, effect)
            late = not found.finished and self.budget.may_compare_on(self.look)
            if late and in_its_place(found, (effect,)) is None:
                self.likeliest_in_place(chosen, effect)
        tried = tuple(sorted(self.tried.values(), key=found.log_odds, reverse=True))
        found = replace(found, tried=tried, examined_models=dict(self.examined_models))
        alone = [(e,) for e in ordered(found, chosen.effects)]
        groups = [
            g if leads_without(found, g) and is_told_apart(found, g[0]) else group_of(found, g[0])
            for g in alone
        ]
        leading = [g for g in groups if leads_without(found, g)]
        own = self.remainder(chosen.fit)
        if own is not None:
            doubtful = [g[0].id for g in leading if own.leaves_noise and not misses(found, g[0])]
            without = {i: discrepancy(smaller[i].fit) for i in doubtful}
            power = {
                frozenset(smaller[i].ids): d.power for i, d in without.items() if d is not None
            }
            found = replace(
                found,
                own=own,
                apart={e.id: own.apart(e) for e in chosen.effects},
                power={**power, frozenset(chosen.ids): own.power},
            )
        needed = [g for g in leading if may_be_needed(found, g)]
        finished = found.finished
        found = self.with_forces(found, [found.base.candidate])
        if not needed:  # then shown at most, and nothing rests on it
            found = replace(found, finished=finished)
        if needed or not self.is_large:
            found = self.with_forces(found, [chosen])
        for group in needed if not is_imitated(found) else ():
            found = self.with_forces(found, [smaller[group[0].id], *rivals_in_place(found, group)])
            wider = group_of(found, group[0])
            told = is_needed(found, group) and is_told_apart(found, group[0])
            if len(wider) > len(group) and not told:
                found = self.with_forces(found, rivals_in_place(found, wider))
        return found if is_imitated(found) else self.without_families(found)

    def without_families(self, found: Selection) -> Selection:
        """With what `families` compares: the chosen model without any effect of a family of which
        none is told, and that with the likeliest one of another family.
        """
        chosen, decision = found.chosen.candidate, decide(found)
        for name in untold_families(found, decision.told):
            if self.budget.may_compare_on(self.look):
                rest = chosen
                for effect in chosen.effects:
                    rest = self.drop(rest, effect) if family(effect) == name else rest
                scan = self.scanned(rest, self.effects)
                others = [
                    s
                    for s in scan.best()
                    if family(s.effect) != name
                    and s.effect.id not in rest.ids
                    and not is_redundant(rest, s.effect)
                ]
                for likeliest in sorted(others, key=lambda s: -s.gain)[:INSTEAD]:
                    if self.fit_one(rest, scan, likeliest, chosen).refused is None:
                        break
        tried = tuple(sorted(self.tried.values(), key=found.log_odds, reverse=True))
        return replace(found, tried=tried)

    def likeliest_in_place(self, chosen: Candidate, effect: Effect) -> None:
        """Put the effect of which scores promise most in the place of one that a search which was
        cut short has compared with none.
        """
        rest = self.drop(chosen, effect)
        found = self.scanned(rest, self.effects)
        others = [
            s
            for s in found.best()
            if s.effect.id not in chosen.ids and not is_redundant(rest, s.effect)
        ]
        if others:
            best = max(others, key=lambda s: s.gain)
            self.fit_one(rest, found, best, chosen)
            self.exchange_in_place(chosen, effect, best.effect)

    def with_forces(self, found: Selection, candidates: Sequence[Candidate]) -> Selection:
        """With the models of these that have a residual force beside their effects, as far as time
        allows: what is not compared with all of its own is not needed.
        """
        residual = dict(found.residual)
        for candidate in candidates:
            key = frozenset(candidate.ids)
            if key not in residual and self.budget.may_compare_on(self.look):
                residual[key] = self.with_residual(self.examine(candidate))
        late = any(frozenset(c.ids) not in residual for c in candidates)
        return replace(
            found,
            residual=residual,
            examined_models=dict(self.examined_models),
            finished=found.finished and not late,
        )

    def beside_a_force(self, found: Selection, left: Discrepancy) -> Selection:
        """The search with a force of time beside every model, and the likeliest of them chosen.

        A model that the search had not chosen is compared with exchanges of its own.
        """
        found = replace(found, beside=left)
        for turn in range(EXCHANGES):
            chosen = found.chosen.candidate
            for effect in chosen.effects:
                self.drop(chosen, effect)
            if turn and self.may_go_on():
                self.exchange(chosen)
            tried = tuple(sorted(self.tried.values(), key=found.log_odds, reverse=True))
            best = self.examine(tried[0])
            found = replace(found, tried=tried, chosen=best)
            if set(best.candidate.ids) == set(chosen.ids) or not self.may_go_on():
                break
        finished = found.finished and self.may_go_on()
        return replace(found, examined_models=dict(self.examined_models), finished=finished)

    def with_residual(self, examined: ExaminedModel) -> Candidate:
        """A model with the likelier form of a residual force beside its effects, fitted once."""
        key = frozenset(examined.candidate.ids)
        begun, fitted = self.beside_forces.get(key, (None, examined.candidate))
        if begun is not examined.candidate:
            beside = in_words(examined.candidate.effects) or "the base model"
            self.progress(f"fitting a residual force beside {beside}")
            least = self.enough().least_gain
            fitted = with_force(examined.candidate, examined.unknown, self.scales, least_gain=least)
            self.beside_forces[key] = examined.candidate, fitted
        return fitted

    def is_no_set(self, candidate: Candidate) -> bool:
        """Whether a free force in the place of all effects leaves no more than noise, where a model
        still leaves a large misfit: what is missing depends on place and speed alone, and no set of
        effects that was asked for is it.
        """
        if not (self.is_large and candidate.effects and is_large(candidate.fit)):
            return False
        if frozenset() not in self.beside_forces and not self.budget.may_compare_on(self.look):
            return False
        return not leaves_something(self.with_residual(self.examined_models[frozenset()]).fit)


def without_a_force(found: Selection) -> Selection:
    """A search that ends with a model that leaves nothing: no force of time stands beside models
    then, unless it is by one alone that this model is the likeliest.
    """
    alone = replace(found, beside=None)
    alone = replace(alone, tried=tuple(sorted(found.tried, key=alone.log_odds, reverse=True)))
    own = alone.log_odds(found.chosen.candidate)
    return found if any(alone.log_odds(c) > own for c in alone.rivals()) else alone


def rivals_in_place(found: Selection, group: Group) -> list[Candidate]:
    """The likeliest model with another effect, not of a group, in the place of its first."""
    other = in_its_place(found, group)
    return [] if other is None else [other]
