"""The mode of a posterior and its curvature: Levenberg-Marquardt with the noise level profiled out.

For a given motion the best noise level has a one-dimensional optimum, so the search runs on

    f(theta) = sum_r [ n_r log sigma_r + S_r(theta) / (2 sigma_r^2) ] - log prior,   sigma at its
    optimum,

whose Gauss-Newton matrix is J'J / sigma^2 plus the priors' curvature (Levenberg 1944; Marquardt
1963). Raw sums of squares would span nine decades; f spans a few thousand nats.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bayesimpact.inference.likelihood import Likelihood, Linearisation
from bayesimpact.inference.priors import LogNormal, Prior, Priors
from bayesimpact.model.oscillator import Oscillator

Array = NDArray[np.float64]

SLOW = 0.5  # of the last step's size: above that, old derivatives are renewed
ROUGH = np.log(4.0)  # steps that were off by more give derivatives for one step only


@dataclass(frozen=True, eq=False)
class Target:
    """A posterior density: likelihood times priors.

    Attributes
    ----------
    replaced : priors of base parameters in whose place an effect has put others
    """

    likelihood: Likelihood
    priors: Priors
    replaced: Mapping[str, Prior] = field(default_factory=dict)

    @property
    def oscillator(self) -> Oscillator:
        """The model behind the likelihood."""
        return self.likelihood.oscillator

    def __call__(self, theta: Array) -> Array:
        """Log posterior up to the evidence, (B,); -inf where inadmissible."""
        theta = np.atleast_2d(theta)
        value = self.priors.log_density(theta)
        inside = np.isfinite(value)
        if inside.any():
            value[inside] += self.likelihood(theta[inside])
        return np.asarray(value)


@dataclass(frozen=True, eq=False)
class Fit:
    """The mode of one model's posterior.

    Attributes
    ----------
    target : what was maximised
    mode : (d,) parameters in the order of `target.oscillator.layout`
    covariance : (d, d) inverse of the negative log posterior's Gauss-Newton Hessian (Laplace)
    log_posterior : at the mode
    sums : (R,) whitened sums of squares, m2
    converged : the last step was below 1e-3 standard deviations
    iterations : steps taken
    linearisation : of every recording at the mode
    """

    target: Target
    mode: Array
    covariance: Array
    log_posterior: float
    sums: Array
    converged: bool
    iterations: int
    linearisation: tuple[Linearisation, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return self.target.oscillator.layout.names

    @property
    def sd(self) -> Array:
        """Standard deviations in the Laplace approximation, (d,)."""
        return np.sqrt(np.diag(self.covariance))

    def value(self, name: str) -> float:
        """The mode of one parameter."""
        return float(self.mode[self.target.oscillator.layout.index(name)])

    @property
    def log_likelihood(self) -> float:
        """Of the mode, nats."""
        return self.log_posterior - float(self.target.priors.log_density(self.mode[None])[0])

    @property
    def reduced_chi2(self) -> float:
        """Misfit per degree of freedom against the noise level estimated from recordings alone."""
        likelihood = self.target.likelihood
        freedom = float(likelihood.sizes.sum()) - (self.mode.size - 1)
        return float(self.sums.sum() / likelihood.noise.level**2 / freedom)

    @cached_property
    def predicted(self) -> tuple[Array, ...]:
        """What the probe would have read, per recording (n,), m."""
        return self.target.oscillator.predict(self.mode)

    @cached_property
    def residuals(self) -> tuple[Array, ...]:
        """Recorded minus predicted, per recording (n,), m."""
        recordings = self.target.oscillator.campaign.recordings
        pairs = zip(recordings, self.predicted, strict=True)
        return tuple(r.samples - p for r, p in pairs)

    @property
    def rms(self) -> float:
        """Root mean square residual over all samples, m."""
        return float(np.sqrt(np.mean(np.concatenate(self.residuals) ** 2)))


def normal_equations(
    linearisation: tuple[Linearisation, ...], sigma: Array, size: int
) -> tuple[Array, Array]:
    """J'J / sigma^2 (size, size) and J'r / sigma^2 (size,), summed; noise levels `sigma` (R,)."""
    matrix, vector = np.zeros((size, size)), np.zeros(size)
    for part, level in zip(linearisation, sigma, strict=True):
        scaled = part.jacobian / level
        matrix[np.ix_(part.columns, part.columns)] += scaled.T @ scaled
        vector[part.columns] += scaled.T @ (part.residual / level)
    return matrix, vector


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


def prior_information(priors: Priors, theta: Array) -> Array:
    """What the priors add to the information at theta (d,): inverse variances (d,), never negative.

    Minus the curvature of the log density, but for two kinds. A flat prior counts with its
    variance: next to what the recordings say it is nothing, and where they say nothing (an obstacle
    that was never touched) it keeps steps and covariances finite. A log-normal one, whose density
    is convex in its tail, counts as what it is in log x, a normal.
    """
    with np.errstate(divide="ignore"):
        flat = 12.0 / (priors.upper - priors.lower) ** 2
    information = np.maximum(np.nan_to_num(-priors.hessian(theta)), flat)
    for i, prior in enumerate(priors.parameters):
        if isinstance(prior, LogNormal):
            information[i] = 1.0 / (prior.sigma * theta[i]) ** 2
    return np.asarray(information)


def inverse(matrix: Array) -> Array:
    """Inverse of a symmetric positive (semi)definite matrix, after scaling to unit diagonal."""
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    scaled = np.linalg.pinv(matrix / np.outer(scale, scale), rcond=1e-14, hermitian=True)
    return np.asarray(scaled / np.outer(scale, scale))


def marginal_sd(matrix: Array) -> Array:
    """Standard deviations that go with an information matrix."""
    return np.asarray(np.sqrt(np.maximum(np.diag(inverse(matrix)), 0.0)))


def refit(fit: Fit, **changes: object) -> Fit:
    """The same fit with some fields replaced."""
    return replace(fit, **changes)  # type: ignore[arg-type]
