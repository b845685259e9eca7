"""What the equation of motion and periods ahead ask for about any model of a search.

Forces are evaluated along the measured motion, but counted from the rest reading and the gap of a
fit. Those of a base model make up for what it lacks: about a rest that is a little wrong, a
quadratic spring reads as a stiffness that changes. So the problem is posed anew about each better
model (as Gauss and Newton linearise anew at each step). Where there is a stop it is posed twice:
over stretches of free flight, which no law of the stop disturbs, and over all of them; and what the
stop does is asked of simulations of one period ahead (`period_sets`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayesimpact.diagnosis.directions import is_periodic
from bayesimpact.diagnosis.equation_error import is_a_force
from bayesimpact.diagnosis.extend import transfer
from bayesimpact.diagnosis.likely_sets import Known, LikelySets, shapes_of
from bayesimpact.diagnosis.period_sets import PeriodSets
from bayesimpact.diagnosis.promising import NEAR_BEST, NEAR_MARGIN
from bayesimpact.diagnosis.refit import Candidate
from bayesimpact.formula.law import is_formula
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect, Scales

ASKED = 4  # effects that are tried beside a model, of the flight and of the contact


class Asked:
    """Problems of the equation of motion, by the model that they are posed about."""

    def __init__(self, base: Fit, effects: Sequence[Effect], scales: Scales) -> None:
        self.base, self.effects, self.scales = base, effects, scales
        self.posed: dict[tuple[object, ...], LikelySets] = {}
        self.of_periods: dict[tuple[object, ...], PeriodSets] = {}
        o = base.target.oscillator
        self.has_stop = o.campaign.stop
        model = Candidate(o.effects, base, 0.0)
        terms = [*self.about(model, flight=False).terms]
        terms += self.ahead(model, model).terms if self.has_stop else []
        self.seen = {term.effect.id for term in terms}

    def about(self, model: Candidate, flight: bool) -> LikelySets:
        """The problem about a model's rest and gap, of stretches in `flight` or of all."""
        key = model.ids, model.fit.log_posterior, flight
        if key not in self.posed:
            layout = self.base.target.oscillator.layout
            mode = transfer(model.fit, layout, self.base.target.oscillator.effects, self.scales, {})
            at, known = replace(self.base, mode=mode), known_effects(model)
            self.posed[key] = LikelySets(at, self.effects, self.scales, flight=flight, known=known)
        return self.posed[key]

    def ahead(self, model: Candidate, about: Candidate) -> PeriodSets:
        """The problem of periods ahead of a model, with what it shares with `about` as that has
        it.
        """
        key = model.ids, about.ids, about.fit.log_posterior
        if key not in self.of_periods:
            layout = model.fit.target.oscillator.layout
            mode = transfer(about.fit, layout, model.effects, self.scales, {})
            at = replace(model.fit, mode=mode)
            self.of_periods[key] = PeriodSets(at, self.effects, self.scales)
        return self.of_periods[key]

    def first(self, model: Candidate, about: Candidate, instead: str = "") -> set[str]:
        """Effects that are asked for first beside a model: by the equation of motion, posed `about`
        the best one known; with a stop what acts in flight is judged there, the others by periods
        ahead of the model itself. In the place of an effect `instead`, where `about` leaves
        nothing, only those that come near its gain.
        """
        gains = [self.about(about, self.has_stop).gains(model.ids)]
        if self.has_stop:
            gains.append(self.ahead(model, about).gains())
        first, seen = set[str](), set[str]()
        for found in [g for g in gains if instead in ("", *g)]:
            least = NEAR_BEST * found.get(instead, -np.inf) - NEAR_MARGIN
            kept = {i: g for i, g in found.items() if i not in seen and g >= least}
            first |= set(sorted(kept, key=lambda i: -kept[i])[:ASKED])
            seen |= set(found)
        return first


def known_effects(model: Candidate) -> list[Known]:
    """Of a model's effects those whose shapes no grid holds, periodic ones and terms of formulas,
    with the shapes that its fit has found.
    """
    return [
        (effect, shapes_of(model.fit, effect))
        for effect in model.effects
        if is_a_force(effect) and (is_periodic(effect) or is_formula(effect))
    ]
