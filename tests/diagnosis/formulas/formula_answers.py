"""Answers of searches that know too little, and what formulas make of them."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from small_rig import PLAIN, PLAIN_RELEASES, record

from bayesimpact.diagnosis.budget import PATIENCE, begin
from bayesimpact.diagnosis.formulas.search import Answer, with_formulas
from bayesimpact.diagnosis.measurement.repetition import residual_repetition
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import Candidate, base_candidate, grown
from bayesimpact.diagnosis.residual_force.gaussian_process import missing_drift, missing_force
from bayesimpact.diagnosis.score_test.scan import score_directions
from bayesimpact.diagnosis.selection.decision import Decision
from bayesimpact.diagnosis.selection.outcome import ExaminedModel, Selection
from bayesimpact.diagnosis.selection.unknown import with_force
from bayesimpact.inference.identify import identify
from bayesimpact.model.effects.effect import Effect, Scales

DETENT = {"stiffness": 8.0, "place": -2.5e-3, "width": 7e-4}
DRAG = {"coefficient": 0.02}  # seven times as much is told from v^3


def unknown(effects: dict[str, Any], named: tuple[Effect, ...] = ()) -> tuple[Answer, Scales]:
    """What a diagnosis that knows no effect, or names one, ends with: a learned force."""
    rng = np.random.default_rng(0)
    campaign = record(3, effects, rig=PLAIN, releases=PLAIN_RELEASES, duration=4.0, rate=500.0)
    base = base_candidate(identify(campaign, rng=rng, search=False).fit)
    scales = campaign_scales(base.fit)
    first = examined = state_of(base, scales, rng)
    if named:
        examined = state_of(grown(base, named, scales), scales, rng)
    chosen = examined.candidate
    repetition = residual_repetition(chosen.fit)
    selection = Selection(
        first, examined, (chosen, base)[: 1 + len(named)], np.log(50.0), repetition
    )
    learned = with_force(chosen, examined.force, scales)
    decision = Decision("partly" if named else "unknown", named)
    return Answer(selection, decision, learned.fit, examined), scales


def state_of(candidate: Candidate, scales: Scales, rng: np.random.Generator) -> ExaminedModel:
    fit = candidate.fit
    scored = score_directions(fit, (), rng=rng)
    force, drift = (f(fit, scales, rng=rng) for f in (missing_force, missing_drift))
    return ExaminedModel(candidate, scored, force, drift)


def asked(answer: Answer, scales: Scales, looks: int = 99, said: list[str] | None = None) -> Answer:
    """With time for so many looks at the clock; what it said goes to `said`."""
    said = [] if said is None else said
    rng = np.random.default_rng(1)
    times = itertools.chain([0.0] * (1 + looks), itertools.repeat(PATIENCE))
    budget = begin(lambda: next(times))
    return with_formulas(answer, (), scales, rng=rng, progress=said.append, budget=budget)
