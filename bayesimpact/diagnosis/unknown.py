"""Physics outside the catalogue: the missing force is learned together with the parameters."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesimpact.diagnosis.evidence import model_evidence
from bayesimpact.diagnosis.extend import difference_steps, extend, transfer
from bayesimpact.diagnosis.force import MissingForce
from bayesimpact.diagnosis.refit import ITERATIONS, TOLERANCE, Candidate, best_start
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.mode import find_mode
from bayesimpact.model.effects.effect import Scales

Array = NDArray[np.float64]


def learn_force(fit: Fit, force: MissingForce, scales: Scales) -> Fit:
    """Fit the parameters and the coefficients of a free force together.

    The linearised problem says where to begin; where that is worse than no force, the climb begins
    between both.
    """
    effects = (*fit.target.oscillator.effects, force.effect)
    target = extend(fit, effects, scales)
    names = target.oscillator.layout.names
    unshifted = transfer(fit, target.oscillator.layout, effects, scales, {})
    start = unshifted.copy()
    coefficients = coefficient_names(force.knots)
    sd = np.sqrt(np.maximum(np.diag(force.covariance), 0.0))
    for coefficient, mean in zip(coefficients, force.mean, strict=True):
        start[names.index(coefficient)] = mean
    for name, shift in zip(fit.names, force.projection.absorbed @ force.mean, strict=True):
        start[names.index(name)] -= shift
    floor = 1e-9 * np.repeat([scales.force, scales.force / scales.speed], force.knots)
    sizes = dict(zip(coefficients, np.maximum(sd, floor), strict=True))
    steps = difference_steps(fit, target, sizes)
    start = best_start(target, unshifted, start, steps)
    return find_mode(target, start, steps=steps, tolerance=TOLERANCE, max_iterations=ITERATIONS)


def with_force(candidate: Candidate, force: MissingForce, scales: Scales) -> Candidate:
    """A model with a residual force beside its effects, fitted in full."""
    fit = learn_force(candidate.fit, force, scales)
    return Candidate(fit.target.oscillator.effects, fit, model_evidence(fit))


def coefficient_names(knots: int) -> tuple[str, ...]:
    """Names of the coefficients in theta, conservative ones first."""
    return tuple(f"learned_force.{part}{i + 1}" for part in "ab" for i in range(knots))
