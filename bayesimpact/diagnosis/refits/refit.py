"""Full nonlinear refits with added effects, started from what the scores predict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.short_repr import short_repr
from bayesimpact.diagnosis.refits.equivalent import equivalent
from bayesimpact.diagnosis.refits.evidence import model_evidence
from bayesimpact.diagnosis.refits.extend import (
    at_null,
    difference_steps,
    extend,
    owner,
    transfer,
)
from bayesimpact.diagnosis.score_test.scores import Score
from bayesimpact.diagnosis.thresholds import LARGE
from bayesimpact.formula.law import is_formula_id
from bayesimpact.inference.ascent import Ascent
from bayesimpact.inference.fit import Fit, PosteriorDensity
from bayesimpact.inference.initial.horizon import by_stretches, growing_horizon
from bayesimpact.inference.mode import find_mode
from bayesimpact.model.effects.effect import Effect, Scales
from bayesimpact.model.parameters import is_added

Array = NDArray[np.float64]

TOLERANCE = 0.02  # last step of a refit, standard deviations
ITERATIONS = 40
SHARES = (0.5, 0.25, 0.125, 0.0625)  # of the predicted shift, where the whole of it goes too far
GAINED = 1.0  # nats: what gains less than this over a model that it contains begins again
LITTLE = 0.1  # nats of odds: an ascent that gains less by a step decides nothing


@dataclass(frozen=True, eq=False)
class Candidate:
    """A model with added effects, fitted.

    Attributes
    ----------
    effects : ids, in the order in which they were added
    fit : its mode
    log_evidence : by Laplace's method, with the truncation of bounded parameters
    refused : what that would be of a model that is refused since it has a line that may be the
        motion's own (`own_band`); None of every other
    """

    effects: tuple[Effect, ...]
    fit: Fit
    log_evidence: float
    refused: float | None = None

    __repr__ = short_repr

    @property
    def ids(self) -> tuple[str, ...]:
        """Ids of the effects."""
        return tuple(e.id for e in self.effects)

    def price(self, cost: float) -> float:
        """Nats of log odds that the effects cost: `cost` each, and what a formula's length does."""
        return sum((cost + e.price for e in self.effects), start=0.0)

    @cached_property
    def prior_shares(self) -> Array:
        """Shares (m,), 0 to 1, of the posterior precision that come from the priors.

        Along the directions in which the two are diagonal together (generalized eigenvalues); of
        all parameters but noise levels.
        """
        fit = self.fit
        moving = np.setdiff1d(
            np.arange(fit.mode.size), fit.density.oscillator.layout.roles("noise")
        )
        known = np.sqrt(fit.density.priors.information(fit.mode)[moving])
        shares = fit.covariance[np.ix_(moving, moving)] * np.outer(known, known)
        return np.asarray(np.clip(np.linalg.eigvalsh(shares), 0.0, 1.0))


def in_words(effects: Sequence[Effect]) -> str:
    """What a model adds, as a search tells it: ids, but a formula's, which is no name."""
    return " + ".join(e.title if is_formula_id(e.id) else e.id for e in effects)


@dataclass(frozen=True)
class Enough:
    """When an ascent may end early, see `find_mode`.

    Attributes
    ----------
    goal : log likelihood, nats, below which an end is of no use
    least_gain : of a step, nats: less decides nothing
    """

    goal: float = -np.inf
    least_gain: float = 0.0


TO_THE_MODE = Enough()


def base_candidate(fit: Fit) -> Candidate:
    """The base model as a candidate."""
    return Candidate(fit.density.oscillator.effects, fit, model_evidence(fit))


def refit(
    fit: Fit, scores: Sequence[Score], scales: Scales, *, enough: Enough = TO_THE_MODE
) -> Candidate:
    """Fit the model of `fit` with the effects of `scores` added.

    The scores are linear predictions. The ascent begins at the best point between the unshifted
    model and the predicted one; one that gains nothing begins again at either end. Where the misfit
    is large, predictions point beyond the mode and side minima lie close: there an ascent over
    growing stretches of the recordings is taken too.
    """
    effects = (*fit.density.oscillator.effects, *(s.effect for s in scores))
    shapes = {name: value for s in scores for name, value in s.shapes.items()}
    density = extend(fit, effects, scales)
    names = density.oscillator.layout.names
    unshifted = transfer(fit, density.oscillator.layout, effects, scales, shapes)
    predicted = unshifted.copy()
    _shift(fit, names, predicted, scores)
    steps = difference_steps(
        fit, density, step_sizes(names, density.oscillator.acting, scales, scores)
    )
    start = best_start(density, unshifted, predicted, steps)
    goal = enough.goal + prior_at(density, unshifted)
    options: dict[str, Any] = {
        "steps": steps, "tolerance": TOLERANCE, "max_iterations": ITERATIONS, "goal": goal,
        "least_gain": enough.least_gain,
    }  # fmt: skip
    if fit.reduced_chi2 > LARGE**2:
        found = of_two_ways(density, start, unshifted, steps, goal)
    else:
        found = find_mode(density, start, **options)
    for other in (predicted, unshifted):
        gained = found.log_likelihood > fit.log_likelihood + GAINED
        if not (np.array_equal(start, other) or gained):
            found = better(found, find_mode(density, other, **options))
    return Candidate(effects, found, model_evidence(found))


def fit_from(
    fit: Fit,
    effects: Sequence[Effect],
    values: Mapping[str, float],
    scales: Scales,
    *,
    goal: float = -np.inf,
) -> Candidate:
    """Fit a base model with effects from given values of parameters, over growing stretches; to an
    end of use where that reaches a log likelihood of `goal`.
    """
    density, start = start_of_set(fit, effects, values, scales)
    layout, acting = density.oscillator.layout, density.oscillator.acting
    steps = difference_steps(fit, density, step_sizes(layout.names, acting, scales, ()))
    found = growing_horizon(
        density, start,
        steps=steps, fixed=_shapes(density), tolerance=TOLERANCE, max_iterations=ITERATIONS,
        goal=goal + prior_at(density, start),
    )  # fmt: skip
    return Candidate(tuple(effects), found, model_evidence(found))


def start_of_set(
    fit: Fit, effects: Sequence[Effect], values: Mapping[str, float], scales: Scales
) -> tuple[PosteriorDensity, Array]:
    """The posterior of a base model with effects, and where its parameters (d,) have given values,
    inside their bounds.
    """
    density = extend(fit, effects, scales)
    layout, priors = density.oscillator.layout, density.priors
    start = transfer(fit, layout, effects, scales, values)
    for i, parameter in enumerate(layout.parameters):
        if parameter.name in values:
            low, high = max(parameter.lower, priors.lower[i]), min(parameter.upper, priors.upper[i])
            start[i] = np.clip(values[parameter.name], low, high)
    return density, start


def of_two_ways(
    density: PosteriorDensity, start: Array, first: Array, steps: Array, goal: float
) -> Fit:
    """The likelier end of an ascent from `start` and of the one that ever longer stretches lead to
    from `first`. Either ends early where it will not reach a log posterior of `goal`, the ascent
    also where it will not come as far as the stretches did.
    """
    theta, reached = _stretched(density, first, steps)
    found = find_mode(
        density, start,
        steps=steps, tolerance=TOLERANCE, max_iterations=ITERATIONS, goal=max(goal, reached),
    )  # fmt: skip
    return _or_from(found, theta, reached, steps, goal)


def or_by_stretches(found: Fit, start: Array, steps: Array | None, goal: float = -np.inf) -> Fit:
    """The end of an ascent, or the one that ever longer stretches lead to from the same start."""
    return _or_from(found, *_stretched(found.density, start, steps), steps, goal)


def _stretched(density: PosteriorDensity, start: Array, steps: Array | None) -> tuple[Array, float]:
    """Where ever longer stretches lead to, and the log posterior of the whole recordings there."""
    theta = by_stretches(density, start, steps=steps, fixed=_shapes(density))
    return theta, -Ascent(density, steps, None, ()).evaluate(theta.copy()).value


def _or_from(found: Fit, theta: Array, reached: float, steps: Array | None, goal: float) -> Fit:
    """The end of an ascent, or of one from where stretches lead to, if they `reached` more.

    They do where they lead to another mode than an ascent that ended in a side minimum; from starts
    some cycles off, no fewer modes are found than by going on in any case (by test).
    """
    if not reached > found.log_posterior:
        return found
    other = find_mode(
        found.density, theta,
        steps=steps, tolerance=TOLERANCE, max_iterations=ITERATIONS, goal=goal,
    )  # fmt: skip
    return better(found, other)


def prior_at(density: PosteriorDensity, theta: Array) -> float:
    """Log prior density at one point (d,)."""
    return float(np.ravel(density.priors.log_density(theta[None]))[0])


def _shapes(density: PosteriorDensity) -> list[int]:
    """Positions of the shapes of effects, which short stretches should not move."""
    o = density.oscillator
    added = [(i, owner(o.acting, n)[1]) for i, n in enumerate(o.layout.names) if is_added(n)]
    return [i for i, parameter in added if parameter.is_shape]


def better(one: Fit, other: Fit) -> Fit:
    """The likelier one of two ends of ascents."""
    return max(one, other, key=lambda f: np.nan_to_num(f.log_posterior, nan=-np.inf))


def best_start(
    density: PosteriorDensity, unshifted: Array, predicted: Array, steps: Array
) -> Array:
    """The likeliest point on the line from one start to another (d,).

    The predicted end is taken where it is no worse than the unshifted one.
    """
    ascent = Ascent(density, steps, None, ())
    least = ascent.evaluate(unshifted.copy()).value
    shares = np.array([1.0, *SHARES])
    values = []
    for share in shares:
        point = unshifted + share * (predicted - unshifted)
        values.append(ascent.evaluate(point).value)
        if share == 1.0 and values[0] <= least:
            break
    best = int(np.argmin(np.nan_to_num(values, nan=np.inf)))
    if not values[best] < least and values[0] > least:
        return unshifted
    return np.asarray(unshifted + shares[best] * (predicted - unshifted))


def without(
    candidate: Candidate, effect: Effect, scales: Scales, *, enough: Enough = TO_THE_MODE
) -> Candidate:
    """The candidate's model without one of its effects, refitted."""
    rest = tuple(e for e in candidate.effects if e.id != effect.id)
    return _refitted(candidate, rest, scales, enough)


def grown(candidate: Candidate, effects: tuple[Effect, ...], scales: Scales) -> Candidate:
    """A larger model fitted from the candidate's mode."""
    return _refitted(candidate, effects, scales)


def exchanged(
    candidate: Candidate, old: Effect, new: Effect, scales: Scales, *, enough: Enough = TO_THE_MODE
) -> Candidate:
    """The candidate's model with an effect in the place of one of its own.

    The ascent begins where that one stands: an effect without a size cannot grow from nothing, and
    the model without either may be a side minimum from which another one does not. A force begins
    with the size at which it does most of what the other one does (`equivalent`).
    """
    effects = (*(e for e in candidate.effects if e.id != old.id), new)
    values = equivalent(old, new, candidate.fit, scales)
    return _refitted(candidate, effects, scales, enough, values)


def _refitted(
    candidate: Candidate,
    effects: tuple[Effect, ...],
    scales: Scales,
    enough: Enough = TO_THE_MODE,
    values: Mapping[str, float] | None = None,
) -> Candidate:
    """A model fitted from the candidate's mode, effects that it lacks at some `values`, where these
    are likelier, or at their null.
    """
    density = extend(candidate.fit, effects, scales)
    layout = density.oscillator.layout
    start = transfer(candidate.fit, layout, effects, scales, {})
    sizes = step_sizes(layout.names, density.oscillator.acting, scales, ())
    steps = difference_steps(candidate.fit, density, sizes)
    if values:
        known = [values.get(name, own) for name, own in zip(layout.names, start, strict=True)]
        start = best_start(density, start, np.array(known), steps)
    goal = enough.goal + prior_at(density, start)
    options: dict[str, Any] = {
        "steps": steps, "tolerance": TOLERANCE, "max_iterations": ITERATIONS, "goal": goal,
        "least_gain": enough.least_gain,
    }  # fmt: skip
    found = find_mode(density, start, **options)
    if not np.isfinite(found.log_posterior):  # an effect that is gone had kept the motion bounded
        start = at_null(density, start)
        found = find_mode(density, start, **options)
    if found.reduced_chi2 > LARGE**2:
        found = or_by_stretches(found, start, steps, goal)
    return Candidate(effects, found, model_evidence(found))


def step_sizes(
    names: Sequence[str], effects: Sequence[Effect], scales: Scales, scores: Sequence[Score]
) -> dict[str, float]:
    """Expected standard deviations of effect parameters, for difference steps."""
    sizes: dict[str, float] = {}
    for name in names:
        if is_added(name):
            sizes[name] = 1e-4 * owner(effects, name)[1].scale(scales)
        elif "[" not in name:
            sizes[name] = 1e-6
    for score in scores:
        sizes.update(zip(score.names, map(float, score.size_sd), strict=True))
    return sizes


def _shift(fit: Fit, names: Sequence[str], start: Array, scores: Sequence[Score]) -> None:
    """Move the start to the sizes that the scores expect, and the shared parameters with them."""
    position = {name: i for i, name in enumerate(names)}
    for score in scores:
        for name, size in zip(score.names, score.size, strict=True):
            if name in position:
                null = start[position[name]]
                start[position[name]] = null + size
        for name, shift in zip(fit.names, score.bias * fit.sd, strict=True):
            if name in position:
                start[position[name]] -= shift


def tempered_evidence(candidate: Candidate, repetition: float) -> float:
    """Log evidence when only one sample in `repetition` tells something new.

    Where a misfit stays, residuals repeat themselves over many samples and the ordinary evidence
    counts every repetition. The likelihood to the power 1 / repetition counts each once (coarsened
    posterior, Miller and Dunson 2019; power posterior, Friel and Pettitt 2008); its curvature is
    flatter by the same factor.
    """
    fit = candidate.fit
    if repetition <= 1.0 or not np.isfinite(candidate.log_evidence):
        return candidate.log_evidence
    lost = (1.0 - 1.0 / repetition) * fit.log_likelihood
    known = candidate.prior_shares
    gained = -0.5 * np.sum(np.log((1.0 - known) / repetition + known))
    gained += 0.5 * fit.density.oscillator.layout.roles("noise").size * np.log(repetition)
    return candidate.log_evidence - lost + float(gained)
