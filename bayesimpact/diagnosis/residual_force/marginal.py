"""Log evidence of a model with a force of time beside it (`discrepancy`).

About a mode the residual r is linear in a change x of the parameters and in the force c at its
knots. With normal c that integrates out, r - J x ~ N(0, w^2 (1 + k D D')), and x by Laplace's
method about the mode beside the force. Gauss-Newton steps lead there, with the true residual at
each and new derivatives where old ones lead no further: that mode is often hundreds of the fit's
standard deviations away. The responses D along the motion of the model that comes nearest to the
recordings serve all models: they are compared under one and the same alternative, that what they
leave is a force which no law of the motion has (model error inside the likelihood: Kennedy and
O'Hagan 2001, J. R. Stat. Soc. B 63:425).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from bayesimpact.inference.fit import Fit, inverse
from bayesimpact.inference.likelihood import Linearisation

Array = NDArray[np.float64]
Index = NDArray[np.int64]

Residuals = Callable[[Array], Sequence[Array]]  # of theta (d,): one array per recording

REACH = 40.0  # of ln k: from a force far below the noise to one far above it
TINY = 1e-12  # of what is left; less is rounding
SHARES = (1.0, 0.5, 0.25, 0.1)  # of a Gauss-Newton step: the first one that gains is taken
STEPS = 4  # with the same derivatives
RENEWALS = 4  # at most, of the derivatives
GAINED = 0.1  # nats: what gains less is the mode
NEAR = 2.0  # of ln k: as far as one step of the parameters is expected to move it
CLOSE = 0.02  # of ln k; K knots make that less than K / 8 of its square, nats
STEP = 0.05  # of a standard deviation, other parameters as they are: for differences


@dataclass(frozen=True, eq=False)
class Part:
    """One recording's responses to a force of time.

    Attributes
    ----------
    responses : D (n, K), whitened, noise = 1, turned such that their products are diagonal
    squares : (K,) these products
    vectors : (K, K), values at the knots of every turned response
    """

    responses: Array
    squares: Array
    vectors: Array


@dataclass(frozen=True, eq=False)
class Products:
    """What the likelihood of a fit beside a force needs of its residuals and derivatives.

    Attributes
    ----------
    parts : per recording
    columns : per recording, positions in theta of its derivatives
    jacobians : per recording, in units of the noise
    along : all responses times derivatives and, last, residual, (K, d + 1), one recording's after
        the other's; 0 where its motion does not depend on a parameter
    squares : (K,) products of the responses
    whole : products of J and, last, the residual, (d + 1, d + 1)
    total : number of samples
    """

    parts: tuple[Part, ...]
    columns: tuple[Index, ...]
    jacobians: tuple[Array, ...]
    along: Array
    squares: Array
    whole: Array
    total: float

    def beside(self, log_k: float) -> tuple[Array, float]:
        """[J r]' (1 + k D D')^-1 [J r] and log |1 + k D D'|."""
        strength = float(np.exp(log_k)) * self.squares
        weights = float(np.exp(log_k)) / (1.0 + strength)
        found = self.whole - self.along.T @ (weights[:, None] * self.along)
        return found, float(np.log1p(strength).sum())

    @property
    def bounds(self) -> tuple[float, float]:
        """Of ln k."""
        least = -np.log(float(self.squares.max())) - 0.1 * REACH
        return least, least + REACH

    def at(self, residuals: Sequence[Array]) -> Products:
        """The same derivatives with other residuals, in units of the noise."""
        whole, along = self.whole.copy(), self.along.copy()
        whole[-1] = whole[:, -1] = 0.0
        for at, jacobian, left in zip(self.columns, self.jacobians, residuals, strict=True):
            whole[at, -1] += jacobian.T @ left
            whole[-1, -1] += left @ left
        whole[-1, :-1] = whole[:-1, -1]
        pairs = zip(self.parts, residuals, strict=True)
        along[:, -1] = np.concatenate([part.responses.T @ left for part, left in pairs])
        return replace(self, along=along, whole=whole)


def products(fit: Fit, parts: Sequence[Part], linear: Sequence[Linearisation]) -> Products:
    """Of a fit linearised somewhere, with responses along its own motion or a near one."""
    likelihood, size = fit.density.likelihood, fit.mode.size
    level = likelihood.noise.level
    whole, along = np.zeros((size + 1, size + 1)), []
    for part, lin in zip(parts, linear, strict=True):
        at = np.append(lin.columns, size)
        own = np.column_stack([lin.jacobian, lin.residual]) / level
        whole[np.ix_(at, at)] += own.T @ own
        along.append(np.zeros((part.squares.size, size + 1)))
        along[-1][:, at] = part.responses.T @ own
    columns = tuple(lin.columns for lin in linear)
    jacobians = tuple(lin.jacobian / level for lin in linear)
    total = float(likelihood.sizes.sum())
    squares = np.concatenate([part.squares for part in parts])
    return Products(tuple(parts), columns, jacobians, np.concatenate(along), squares, whole, total)


@dataclass(frozen=True, eq=False)
class _Point:
    """Log evidence about one parameter vector, the force's size at its best, and a step on."""

    theta: Array
    found: Products
    log_k: float
    value: float
    step: Array


def log_evidence_gain(fit: Fit, parts: Sequence[Part], least: float = -np.inf) -> float:
    """What the force adds to a model's log evidence, its size and the noise level at their best;
    where that is less than `least` by the derivatives at the fit's mode, what these say.
    """
    priors, likelihood = fit.density.priors, fit.density.likelihood
    free = fit.density.oscillator.layout.roles("physical", "effect", "nuisance")
    start = _point(fit, fit.mode, products(fit, parts, fit.linearisation))
    level, total = likelihood.noise.level, start.found.total
    unit = float(np.sum(likelihood.log_volume)) - total * np.log(level * np.sqrt(2 * np.pi))
    alone = _log_likelihood(fit) + 0.5 * _log_volume(fit.covariance[np.ix_(free, free)])
    alone += float(np.ravel(priors.log_density(fit.mode[None]))[0])
    known = float(unit - alone)
    straight = _stepped(fit, start, _by_derivatives(fit))
    if known + straight.value < least:
        return known + straight.value
    return known + _ascended(fit, start).value


def _log_likelihood(fit: Fit) -> float:
    """Of a fit's residuals by their squares, as those beside a force count: readings in coarse
    steps have another one (`rounding`).
    """
    sigma = fit.mode[fit.density.likelihood.sigma_columns]
    squares = np.array([part.residual @ part.residual for part in fit.linearisation])
    return fit.log_likelihood + 0.5 * float(np.sum((fit.sums - squares) / sigma**2))


def _ascended(fit: Fit, start: _Point) -> _Point:
    """The mode beside the force, from the fit's own."""
    residuals = _simulated(fit)
    here = _stepped(fit, start, residuals)
    steps = STEP / np.sqrt(np.diag(inverse(fit.covariance)))
    for _ in range(RENEWALS):
        linear = fit.density.likelihood.linearise(here.theta, steps, roughly=True)
        if not all(np.isfinite(part.jacobian).all() for part in linear):
            break
        renewed = _point(fit, here.theta, products(fit, start.found.parts, linear), here.log_k)
        if not np.isfinite(renewed.value):
            break
        further = _stepped(fit, renewed, residuals)
        here, gained = further, further.value - renewed.value
        if gained < GAINED:
            break
    return here


def _stepped(fit: Fit, here: _Point, residuals: Residuals) -> _Point:
    """As far as the derivatives at a point lead."""
    for _ in range(STEPS):
        points = (_moved(fit, here, share, residuals) for share in SHARES)
        further = next((p for p in points if p is not None and p.value > here.value), here)
        gained, here = further.value - here.value, further
        if gained < GAINED:
            break
    return here


def _moved(fit: Fit, here: _Point, share: float, residuals: Residuals) -> _Point | None:
    """A share of the step on, with the residuals there; None where the motion runs away."""
    density = fit.density
    bounds = np.array([(p.lower, p.upper) for p in density.oscillator.layout.parameters])
    lower = np.maximum(bounds[:, 0], density.priors.lower)
    upper = np.minimum(bounds[:, 1], density.priors.upper)
    theta = np.clip(here.theta + share * here.step, lower, upper)
    left = residuals(theta)
    if not all(np.isfinite(row).all() for row in left):
        return None
    return _point(fit, theta, here.found.at(left), here.log_k)


def _simulated(fit: Fit) -> Residuals:
    """The residuals of a model's motion, in units of the noise."""
    likelihood = fit.density.likelihood

    def residuals(theta: Array) -> list[Array]:
        return [row[0] / likelihood.noise.level for row in likelihood.residuals(theta[None])]

    return residuals


def _by_derivatives(fit: Fit) -> Residuals:
    """Residuals as the derivatives at the mode say, in units of the noise."""
    level = fit.density.likelihood.noise.level

    def residuals(theta: Array) -> list[Array]:
        change = theta - fit.mode
        return [
            (lin.residual - lin.jacobian @ change[lin.columns]) / level for lin in fit.linearisation
        ]

    return residuals


def _point(fit: Fit, theta: Array, found: Products, near: float | None = None) -> _Point:
    """About theta, of a force whose ln k is sought `near` one first."""
    layout, priors = fit.density.oscillator.layout, fit.density.priors
    free, noise = layout.roles("physical", "effect", "nuisance"), layout.roles("noise")
    information, slope = np.array(priors.information(theta)), np.nan_to_num(priors.gradient(theta))
    information[noise], slope[noise] = 1.0, 0.0  # held

    def precision(matrix: Array) -> tuple[Array, float]:
        left = max(float(matrix[-1, -1]), TINY * float(found.whole[-1, -1]))
        return matrix[:-1, :-1] * found.total / left + np.diag(information), left

    def minus(log_k: float) -> float:
        matrix, volume = found.beside(log_k)
        known, left = precision(matrix)
        chance = found.total * (1.0 + np.log(left / found.total)) + volume
        return float(0.5 * (chance + _log_volume(known[np.ix_(free, free)])))

    log_k, least = _least(minus, found.bounds, near)
    matrix, _ = found.beside(log_k)
    known, left = precision(matrix)
    step = inverse(known) @ (matrix[:-1, -1] * found.total / left + slope)
    prior = float(np.ravel(priors.log_density(theta[None]))[0])
    return _Point(theta, found, log_k, prior - least, step)


def _least(
    of: Callable[[float], float], bounds: tuple[float, float], near: float | None
) -> tuple[float, float]:
    """Where a function of ln k is least, and its value: about a point, where one is given and that
    is no end of where it was sought.
    """
    options = {"xatol": CLOSE}
    if near is not None:
        about = max(bounds[0], near - NEAR), min(bounds[1], near + NEAR)
        best = minimize_scalar(of, bounds=about, method="bounded", options=options)
        if about[0] + 2 * CLOSE < best.x < about[1] - 2 * CLOSE:
            return float(best.x), float(best.fun)
    best = minimize_scalar(of, bounds=bounds, method="bounded", options=options)
    return float(best.x), float(best.fun)


def _log_volume(matrix: Array) -> float:
    """Log determinant of a covariance or a precision; NaN where it has none."""
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        scale = np.sqrt(np.diag(matrix))
        scaled = float(np.linalg.slogdet(matrix / np.outer(scale, scale))[1])
        return float(scaled + 2.0 * np.log(scale).sum())
