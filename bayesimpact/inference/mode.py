"""The mode of a posterior and its curvature: Levenberg-Marquardt with the noise level profiled out.

For a given motion the best noise level has a one-dimensional optimum, so the search runs on

    f(theta) = sum_r [ n_r log sigma_r + S_r(theta) / (2 sigma_r^2) ] - log prior,   sigma at its
    optimum,

whose Gauss-Newton matrix is J'J / sigma^2 plus the priors' curvature (Levenberg 1944; Marquardt
1963). Raw sums of squares would span nine decades; f spans a few thousand nats.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.inference.fit import (
    Fit,
    Target,
    inverse,
    marginal_sd,
    normal_equations,
    prior_information,
)
from bayesimpact.inference.likelihood import Linearisation

Array = NDArray[np.float64]

SLOW = 0.5  # of the last step's size: above that, old derivatives are renewed
ROUGH = np.log(4.0)  # steps that were off by more give derivatives for one step only


def find_mode(
    target: Target,
    start: Array,
    *,
    steps: Array | None = None,
    slopes: tuple[Linearisation, ...] | None = None,
    tolerance: float = 1e-3,
    max_iterations: int = 60,
) -> Fit:
    """Climb from `start` (d,) to the nearest mode.

    `steps` (d,) are difference steps for models without exact derivatives; they are refreshed to a
    twentieth of the standard deviations as these become known. `slopes` are derivatives that hold
    near enough all the way (the chord method), where they are known and new ones would be dear. The
    noise levels in `start` are ignored. Stops when a step is below `tolerance` standard deviations.
    """
    climb = _Climb(target, steps, slopes)
    theta, value, sums = climb.evaluate(start)
    damping, converged, last = 1e-3, False, np.inf
    while climb.iterations < max_iterations and not converged:
        _, matrix, vector = climb.linear(theta)
        if not (np.isfinite(matrix).all() and np.isfinite(vector).all()):
            break
        whole = climb.step(theta, matrix, vector, 0.0)
        size = float(np.sqrt(np.maximum(whole @ matrix @ whole, 0.0)))  # damping must not hide it
        if climb.stale and (size < tolerance or size > SLOW * last):
            climb.renew()  # old derivatives neither decide nor creep
            continue
        last = size
        for _ in range(12):
            step = climb.step(theta, matrix, vector, damping)
            trial, trial_value, trial_sums = climb.evaluate(theta + step)
            if trial_value <= value:
                theta, value, sums = trial, trial_value, trial_sums
                damping = max(damping * 0.1, 1e-12)
                break
            if size < tolerance or climb.stale:
                break
            damping = max(damping * 8, 1e-9)
        converged = size < tolerance
        if trial_value > value and not converged:
            if not climb.stale:
                break
            climb.renew()
    return climb.fit(theta, value, sums, converged)


class _Climb:
    """One ascent: everything that stays fixed while theta moves."""

    def __init__(
        self, target: Target, steps: Array | None, slopes: tuple[Linearisation, ...] | None
    ) -> None:
        layout = target.oscillator.layout
        self.target = target
        self.steps, self.slopes = steps, slopes
        self.frozen = slopes is not None
        self.stale = False  # the derivatives are those of an earlier theta
        self.iterations = 0
        self.noise = layout.roles("noise")
        self.moving = layout.roles("physical", "effect", "nuisance")
        physical = np.array([(p.lower, p.upper) for p in layout.parameters])
        self.lower = np.maximum(target.priors.lower, physical[:, 0])
        self.upper = np.minimum(target.priors.upper, physical[:, 1])

    def evaluate(self, theta: Array) -> tuple[Array, float, Array]:
        """Theta moved inside its bounds, with the best noise levels; f there; sums of squares."""
        theta = np.clip(theta, self.lower, self.upper)
        sums = self.target.likelihood.misfit(theta)[0]
        if not np.isfinite(sums).all():
            return theta, np.inf, sums
        theta[self.noise] = best_sigma(self.target, sums)
        prior = float(self.target.priors.log_density(theta[None])[0])
        return theta, -float(self.log_likelihood(theta, sums)) - prior, sums

    def log_likelihood(self, theta: Array, sums: Array) -> float:
        likelihood = self.target.likelihood
        sigma = theta[likelihood.sigma_columns]
        constant = np.sum(likelihood.log_volume - 0.5 * likelihood.sizes * np.log(2 * np.pi))
        spread = np.sum(likelihood.sizes * np.log(sigma) + sums / (2 * sigma**2))
        return float(constant - spread)

    def linear(self, theta: Array) -> tuple[tuple[Linearisation, ...], Array, Array]:
        """Matrix and vector of the next step; derivatives by differences serve several steps."""
        self.iterations += 1
        likelihood, priors = self.target.likelihood, self.target.priors
        parts = self.parts(theta)
        matrix, vector = normal_equations(parts, theta[likelihood.sigma_columns], theta.size)
        information = prior_information(priors, theta)
        information[self.noise] = 0.0
        matrix += np.diag(information)
        vector += priors.gradient(theta)
        if self.steps is not None and not self.stale and np.isfinite(matrix).all():
            known = np.diag(matrix)[self.moving] > 0
            spread = marginal_sd(matrix[np.ix_(self.moving, self.moving)])
            steps = self.steps.copy()
            better = known & np.isfinite(spread) & (spread > 0)
            steps[self.moving[better]] = 0.05 * spread[better]
            if np.max(np.abs(np.log(steps / self.steps))) > ROUGH:
                self.renew()
            self.steps = steps
        return parts, matrix, vector

    def parts(self, theta: Array) -> tuple[Linearisation, ...]:
        likelihood = self.target.likelihood
        if self.slopes is None or (self.steps is None and not self.frozen):
            self.slopes, self.stale = likelihood.linearise(theta, self.steps), False
            return self.slopes
        self.stale = not self.frozen
        return tuple(
            replace(part, residual=likelihood.residual(r, theta[None])[0])
            for r, part in enumerate(self.slopes)
        )

    def renew(self) -> None:
        """New derivatives at the next step."""
        self.slopes = None

    def step(self, theta: Array, matrix: Array, vector: Array, damping: float) -> Array:
        """Damped Gauss-Newton step; a parameter pushed against its bound stays there."""
        step = np.zeros(theta.size)
        free = self.moving
        at_lower = (theta[free] <= self.lower[free]) & (vector[free] < 0)
        at_upper = (theta[free] >= self.upper[free]) & (vector[free] > 0)
        free = free[~(at_lower | at_upper)]
        for _ in range(free.size):
            block = matrix[np.ix_(free, free)]
            scale = np.sqrt(np.maximum(np.diag(block), 1e-300))
            scaled = block / np.outer(scale, scale)
            move = np.linalg.lstsq(
                scaled + damping * np.eye(free.size), vector[free] / scale, rcond=1e-15
            )[0]
            move = move / scale
            outside = (theta[free] + move < self.lower[free]) & (theta[free] <= self.lower[free])
            outside |= (theta[free] + move > self.upper[free]) & (theta[free] >= self.upper[free])
            if not outside.any():
                step[free] = move
                return step
            free = free[~outside]
        return step

    def fit(self, theta: Array, value: float, sums: Array, converged: bool) -> Fit:
        iterations = self.iterations
        if self.stale:
            self.renew()
        parts, matrix, _ = self.linear(theta)
        if not np.isfinite(matrix).all():  # not a mode of anything: the caller sees its value
            unknown = np.full(matrix.shape, np.nan)
            return Fit(self.target, theta, unknown, -np.inf, sums, False, iterations, parts)
        sizes, sigma = self.target.likelihood.sizes, theta[self.target.likelihood.sigma_columns]
        for column in np.unique(self.target.likelihood.sigma_columns):
            mine = self.target.likelihood.sigma_columns == column
            level = sigma[mine][0]
            information = 3 * sums[mine].sum() / level**4 - sizes[mine].sum() / level**2
            prior = self.target.priors.hessian(theta)[column]
            matrix[column, column] = max(information - prior, sizes[mine].sum() / level**2)
        return Fit(self.target, theta, inverse(matrix), -value, sums, converged, iterations, parts)


def best_sigma(target: Target, sums: Array) -> Array:
    """Noise levels, one per noise parameter, m, that maximise the posterior for `sums` (R,)."""
    likelihood, layout = target.likelihood, target.oscillator.layout
    result = []
    for column in layout.roles("noise"):
        mine = likelihood.sigma_columns == column
        n, s = likelihood.sizes[mine].sum(), max(float(sums[mine].sum()), 1e-300)
        prior = target.priors.parameters[column]
        log_sigma = 0.5 * np.log(s / n)
        for _ in range(60):  # Newton in log sigma
            sigma = np.exp(log_sigma)
            slope = -n + s / sigma**2
            bend = -2 * s / sigma**2
            if prior.support[0] < sigma < prior.support[1]:
                pull = float(prior.gradient(sigma)) * sigma
                slope += pull
                bend = min(bend + pull + float(prior.curvature(sigma)) * sigma**2, 0.1 * bend)
            change = -slope / bend
            log_sigma += float(np.clip(change, -1, 1))
            if abs(change) < 1e-12:
                break
        result.append(np.clip(np.exp(log_sigma), *prior.support))
    return np.array(result)
