"""Forces that no effect of the catalogue is, met on the way of a search.

Where the catalogue leaves a large misfit, the equation of motion may tell a term of the grammar
that leaves far less of it (`likely_terms`). The search goes on beside it. It is no name yet: once
the motion is right, all formulas are compared in its place (`formulas`). What it leaves until then
may be what tells it from the force that it stands for; so an effect joins it only where it leaves
`EXCESS` times less.
"""

from __future__ import annotations

from bayesimpact.diagnosis.likely_terms import sets_with_a_term
from bayesimpact.diagnosis.naming import State, is_large
from bayesimpact.diagnosis.refit import Candidate
from bayesimpact.diagnosis.remaining import Remaining
from bayesimpact.diagnosis.thresholds import EXCESS
from bayesimpact.formula.law import is_formula


class Unlisted(Remaining):
    """A search that may leave the catalogue."""

    def with_a_term(self, state: State) -> State:
        """A model, or where it leaves a large misfit, one with a term of the grammar that explains
        more: once about every model, and never a second term, for sums of terms are compared later.
        """
        about = state.candidate
        if not is_large(about.fit) or any(map(is_formula, about.effects)):
            return state
        for flight in (True, False) if self.asked.has_stop else (False,):
            key = ("term", about.ids, about.fit.log_posterior, flight)
            if key in self.begun or not self.may_go_on():
                continue
            self.begun.add(key)
            found = [about, *self.fit_sets_with_a_term(about, flight)]
            best = max(found, key=self.promise)
            if best is not about:
                return self.examine(best)
        return state

    def fit_sets_with_a_term(self, about: Candidate, flight: bool) -> list[Candidate]:
        """Models with a term of the grammar that the equation of motion asks for about a model;
        larger ones up to the first whose misfit is not large.
        """
        found, problem = list[Candidate](), self.asked.about(about, flight)
        most = self.most - len(problem.known)
        for chosen in sets_with_a_term(problem, most, about.ids):
            if not self.may_go_on():
                break
            found.append(self.fit_set(problem.fit, chosen, about.fit.log_likelihood))
            if not is_large(found[-1].fit):
                break
        return found

    def leads_on(self, state: State, larger: Candidate) -> bool:
        """Whether a larger model is the next one; beside a formula, where it leaves far less."""
        chosen = state.candidate
        if any(map(is_formula, chosen.effects)):
            rest = max(larger.fit.reduced_chi2 - 1.0, 0.0)
            return EXCESS * rest < chosen.fit.reduced_chi2 - 1.0 and super().leads_on(state, larger)
        return super().leads_on(state, larger)
