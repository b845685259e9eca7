"""Forces that no effect of the catalogue is, met on the way of a search.

Where the catalogue leaves a large misfit, the equation of motion may tell a term of the grammar
that leaves far less of it (`likely_terms`). The search goes on beside it. It is no name yet: once
the motion is right, all formulas are compared in its place (`formulas`). What it leaves until then
may be what tells it from the force that it stands for; so an effect joins it only where it leaves
`EXCESS` times less.
"""

from __future__ import annotations

from collections.abc import Callable

from bayesimpact.diagnosis.likely_terms import sets_with_a_term
from bayesimpact.diagnosis.naming import State, is_large
from bayesimpact.diagnosis.period_terms import sets_with_a_term_ahead
from bayesimpact.diagnosis.refit import Candidate
from bayesimpact.diagnosis.remaining import Remaining
from bayesimpact.diagnosis.thresholds import EXCESS
from bayesimpact.formula.law import is_formula

Problem = Callable[[Candidate], list[Candidate]]
"""Models that a problem posed about one asks for."""


class Unlisted(Remaining):
    """A search that may leave the catalogue."""

    def with_a_term(self, state: State, *, excess: float = EXCESS) -> State:
        """A model, or one with a term of the grammar that explains more, where the equation of
        motion leaves `excess` times less by it than by the catalogue.

        Of a large misfit only, or of what is left of one; once about every model, and never a
        second term, for sums of terms are compared later.
        """
        about = state.candidate
        something = is_large(about.fit) if excess > 1.0 else not state.is_white and self.is_large
        if not something or any(map(is_formula, about.effects)):
            return state
        for flight in (True, False) if self.asked.has_stop else (False,):
            key = ("term", about.ids, about.fit.log_posterior, flight, excess)
            if key in self.begun or not self.may_go_on():
                continue
            self.begun.add(key)
            found = [about, *self.fit_sets_with_a_term(about, flight, excess)]
            best = max(found, key=self.promise)
            if best is not about:
                return self.examine(best)
        return state

    def fit_sets_with_a_term(
        self, about: Candidate, flight: bool, excess: float
    ) -> list[Candidate]:
        """Models with a term of the grammar that the equation of motion asks for about a model;
        larger ones up to the first whose misfit is not large.
        """
        found, problem = list[Candidate](), self.asked.about(about, flight)
        most = self.most - len(problem.known)
        for chosen in sets_with_a_term(problem, most, about.ids, excess):
            if not self.may_go_on():
                break
            found.append(self.fit_set(problem.fit, chosen, about.fit.log_likelihood))
            if excess > 1.0 and not is_large(found[-1].fit):
                break
        return found

    def with_a_term_ahead(self, base: State, state: State) -> State:
        """A model, or where its misfit is large the one that periods ahead of the base model lead
        to with a term of the grammar, if that leaves `EXCESS` times less.
        """
        wanted = self.asked.has_stop and is_large(state.candidate.fit)
        if not (wanted and self.may_go_on()):
            return state
        found = self.asked_again(base.candidate, self.of_periods_with_a_term)
        far_less = EXCESS * found.fit.reduced_chi2 < state.candidate.fit.reduced_chi2
        return self.examine(found) if far_less else state

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
        a term those with more effects.
        """
        most = self.most - len(about.effects)
        if any(map(is_formula, about.effects)):
            problem = self.asked.ahead(about, about)
            return self.fit_sets(problem.fit, problem.best(most))
        problem = self.asked.ahead_with_terms(about)
        found = list[Candidate]()
        for sets in sets_with_a_term_ahead(problem, most):
            found += self.fit_sets(problem.fit, sets)
        return found

    def leads_on(self, state: State, larger: Candidate) -> bool:
        """Whether a larger model is the next one; beside a formula, where it leaves far less."""
        chosen = state.candidate
        if any(map(is_formula, chosen.effects)):
            rest = max(larger.fit.reduced_chi2 - 1.0, 0.0)
            return EXCESS * rest < chosen.fit.reduced_chi2 - 1.0 and super().leads_on(state, larger)
        return super().leads_on(state, larger)
