"""What the equation of motion and periods ahead ask for about any model of a search.

Forces are evaluated along the measured motion, but counted from the rest reading and the gap of a
fit. Those of a base model make up for what it lacks: about a rest that is a little wrong, a
quadratic spring reads as a stiffness that changes. So the problem is posed anew about each better
model (as Gauss and Newton linearise anew at each step). Where there is a stop it is posed over
stretches of free flight, which no law of the stop disturbs, and what the stop does is asked of
simulations of one period ahead (`period_sets`). A hum that the spectra of the recordings show is
taken out of them before: it would be read as speed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.candidates.equation_error import is_a_force
from bayesimpact.diagnosis.candidates.likely_sets import Known, LikelySets, shapes_of
from bayesimpact.diagnosis.candidates.period_sets import PeriodSets
from bayesimpact.diagnosis.candidates.period_terms import periods_with_terms
from bayesimpact.diagnosis.candidates.promising import NEAR_BEST, NEAR_MARGIN
from bayesimpact.diagnosis.candidates.term_sets import TermSets
from bayesimpact.diagnosis.measurement.hums import recordings_without_hums
from bayesimpact.diagnosis.refits.extend import transfer
from bayesimpact.diagnosis.refits.refit import Candidate
from bayesimpact.diagnosis.score_test.directions import is_periodic
from bayesimpact.diagnosis.thresholds import EXCESS
from bayesimpact.formula.law import is_formula
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect, Scales

ASKED = 4  # effects that are tried beside a model, by every problem
ALIKE = 1.0 - 1.0 / EXCESS**2  # of what an effect explains: what explains more may imitate it


class Asked:
    """Problems of the equation of motion and of periods ahead, by what they are posed about."""

    def __init__(self, base: Fit, effects: Sequence[Effect], scales: Scales) -> None:
        self.base, self.effects, self.scales = base, effects, scales
        self.of_motion: dict[tuple[object, ...], LikelySets] = {}
        self.of_periods: dict[tuple[object, ...], PeriodSets] = {}
        self.has_stop = base.density.oscillator.campaign.stop
        recordings = base.density.oscillator.campaign.recordings
        self.quiet = recordings_without_hums(recordings)
        self.hums = any(a is not b for a, b in zip(self.quiet, recordings, strict=True))

    def about(self, model: Candidate, flight: bool) -> LikelySets:
        """The problem about a model's rest and gap, of stretches in `flight` or of all."""
        key = model.ids, model.fit.log_posterior, flight
        if key not in self.of_motion:
            layout = self.base.density.oscillator.layout
            mode = transfer(
                model.fit, layout, self.base.density.oscillator.effects, self.scales, {}
            )
            self.of_motion[key] = LikelySets(
                replace(self.base, mode=mode), self.effects, self.scales,
                flight=flight, known=known_effects(model), recordings=self.of_the_motion(model),
            )  # fmt: skip
        return self.of_motion[key]

    def ahead(self, model: Candidate, about: Candidate) -> PeriodSets:
        """The problem of periods ahead of a model, with what it shares with `about` as that has
        it.
        """
        key = model.ids, about.ids, about.fit.log_posterior
        if key not in self.of_periods:
            layout = model.fit.density.oscillator.layout
            mode = transfer(about.fit, layout, model.effects, self.scales, {})
            at = replace(model.fit, mode=mode)
            self.of_periods[key] = PeriodSets(
                at, self.effects, self.scales, recordings=self.of_the_motion(model)
            )
        return self.of_periods[key]

    def ahead_with_terms(self, model: Candidate) -> PeriodSets:
        """The problem of periods ahead of a model, with the terms of the grammar."""
        recordings = self.of_the_motion(model)
        return periods_with_terms(model.fit, self.effects, self.scales, recordings)

    def of_the_motion(self, model: Candidate) -> Sequence[Recording] | None:
        """The recordings less their hums, which no motion makes; None where the model has a line,
        or there are none.
        """
        acting = (*model.fit.density.oscillator.acting, *model.effects)
        return None if not self.hums or any(map(is_periodic, acting)) else self.quiet

    def first(
        self, model: Candidate, about: Candidate, instead: str = ""
    ) -> tuple[set[str], set[str]]:
        """Effects that are asked for first beside a model, and all that were asked about.

        The equation of motion is posed `about` the best model known. With a stop it is asked for
        what acts in flight, and periods ahead of the model for the rest; where no period is told,
        the equation over all stretches. In the place of an effect `instead`, where `about` leaves
        nothing, only what comes near its gain by a problem that sees it is asked for, and all that
        is as good as alike there.
        """
        problems: list[tuple[TermSets, tuple[str, ...]]] = []
        problems.append((self.about(about, self.has_stop), model.ids))
        if self.has_stop:
            ahead = self.ahead(model, about)
            every = (self.about(about, flight=False), model.ids)
            problems.append((ahead, ()) if ahead.terms else every)
        gains = [problem.gains(ids) for problem, ids in problems]
        judging = [g for g in gains if instead in g] or gains
        first, seen = set[str](), set[str]()
        for found in judging:
            least = NEAR_BEST * found.get(instead, -np.inf) - NEAR_MARGIN
            kept = {i: g for i, g in found.items() if i not in seen and g >= least}
            first |= set(sorted(kept, key=lambda i: -kept[i])[:ASKED])
            seen |= set(found)
        if instead:
            shares = (problem.likeness(ids, instead) for problem, ids in problems)
            first |= {i for alike in shares for i, share in alike.items() if share > ALIKE}
        return first, seen.union(*gains)


def known_effects(model: Candidate) -> list[Known]:
    """Of a model's effects those whose shapes no grid holds, periodic ones and terms of formulas,
    with the shapes that its fit has found.
    """
    return [
        (effect, shapes_of(model.fit, effect))
        for effect in model.effects
        if is_a_force(effect) and (is_periodic(effect) or is_formula(effect))
    ]
