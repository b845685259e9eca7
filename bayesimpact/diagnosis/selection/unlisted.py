"""Forces that no set of effects holds, met on the way of a search: of time, and of no effect.

Where the equation of motion leaves far less of a large misfit by a harmonic force, the search
begins beside it (`line_sets`): in flight, for what a stop does has lines of its own.

Where the catalogue leaves a large misfit, the equation of motion may tell a term of the grammar
that leaves far less of it (`likely_terms`). The search goes on beside it. It is no name yet: once
the motion is right, all formulas are compared in its place (`formulas`). What it leaves until then
may be what tells it from the force that it stands for; so an effect joins it only where it leaves
`EXCESS` times less.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from bayesimpact.diagnosis.candidates.likely_sets import LikelySets
from bayesimpact.diagnosis.candidates.likely_terms import sets_with_a_term
from bayesimpact.diagnosis.candidates.line_sets import sets_with_a_line
from bayesimpact.diagnosis.candidates.one_step import SteppedSet
from bayesimpact.diagnosis.candidates.period_sets import PeriodSets
from bayesimpact.diagnosis.candidates.term_sets import EffectSet
from bayesimpact.diagnosis.refits.refit import Candidate
from bayesimpact.diagnosis.score_test.directions import is_periodic
from bayesimpact.diagnosis.selection.outcome import (
    ExaminedModel,
    above_noise,
    is_large,
    leaves_something,
)
from bayesimpact.diagnosis.selection.remaining import Remaining
from bayesimpact.diagnosis.thresholds import EXCESS
from bayesimpact.formula.law import is_formula
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.harmonic_forcing import EFFECT as HARMONIC_FORCING

Problem = Callable[[Candidate], list[Candidate]]
"""Models that a problem posed about one asks for."""

FITTED = 2  # of the sets that periods ahead ask for about a model, the most promising

SetsBeside = Callable[[LikelySets, int], list[EffectSet]]
"""Sets with one more force that a problem asks for, of so many effects at most."""


class Unlisted(Remaining):
    """A search that may leave the catalogue."""

    def with_a_line(self, examined: ExaminedModel) -> ExaminedModel:
        """A model, or where its misfit is large one with a harmonic force, where the equation of
        motion leaves `EXCESS` times less by it than by effects that are none; with a stop, where
        steps over periods ahead promise more of it than of every set without one, too: a mode
        near the motion's own frequency is a line to the equation of motion, which knows no mode.
        """
        about = examined.candidate
        shaken = [e for e in self.effects if e.id == HARMONIC_FORCING.id]
        if not (shaken and is_large(about.fit)):
            return examined
        if any(map(is_periodic, (*about.fit.density.oscillator.acting, *about.effects))):
            return examined

        def sets(problem: LikelySets, most: int) -> list[EffectSet]:
            found = sets_with_a_line(problem, shaken[0], most, about.ids)
            return [s for s in found if self.leads_by_a_step(problem.fit, s, about)]

        self.is_driven = True
        found = self.beside_sets(examined, ("line",), sets, [self.asked.has_stop])
        self.is_driven = found is not examined
        return found

    def leads_by_a_step(self, fit: Fit, chosen: EffectSet, about: Candidate) -> bool:
        """Whether a set that a problem posed about a model asks for is the most promising one."""
        raise NotImplementedError

    def with_a_term(self, examined: ExaminedModel, *, excess: float = EXCESS) -> ExaminedModel:
        """A model, or one with a term of the grammar that explains more, where the equation of
        motion leaves `excess` times less by it than by the catalogue.

        Of a large misfit only, or of what is left of one; once about every model, and never a
        second term, for sums of terms are compared later.
        """
        about = examined.candidate
        something = is_large(about.fit) if excess > 1.0 else not examined.is_white and self.is_large
        if not something or any(map(is_formula, about.effects)):
            return examined

        def sets(problem: LikelySets, most: int) -> list[EffectSet]:
            return sets_with_a_term(problem, most, about.ids, excess)

        ways = [True, False] if self.asked.has_stop else [False]
        return self.beside_sets(examined, ("term", excess), sets, ways)

    def beside_sets(
        self,
        examined: ExaminedModel,
        kind: tuple[object, ...],
        sets: SetsBeside,
        ways: Sequence[bool],
    ) -> ExaminedModel:
        """A model, or a likelier one with a force beside sets of effects, by the first of some
        `ways` that leads to one: in flight or in all of the motion; once about every model.
        """
        about = examined.candidate
        for flight in ways:
            key = (*kind, about.ids, about.fit.log_posterior, flight)
            if key in self.begun or not self.may_go_on():
                continue
            self.begun.add(key)
            problem = self.asked.about(about, flight)
            asked = sets(problem, self.most - len(problem.known))
            found = [about, *self.fit_up_to_small(problem, asked, about)]
            best = max(found, key=self.promise)
            if best is not about:
                return self.examine(best)
        return examined

    def fit_up_to_small(
        self, problem: LikelySets, sets: Sequence[EffectSet], about: Candidate
    ) -> list[Candidate]:
        """Models of sets that a problem posed about a model asks for; larger ones up to the first
        whose misfit is not large, where the model's is.
        """
        found = list[Candidate]()
        for chosen in sets:
            if not self.may_go_on():
                break
            found.append(self.fit_set(problem.fit, chosen, about.fit.log_likelihood))
            if is_large(about.fit) and not is_large(found[-1].fit):
                break
        return found

    def with_a_term_ahead(self, base: ExaminedModel, examined: ExaminedModel) -> ExaminedModel:
        """A model, or where it leaves something of a large misfit the one that periods ahead of the
        base model lead to with a term of the grammar, if that leaves `EXCESS` times less.
        """
        wanted = self.asked.has_stop and self.is_large and not examined.is_white
        if not (wanted and self.may_go_on()):
            return examined
        found = self.asked_again(base.candidate, self.of_periods_with_a_term)
        far_less = EXCESS * above_noise(found.fit) <= above_noise(examined.candidate.fit)
        return self.examine(found) if far_less else examined

    def asked_again(self, about: Candidate, problem: Problem) -> Candidate:
        """The likeliest model that a problem asks for about one, then about that, and so on."""
        best = about
        while True:
            found = problem(best)
            better = max([best, *found], key=self.promise)
            if better is best:
                return best
            best = better

    def of_periods_with_a_term(self, about: Candidate) -> list[Candidate]:
        """Models with a term of the grammar that periods ahead ask for about one; of one that has
        a term those with more effects. None where nothing is left.
        """
        if not leaves_something(about.fit):
            return []
        most = self.most - len(about.effects)
        if any(map(is_formula, about.effects)):
            problem = self.asked.ahead(about, about)
            sets = [one.chosen for one in self.stepwise(problem, most)]
        else:
            problem = self.asked.ahead_with_terms(about)
            every = self.stepwise(problem, most, with_terms=True)
            sets = [one.chosen for one in every if any(map(is_formula, one.chosen.effects))]
        return self.fit_sets(problem.fit, sets[:FITTED])

    def stepwise(
        self, problem: PeriodSets, most: int, *, with_terms: bool = False
    ) -> list[SteppedSet]:
        """Sets beside a problem's model that steps of each lead to, those that cost least first."""
        raise NotImplementedError

    def leads_on(self, examined: ExaminedModel, larger: Candidate) -> bool:
        """Whether a larger model is the next one; beside a formula, where it leaves far less."""
        chosen = examined.candidate
        if any(map(is_formula, chosen.effects)):
            rest = max(larger.fit.reduced_chi2 - 1.0, 0.0)
            return EXCESS * rest < chosen.fit.reduced_chi2 - 1.0 and super().leads_on(
                examined, larger
            )
        return super().leads_on(examined, larger)
