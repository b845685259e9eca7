"""Models, states and searches with made-up evidences, for the rules of the verdict."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from effect_rigs import BY_ID

from bayesimpact.diagnosis.refits.refit import Candidate
from bayesimpact.diagnosis.residual_force.learned import learned_drift, learned_force
from bayesimpact.diagnosis.selection.decision import decide
from bayesimpact.diagnosis.selection.outcome import ExaminedModel, Selection
from bayesimpact.diagnosis.thresholds import (
    ALPHA,
    DECISIVE,
)
from bayesimpact.model.effects.effect import Effect

COST = 3.8
OCCAM = 10.0  # nats between likelihood and evidence of a model with effects

WHITE = SimpleNamespace(likelihood=SimpleNamespace(noise=SimpleNamespace(is_coloured=False)))


def candidate(ids: str, evidence: float, chi2: float = 1.0) -> Candidate:
    """Effects by name, separated by blanks; log evidence over the base model's."""
    likelihood = 2000.0 + evidence + (OCCAM if ids else 0.0)
    fit = SimpleNamespace(reduced_chi2=chi2, log_likelihood=likelihood, density=WHITE)
    return Candidate(tuple(BY_ID[i] for i in ids.split()), fit, 1000.0 + evidence)


def examined(
    model: Candidate, p_catalogue: float = 0.5, p_force: float = 0.5, force_evidence: float = 0.0
) -> ExaminedModel:
    force = SimpleNamespace(
        p_value=p_force, log_evidence=force_evidence, gain=force_evidence + 2 * OCCAM
    )
    drift = SimpleNamespace(p_value=0.5, log_evidence=-1.0, gain=0.0)
    return ExaminedModel(model, SimpleNamespace(p_value=p_catalogue), force, drift)


def selection(
    chosen: ExaminedModel, *others: Candidate, base_p: float = 1e-6, base_chi2: float = 1.0,
    force_evidence: float = 0.0,
) -> Selection:  # fmt: skip
    base = examined(candidate("", 0.0, base_chi2), base_p, base_p, force_evidence)
    if not chosen.candidate.effects:
        base = chosen
    every = {c.ids: c for c in (base.candidate, chosen.candidate, *others)}
    worth = lambda c: c.log_evidence - COST * len(c.effects)  # noqa: E731
    return Selection(base, chosen, tuple(sorted(every.values(), key=worth, reverse=True)), COST)


FRICTION, DRAG = "coulomb_friction", "quadratic_drag"


def verdict_of(found: Selection) -> str:
    return decide(found).verdict


OF_MOTION, OF_TIME = learned_force(-1.0, 1.0, 1.0, 1.0), learned_drift(10.0, 1.0, 1.0, 1.0)


def beside_force(model: Candidate, evidence: float, force: Effect = OF_MOTION) -> Candidate:
    """A model with a residual force, and its log evidence less what that costs."""
    return Candidate((*model.effects, force), model.fit, 1000.0 + evidence + COST)


def remaining(
    chosen: ExaminedModel, without: float, chi2: float, *others: Candidate, beside: float = 0.0,
    instead: float = 0.0, force: Effect = OF_MOTION,
) -> Selection:  # fmt: skip
    """A chosen single effect beside which something remains.

    `without`: misfit over the noise without it; `chi2`: with it; log evidences of a residual force
    `beside` the effect and `instead` of it, where above zero, less what a further effect costs.
    """
    found = selection(chosen, *others, base_chi2=without)
    base = found.base
    for model, misfit in ((chosen, chi2), (base, without)):
        density = SimpleNamespace(
            likelihood=SimpleNamespace(
                noise=SimpleNamespace(level=1.0, level_error=0.01, is_coloured=False),
                sizes=np.array([1000.0]),
            )
        )
        vars(model.candidate.fit).update(
            density=density, sums=np.array([1000.0 * misfit]), reduced_chi2=misfit
        )
    residual = {
        frozenset(m.candidate.ids): beside_force(m.candidate, e, force)
        for m, e in ((chosen, beside), (base, instead))
        if e
    }
    examined_models = {frozenset(m.candidate.ids): m for m in (chosen, base)}
    return replace(found, examined_models=examined_models, residual=residual)


def something_left() -> ExaminedModel:
    return examined(candidate(FRICTION, 100.0), p_force=ALPHA / 2, force_evidence=2 * DECISIVE)


def with_misfit(model: Candidate, chi2: float) -> Candidate:
    fit = SimpleNamespace(**{**vars(model.fit), "sums": np.array([1000.0 * chi2])})
    return replace(model, fit=fit)
