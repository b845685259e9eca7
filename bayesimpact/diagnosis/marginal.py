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

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from bayesimpact.inference.fit import Fit, inverse
from bayesimpact.inference.likelihood import Linearisation

Array = NDArray[np.float64]
Index = NDArray[np.int64]

REACH = 40.0  # of ln k: from a force far below the noise to one far above it
TINY = 1e-12  # of what is left; less is rounding
SHARES = (1.0, 0.5, 0.25, 0.1)  # of a Gauss-Newton step: the first one that gains is taken
STEPS = 4  # with the same derivatives
RENEWALS = 4  # at most, of the derivatives
GAINED = 0.1  # nats: what gains less is the mode
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
    along : per recording, responses times derivatives and, last, residual
    whole : products of J and, last, the residual, (d + 1, d + 1)
    total : number of samples
    """

    parts: tuple[Part, ...]
    columns: tuple[Index, ...]
    jacobians: tuple[Array, ...]
    along: tuple[Array, ...]
    whole: Array
    total: float

    def beside(self, log_k: float) -> tuple[Array, float]:
        """[J r]' (1 + k D D')^-1 [J r] and log |1 + k D D'|."""
        found, volume, k = self.whole.copy(), 0.0, float(np.exp(log_k))
        for part, at, along in zip(self.parts, self.columns, self.along, strict=True):
            weights = k / (1.0 + k * part.squares)
            where = np.append(at, found.shape[0] - 1)
            found[np.ix_(where, where)] -= along.T @ (weights[:, None] * along)
            volume += float(np.log1p(k * part.squares).sum())
        return found, volume

    @property
    def bounds(self) -> tuple[float, float]:
        """Of ln k."""
        least = -np.log(max(float(part.squares.max()) for part in self.parts)) - 0.1 * REACH
        return least, least + REACH

    def at(self, residuals: Sequence[Array]) -> Products:
        """The same derivatives with other residuals, in units of the noise."""
        whole, along = self.whole.copy(), []
        whole[-1] = whole[:, -1] = 0.0
        rows = zip(self.parts, self.columns, self.jacobians, self.along, residuals, strict=True)
        for part, at, jacobian, before, left in rows:
            whole[at, -1] += jacobian.T @ left
            whole[-1, -1] += left @ left
            along.append(np.column_stack([before[:, :-1], part.responses.T @ left]))
        whole[-1, :-1] = whole[:-1, -1]
        return replace(self, along=tuple(along), whole=whole)


def products(fit: Fit, parts: Sequence[Part], linear: Sequence[Linearisation]) -> Products:
    """Of a fit linearised somewhere, with responses along its own motion or a near one."""
    likelihood, size = fit.target.likelihood, fit.mode.size
    level = likelihood.noise.level
    whole, along = np.zeros((size + 1, size + 1)), []
    for part, lin in zip(parts, linear, strict=True):
        at = np.append(lin.columns, size)
        own = np.column_stack([lin.jacobian, lin.residual]) / level
        whole[np.ix_(at, at)] += own.T @ own
        along.append(part.responses.T @ own)
    columns = tuple(lin.columns for lin in linear)
    jacobians = tuple(lin.jacobian / level for lin in linear)
    total = float(likelihood.sizes.sum())
    return Products(tuple(parts), columns, jacobians, tuple(along), whole, total)


@dataclass(frozen=True, eq=False)
class _Point:
    """Log evidence about one parameter vector, the force's size at its best, and a step on."""

    theta: Array
    found: Products
    value: float
    step: Array


def gain(fit: Fit, parts: Sequence[Part]) -> float:
    """What the force adds to a model's log evidence, its size and the noise level at their best."""
    priors, likelihood = fit.target.priors, fit.target.likelihood
    free = fit.target.oscillator.layout.roles("physical", "effect", "nuisance")
    here = _climbed(fit, _point(fit, fit.mode, products(fit, parts, fit.linearisation)))
    level, total = likelihood.noise.level, here.found.total
    unit = float(np.sum(likelihood.log_volume)) - total * np.log(level * np.sqrt(2 * np.pi))
    alone = fit.log_likelihood + 0.5 * _log_volume(fit.covariance[np.ix_(free, free)])
    alone += float(np.ravel(priors.log_density(fit.mode[None]))[0])
    return float(unit + here.value - alone)


def _climbed(fit: Fit, start: _Point) -> _Point:
    """The mode beside the force, from the fit's own."""
    here = _stepped(fit, start)
    steps = STEP / np.sqrt(np.diag(inverse(fit.covariance)))
    for _ in range(RENEWALS):
        linear = fit.target.likelihood.linearise(here.theta, steps, roughly=True)
        if not all(np.isfinite(part.jacobian).all() for part in linear):
            break
        renewed = _point(fit, here.theta, products(fit, start.found.parts, linear))
        if not np.isfinite(renewed.value):
            break
        further = _stepped(fit, renewed)
        here, gained = further, further.value - renewed.value
        if gained < GAINED:
            break
    return here


def _stepped(fit: Fit, here: _Point) -> _Point:
    """As far as the derivatives at a point lead."""
    for _ in range(STEPS):
        points = (_moved(fit, here, share) for share in SHARES)
        further = next((p for p in points if p is not None and p.value > here.value), here)
        gained, here = further.value - here.value, further
        if gained < GAINED:
            break
    return here


def _moved(fit: Fit, here: _Point, share: float) -> _Point | None:
    """A share of the step on, with the true residual there; None where the motion runs away."""
    target = fit.target
    bounds = np.array([(p.lower, p.upper) for p in target.oscillator.layout.parameters])
    lower = np.maximum(bounds[:, 0], target.priors.lower)
    upper = np.minimum(bounds[:, 1], target.priors.upper)
    theta = np.clip(here.theta + share * here.step, lower, upper)
    left = [
        row[0] / target.likelihood.noise.level for row in target.likelihood.residuals(theta[None])
    ]
    if not all(np.isfinite(row).all() for row in left):
        return None
    return _point(fit, theta, here.found.at(left))


def _point(fit: Fit, theta: Array, found: Products) -> _Point:
    layout, priors = fit.target.oscillator.layout, fit.target.priors
    free, noise = layout.roles("physical", "effect", "nuisance"), layout.roles("noise")
    information, slope = np.array(priors.information(theta)), np.nan_to_num(priors.gradient(theta))
    information[noise], slope[noise] = 1.0, 0.0  # held

    def spread(own: Array, left: float) -> Array:
        return inverse(own * found.total / left + np.diag(information))

    def minus(log_k: float) -> float:
        matrix, volume = found.beside(log_k)
        left = max(float(matrix[-1, -1]), TINY * float(found.whole[-1, -1]))
        chance = found.total * (1.0 + np.log(left / found.total)) + volume
        return float(
            0.5 * (chance - _log_volume(spread(matrix[:-1, :-1], left)[np.ix_(free, free)]))
        )

    best = minimize_scalar(minus, bounds=found.bounds, method="bounded")
    matrix, _ = found.beside(float(best.x))
    left = max(float(matrix[-1, -1]), TINY * float(found.whole[-1, -1]))
    step = spread(matrix[:-1, :-1], left) @ (matrix[:-1, -1] * found.total / left + slope)
    prior = float(np.ravel(priors.log_density(theta[None]))[0])
    return _Point(theta, found, prior - float(best.fun), step)


def _log_volume(covariance: Array) -> float:
    """Log determinant."""
    sd = np.sqrt(np.diag(covariance))
    scaled = float(np.linalg.slogdet(covariance / np.outer(sd, sd))[1])
    return float(scaled + 2.0 * np.log(sd).sum())
