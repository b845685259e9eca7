"""What a search begins with where the misfit is large: sets that whole problems ask for.

Scores are linear about a fit that is far from the recordings, and tell little. The equation of
motion along the measured motion is linear in the sizes of all forces, wherever the fit is; with a
stop, where the motion in contact is hardly measured, so are simulations of one period ahead. Each
proposes sets of effects with their values (`candidates`).
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from bayesimpact.diagnosis.candidates.one_step import SteppedSet, after_steps
from bayesimpact.diagnosis.candidates.period_sets import PeriodSets
from bayesimpact.diagnosis.candidates.stepwise_sets import STEPS, stepwise_sets
from bayesimpact.diagnosis.candidates.term_sets import EffectSet
from bayesimpact.diagnosis.measurement.input_noise import under_input_noise
from bayesimpact.diagnosis.refits.refit import Candidate
from bayesimpact.diagnosis.selection.outcome import ExaminedModel, is_large, leaves_something
from bayesimpact.diagnosis.selection.revision import Revision, first_revision
from bayesimpact.diagnosis.selection.unlisted import FITTED, Unlisted
from bayesimpact.diagnosis.thresholds import DECISIVE
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.initial.multiple_shooting import Starts


class Asking(Unlisted):
    """A search that begins with what is asked for, unless readings are off.

    is_last : it goes to its end, whatever a model shows of the readings
    revision : without what spoils them, where it ended at a model that shows that
    asked_of : the model of which that was asked last
    """

    is_last = False
    revision: Revision | None = None
    asked_of: Candidate | None = None

    def asked_for(self, base: ExaminedModel) -> list[ExaminedModel]:
        """The likeliest model that is asked for: without a stop by the equation of motion along the
        measured motion, with one by periods ahead as well (`of_problems`).
        """
        base = self.with_a_line(base)
        if self.has_bad_readings(base):
            return [base]
        if self.asked.has_stop:
            best = self.of_problems(base)
        else:
            best = self.asked_again(base.candidate, self.of_motion)
        if self.is_no_set(best):
            with_term = self.with_a_term(self.examine(best))
            if not is_large(with_term.candidate.fit):
                return [with_term]
        examined = self.examine(best)
        if self.has_bad_readings(examined):
            return [examined]
        return [self.with_a_term_ahead(base, self.with_a_term(examined))]

    def of_problems(self, base: ExaminedModel) -> Candidate:
        """The likeliest model that any problem asks for about the base model, then about that, and
        so on: the sets that steps of their fit promise most of are fitted.
        """
        best = base.candidate
        while self.may_go_on() and leaves_something(best.fit):
            was = best
            for _, fit, chosen in self.promising_sets(best)[:FITTED]:
                found = self.no_worse(self.fit_set(fit, chosen))
                best = max(best, found, key=self.promise)
                if not is_large(best.fit) or not self.may_go_on():
                    break
            if best is was:
                break
        return best

    def promising_sets(self, about: Candidate) -> list[tuple[float, Fit, EffectSet]]:
        """Sets that the equation of motion, in flight and over all stretches, and periods ahead ask
        for about a model, each with what it costs after steps and the fit it extends, those that
        promise most first; in this order where no period is told. Of periods ahead every effect by
        itself, too: where the fit is far off, another may lead further than the one of which a
        linear problem promises most.
        """
        key = about.ids, about.fit.log_posterior
        if key not in self.promised:
            ahead, room = self.asked.ahead(about, about), self.most - len(about.effects)
            sets = [
                (problem.fit, chosen)
                for flight in (True, False)
                for problem in [self.asked.about(about, flight=flight)]
                for chosen in problem.best(self.most - len(problem.known))
            ]
            sets += [(ahead.fit, chosen) for chosen in ahead.best(room)]
            found = [(fit, self.after_steps(fit, chosen, STEPS)) for fit, chosen in sets]
            found += [(ahead.fit, one) for one in self.stepwise(ahead, min(room, 1))]
            ranked = sorted(found, key=lambda one: one[1].cost)
            self.promised[key] = [(one.cost, fit, one.chosen) for fit, one in ranked]
        return self.promised[key]

    def stepwise(
        self, problem: PeriodSets, most: int, *, with_terms: bool = False
    ) -> list[SteppedSet]:
        """Sets beside a problem's model that steps of each lead to, those that cost least first."""

        def stepped(chosen: EffectSet, steps: int) -> SteppedSet:
            return self.after_steps(
                problem.fit, chosen, steps, problem.starts if steps == 1 else ()
            )

        return stepwise_sets(problem, stepped, most, self.may_go_on, with_terms=with_terms)

    def after_steps(
        self, fit: Fit, chosen: EffectSet, steps: int = 1, starts: tuple[Starts, ...] = ()
    ) -> SteppedSet:
        """A set by steps over periods ahead (`one_step`), with the price of its effects."""
        found = after_steps(fit, chosen, self.scales, steps, starts)
        prices = sum(self.cost + effect.price for effect in chosen.effects)
        return replace(found, price=found.price + prices)

    def leads_by_a_step(self, fit: Fit, chosen: EffectSet, about: Candidate) -> bool:
        """Whether steps promise more of a set than of all that are asked for; without a stop
        these are not weighed.
        """
        if not self.asked.has_stop:
            return True
        least = min((cost for cost, *_ in self.promising_sets(about)), default=np.inf)
        return not np.isfinite(least) or self.after_steps(fit, chosen, STEPS).cost < least

    def of_motion(self, about: Candidate) -> list[Candidate]:
        """Models that the equation of motion asks for about one."""
        problem = self.asked.about(about, flight=False)
        return self.fit_sets(problem.fit, problem.best(self.most - len(problem.known)))

    def has_bad_readings(self, examined: ExaminedModel) -> bool:
        """Whether readings spoil what follows a model, and time is left to go on without them."""
        goes_on = bool(examined.candidate.effects) and self.may_go_on()  # from that model, not anew
        may_be = goes_on or self.budget.may_search_again()
        if self.is_last or examined.is_white or not may_be:
            return False
        if examined.candidate is not self.asked_of:
            base = self.examined_models[frozenset()].candidate.fit
            noise = self.noise_of_inputs(examined)
            self.revision = noise or first_revision(base, examined.candidate.fit, self.progress)
            self.asked_of = examined.candidate
        return self.revision is not None

    def noise_of_inputs(self, examined: ExaminedModel) -> Revision | None:
        """The search under the noise of the inputs, where that makes the base model's large misfit
        decisively likelier than a model does that leaves one.
        """
        found = examined.candidate.fit
        noisy = self.under_input_noise if is_large(found) else None
        if noisy is None or not noisy.log_likelihood > found.log_likelihood + DECISIVE:
            return None
        return Revision(noisy, None)

    @cached_property
    def under_input_noise(self) -> Fit | None:
        """The base model's mode under the noise of its inputs."""
        return under_input_noise(self.examined_models[frozenset()].candidate.fit)
