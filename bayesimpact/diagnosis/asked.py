"""What the equation of motion asks for about any model of a search.

Forces are evaluated along the measured motion, but counted from the rest reading and the gap of a
fit. Those of a base model make up for what it lacks: about a rest that is a little wrong, a
quadratic spring reads as a stiffness that changes. So the problem is posed anew about each better
model (as Gauss and Newton linearise anew at each step). Where there is a stop it is posed twice:
over stretches of free flight, which no law of the stop disturbs, and over all of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from bayesimpact.diagnosis.directions import is_periodic
from bayesimpact.diagnosis.equation_error import is_a_force
from bayesimpact.diagnosis.extend import transfer
from bayesimpact.diagnosis.likely_sets import Known, LikelySets, shapes_of
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
        o = base.target.oscillator
        self.has_stop = o.campaign.stop
        whole = self.about(Candidate(o.effects, base, 0.0), flight=False)
        self.seen = {term.effect.id for term in whole.terms}

    def about(self, model: Candidate, flight: bool) -> LikelySets:
        """The problem about a model's rest and gap, of stretches in `flight` or of all."""
        key = model.ids, model.fit.log_posterior, flight
        if key not in self.posed:
            layout = self.base.target.oscillator.layout
            mode = transfer(model.fit, layout, self.base.target.oscillator.effects, self.scales, {})
            at, known = replace(self.base, mode=mode), known_effects(model)
            self.posed[key] = LikelySets(at, self.effects, self.scales, flight=flight, known=known)
        return self.posed[key]

    def first(self, model: Candidate, about: Candidate) -> set[str]:
        """Effects that are asked for first beside a model, posed `about` the best one known.

        What acts in flight is judged there, the others by all stretches.
        """
        first, seen = set[str](), set[str]()
        for flight in (True, False) if self.has_stop else (False,):
            found = self.about(about, flight).gains(model.ids)
            gains = {i: g for i, g in found.items() if i not in seen}
            first |= set(sorted(gains, key=lambda i: -gains[i])[:ASKED])
            seen |= set(gains)
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
