"""The steps of an ascent to a mode: damped, in the bounds, corrected where a minimum is curved."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.inference.fit import (
    Fit,
    PosteriorDensity,
    grams,
    inverse,
    likelihood_gradient,
    likelihood_information,
)
from bayesimpact.inference.likelihood import Linearisation

Array = NDArray[np.float64]

TRIES = 12  # dampings, each eight times the last one
BENT_AT = 0.1  # of a step: where its second derivative is taken
SHARE = 0.05  # of the standard deviation by itself: steps for differences
SHORTER = 0.1  # of that, where steps of that size led nowhere: the model bends or jumps within them
ROUGH = np.log(4.0)  # steps that were off by more give derivatives for one step only


@dataclass(frozen=True, eq=False)
class Point:
    """Theta (d,) with the best noise levels; minus the log posterior there; sums of squares and
    residuals (where derivatives may serve several steps) of the recordings.
    """

    theta: Array
    value: float
    sums: Array
    residuals: tuple[Array, ...] | None


@dataclass(frozen=True, eq=False)
class Slope:
    """Derivatives at a point, matrix (d, d) and vector (d,) of the normal equations."""

    parts: tuple[Linearisation, ...]
    matrix: Array
    vector: Array

    @property
    def is_finite(self) -> bool:
        """Whether a step can be taken."""
        return bool(np.isfinite(self.matrix).all() and np.isfinite(self.vector).all())


class Ascent:
    """One ascent: what stays fixed while theta moves, and the derivatives that still serve."""

    def __init__(
        self,
        density: PosteriorDensity,
        steps: Array | None,
        slopes: tuple[Linearisation, ...] | None,
        fixed: Sequence[int],
    ) -> None:
        layout = density.oscillator.layout
        self.density = density
        self.steps, self.slopes = steps, slopes
        self.products = () if slopes is None else grams(slopes)
        self.frozen = slopes is not None
        self.stale = False  # the derivatives are those of an earlier theta
        self.roughly = steps is not None and not self.frozen  # good enough far from the mode
        self.share = SHARE
        self.iterations = 0
        self.noise = layout.roles("noise")
        free = layout.roles("physical", "effect", "nuisance")
        self.moving = np.setdiff1d(free, np.array(fixed, dtype=np.int64))
        physical = np.array([(p.lower, p.upper) for p in layout.parameters])
        self.lower = np.maximum(density.priors.lower, physical[:, 0])
        self.upper = np.minimum(density.priors.upper, physical[:, 1])

    def evaluate(self, theta: Array) -> Point:
        """The point at theta, moved inside its bounds."""
        theta = np.clip(theta, self.lower, self.upper)
        likelihood, left = self.density.likelihood, None
        if self.steps is None and not self.frozen:
            sums = likelihood.misfit(theta)[0]
        else:
            with np.errstate(over="ignore", invalid="ignore"):  # a motion that ran away: no point
                residuals, (sums,) = likelihood.residuals_and_sums(theta[None])
            left = tuple(white[0] for white in residuals)
        if not np.isfinite(sums).all():
            return Point(theta, np.inf, sums, left)
        theta[self.noise] = best_sigma(self.density, sums)
        prior = float(self.density.priors.log_density(theta[None])[0])
        return Point(theta, -float(self._log_likelihood(theta, sums)) - prior, sums, left)

    def _log_likelihood(self, theta: Array, sums: Array) -> float:
        likelihood = self.density.likelihood
        sigma = theta[likelihood.sigma_columns]
        constant = np.sum(likelihood.log_volume - 0.5 * likelihood.sizes * np.log(2 * np.pi))
        misfit = np.sum(likelihood.sizes * np.log(sigma) + sums / (2 * sigma**2))
        return float(constant - misfit)

    def linear(self, here: Point) -> Slope:
        """Normal equations of the next step; derivatives by differences serve several steps."""
        likelihood, priors, theta = self.density.likelihood, self.density.priors, here.theta
        parts = self._parts(here)
        sigma = theta[likelihood.sigma_columns]
        matrix = likelihood_information(parts, self.products, sigma, theta.size)
        vector = likelihood_gradient(parts, sigma, theta.size) + priors.gradient(theta)
        known = priors.information(theta)
        known[self.noise] = 0.0
        matrix += np.diag(known)
        if self.steps is not None and not self.stale and np.isfinite(matrix).all():
            own = np.diag(matrix)[self.moving]
            told = own > 0
            steps = self.steps.copy()
            steps[self.moving[told]] = self.share / np.sqrt(own[told])
            if np.max(np.abs(np.log(steps / self.steps))) > ROUGH:
                self.renew()
            self.steps = steps
        return Slope(parts, matrix, vector)

    def _parts(self, here: Point) -> tuple[Linearisation, ...]:
        if self.slopes is None or here.residuals is None:
            likelihood = self.density.likelihood
            self.slopes = likelihood.linearise(here.theta, self.steps, roughly=self.roughly)
            self.products = grams(self.slopes)
            self.stale = False
            return self.slopes
        self.stale = not self.frozen
        pairs = zip(self.slopes, here.residuals, strict=True)
        return tuple(replace(part, residual=white) for part, white in pairs)

    def renew(self) -> None:
        """New derivatives at the next step."""
        self.slopes = None

    @property
    def can_shorten(self) -> bool:
        """Whether differences over shorter steps are left to try."""
        return self.steps is not None and not self.frozen and self.share == SHARE

    def refine(self) -> None:
        """From now on derivatives to second order of their steps."""
        self.roughly = False
        self.renew()

    def shorten(self) -> None:
        """From now on differences over shorter steps."""
        if self.steps is not None:
            self.share, self.steps = self.share * SHORTER, self.steps * SHORTER
        self.renew()

    def descend(
        self, here: Point, slope: Slope, damping: float, *, once: bool
    ) -> tuple[Point, float]:
        """The next point, `here` itself where none is better, and the damping it took.

        `once`: neither more damping nor a bent step is tried.
        """
        for _ in range(1 if once else TRIES):
            step = self.step(here.theta, slope, damping)
            there = self.evaluate(here.theta + step)
            if there.value > here.value and not once:
                bend = self.bend(here.theta, slope, step, damping)
                there = self.evaluate(here.theta + step + bend)
            if there.value <= here.value:
                return there, damping
            damping = max(damping * 8, 1e-9)
        return here, damping

    def step(self, theta: Array, slope: Slope, damping: float) -> Array:
        """Damped Gauss-Newton step; a parameter at a bound that it would leave stays there."""
        matrix, vector = slope.matrix, slope.vector
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

    def bend(self, theta: Array, slope: Slope, step: Array, damping: float) -> Array:
        """What a step must be corrected by to follow a narrow minimum that curves, to second order.

        The geodesic acceleration of Transtrum and Sethna 2012, from one more simulation.
        """
        likelihood, part_way = self.density.likelihood, theta + BENT_AT * step
        if any(likelihood.steps):  # what readings scatter by about a staircase is no curvature
            return np.zeros(theta.size)
        ahead = []
        for part, white in zip(slope.parts, likelihood.residuals(part_way[None]), strict=True):
            straight = part.residual - BENT_AT * part.jacobian @ step[part.columns]
            ahead.append(replace(part, residual=(white[0] - straight) * 2.0 / BENT_AT**2))
        sigma = theta[likelihood.sigma_columns]
        vector = likelihood_gradient(ahead, sigma, theta.size)
        if not np.isfinite(vector).all():
            return np.zeros(theta.size)
        return 0.5 * self.step(theta, replace(slope, vector=vector), damping)

    def without_mode(self, here: Point, parts: tuple[Linearisation, ...]) -> Fit:
        """The record of an ascent that led to no mode of anything: the caller sees its value."""
        unknown = np.full((here.theta.size, here.theta.size), np.nan)
        return Fit(
            self.density, here.theta, unknown, -np.inf, here.sums, False, self.iterations, parts
        )

    def fit(self, here: Point, converged: bool) -> Fit:
        """The record of an ascent that ends here."""
        theta, sums = here.theta, here.sums
        if self.stale or self.roughly:
            self.refine()
        slope = self.linear(here)
        parts, matrix = slope.parts, slope.matrix
        if not np.isfinite(matrix).all():
            return self.without_mode(here, parts)
        sizes, sigma = self.density.likelihood.sizes, theta[self.density.likelihood.sigma_columns]
        for column in np.unique(self.density.likelihood.sigma_columns):
            mine = self.density.likelihood.sigma_columns == column
            level = sigma[mine][0]
            information = 3 * sums[mine].sum() / level**4 - sizes[mine].sum() / level**2
            prior = self.density.priors.hessian(theta)[column]
            matrix[column, column] = max(information - prior, sizes[mine].sum() / level**2)
        return Fit(
            self.density, theta, inverse(matrix), -here.value, sums, converged,
            self.iterations, parts,
        )  # fmt: skip


def best_sigma(density: PosteriorDensity, sums: Array) -> Array:
    """Noise levels, one per noise parameter, m, that maximise the posterior for `sums` (R,)."""
    likelihood, layout = density.likelihood, density.oscillator.layout
    result = []
    for column in layout.roles("noise"):
        mine = likelihood.sigma_columns == column
        n, s = likelihood.sizes[mine].sum(), max(float(sums[mine].sum()), 1e-300)
        prior = density.priors.parameters[column]
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
