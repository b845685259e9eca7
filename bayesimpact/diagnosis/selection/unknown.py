"""Physics outside the catalogue: the missing force is learned together with the parameters."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesimpact.diagnosis.measurement.repetition import residual_repetition
from bayesimpact.diagnosis.refits.evidence import model_evidence
from bayesimpact.diagnosis.refits.extend import campaign_scales, difference_steps, extend, transfer
from bayesimpact.diagnosis.refits.refit import (
    ITERATIONS,
    LITTLE,
    TOLERANCE,
    Candidate,
    best_start,
)
from bayesimpact.diagnosis.residual_force.gaussian_process import (
    MissingForce,
    missing_drift,
    missing_force,
    refinement,
)
from bayesimpact.diagnosis.residual_force.learned import LEARNED, knots_of, refined_force
from bayesimpact.diagnosis.selection.outcome import is_large, leaves_something
from bayesimpact.inference.fit import Fit, PosteriorDensity
from bayesimpact.inference.mode import find_mode
from bayesimpact.model.effects.effect import Effect, Scales

Array = NDArray[np.float64]

INTERVALS = (3, 7, 21, 42)  # between the knots; each divides a finer one


def learn_force(fit: Fit, force: MissingForce, scales: Scales, *, least_gain: float = 0.0) -> Fit:
    """Fit the parameters and the coefficients of a free force together; `least_gain` as in
    `find_mode`.

    The linearised problem says where to begin; where that is worse than no force, the ascent begins
    between both.
    """
    effects = (*fit.density.oscillator.effects, force.effect)
    density = extend(fit, effects, scales)
    names = density.oscillator.layout.names
    unshifted = transfer(fit, density.oscillator.layout, effects, scales, {})
    start = unshifted.copy()
    for coefficient, mean in zip(coefficient_names(force.knots), force.mean, strict=True):
        start[names.index(coefficient)] = mean
    for name, shift in zip(fit.names, force.projection.absorbed @ force.mean, strict=True):
        start[names.index(name)] -= shift
    sd = np.sqrt(np.maximum(np.diag(force.covariance), 0.0))
    floor = 1e-9 * np.repeat([scales.force, scales.force / scales.speed], force.knots)
    sizes = dict(zip(coefficient_names(force.knots), np.maximum(sd, floor), strict=True))
    steps = difference_steps(fit, density, sizes)
    return _ascended(density, best_start(density, unshifted, start, steps), steps, fit, least_gain)


def _ascended(
    density: PosteriorDensity, start: Array, steps: Array, before: Fit, least: float
) -> Fit:
    """The mode; where the misfit is large, as near as odds ask for, which count each repeated
    sample of a residual once.
    """
    if is_large(before):
        least = max(least, LITTLE * residual_repetition(before))
    return find_mode(
        density,
        start,
        steps=steps,
        tolerance=TOLERANCE,
        max_iterations=ITERATIONS,
        least_gain=least,
    )


def with_force(
    candidate: Candidate, force: MissingForce, scales: Scales, *, least_gain: float = 0.0
) -> Candidate:
    """A model with a residual force beside its effects, fitted in full, or to where steps gain less
    than `least_gain`.

    The linearised problem chooses how fine the force is; where something remains beside the force,
    a finer one is fitted from there, as long as that is likelier.
    """
    fit = learn_force(candidate.fit, force, scales, least_gain=least_gain)
    best = Candidate(fit.density.oscillator.effects, fit, model_evidence(fit))
    while leaves_something(best.fit) and (factors := finer_factors(best.effects[-1])):
        fit = _refined(candidate.fit, best.fit, factors[0], scales, least_gain)
        finer = Candidate(fit.density.oscillator.effects, fit, model_evidence(fit))
        if not finer.log_evidence > best.log_evidence:
            break
        best = finer
    return best


def with_free_force(fit: Fit) -> Fit:
    """A model with a free force beside it that all recordings share, of displacement and velocity
    or of time, whichever is likelier.
    """
    rng = np.random.default_rng(0)  # for their odds by chance, which are not asked for here
    scales = campaign_scales(fit)
    forces = [missing(fit, scales, rng=rng) for missing in (missing_force, missing_drift)]
    likelier = max(forces, key=lambda f: f.log_evidence)
    return with_force(Candidate(fit.density.oscillator.effects, fit, 0.0), likelier, scales).fit


def finer_factors(effect: Effect) -> list[int]:
    """How many times finer than those of a learned force nested knots may be."""
    knots = knots_of(effect)
    own = knots.count - 3
    return [n // own for n in INTERVALS if knots.reach == 0.0 and n > own and n % own == 0]


def _refined(before: Fit, found: Fit, factor: int, scales: Scales, least: float) -> Fit:
    """A model with its learned force on finer knots, fitted from where it stands.

    Cubic splines on nested knots: the finer one begins as exactly the same force.
    """
    *others, coarse = found.density.oscillator.effects
    finer = refined_force(coarse, factor)
    effects = (*others, finer)
    density = extend(before, effects, scales)
    count, more = knots_of(coarse).count, knots_of(finer).count
    known = dict(zip(found.names, zip(found.mode, found.sd, strict=True), strict=True))
    own = np.array([known[name] for name in coefficient_names(count)]).reshape(2, count, 2)
    values = np.einsum("kc,pcs->pks", refinement(count, factor), own).reshape(-1, 2)
    values[:, 1] = np.repeat(np.median(own[:, :, 1], axis=1), more)
    known |= dict(zip(coefficient_names(more), values, strict=True))
    start, sd = np.array([known[name] for name in density.oscillator.layout.names]).T
    return _ascended(density, start, 0.05 * np.maximum(sd, 1e-12 * np.abs(start)), found, least)


def coefficient_names(knots: int) -> tuple[str, ...]:
    """Names of the coefficients in theta, conservative ones first."""
    return tuple(f"{LEARNED}.{part}{i + 1}" for part in "ab" for i in range(knots))
