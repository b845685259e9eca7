"""Log marginal likelihood of a fit by Laplace's method, with bounds and structured priors.

Values of one kind, one per obstacle or recording, share a scatter that is not known beforehand:
normal about a common mean with a standard deviation between a ten millionth of their priors' and
all of it (`extend.WIDEST` physical scales), uniform in the logarithm; their mean has the prior of
the parameter that they replace. So do the states in which recordings begin; their mean is 0 and
their prior as wide as their law allows. Independent priors of the physical scale would make small
differences, however certain, cost eight nats apiece, and large ones, about a base fit that leaves
most of the recordings unexplained, hundreds.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import special, stats

from bayesimpact.inference.fit import Fit, inverse, likelihood_gradient
from bayesimpact.inference.prior import LogNormal, Normal, Prior, Uniform
from bayesimpact.model.effects.effect import EffectParameter

Array = NDArray[np.float64]

SHARED_SDS = np.logspace(-7, 0, 15)  # of values of one kind, in their priors' standard deviations
UNMEASURED = 1e-4  # precision, in that of the prior, from which on nothing was measured


def model_evidence(fit: Fit) -> float:
    """Log evidence of a fit with everything that its priors mean together."""
    value = log_evidence(fit)
    return value + structure(fit) if np.isfinite(value) else value


def structure(fit: Fit) -> float:
    """What `log_evidence` must gain for phases, and for values that share a scatter, nats."""
    gain = 0.0
    for effect in fit.density.oscillator.acting:
        for parameter in effect.parameters:
            own = f"{effect.id}.{parameter.name}"
            at = np.array([i for i, n in enumerate(fit.names) if n.split("[")[0] == own], np.int64)
            priors = [fit.density.priors.parameters[i] for i in at]
            if parameter.circular:  # the interval of three turns holds the mode three times
                turns = [(p.upper - p.lower) / (2 * np.pi) for p in priors if type(p) is Uniform]
                gain += float(np.sum(np.log(np.maximum(turns, 1.0))))
            elif (parameter.replaces or parameter.initial) and len(set(priors)) == 1:
                gain += _of_one_kind(fit, parameter, at, priors[0])
    return gain


def _of_one_kind(
    fit: Fit, parameter: EffectParameter, at: NDArray[np.int64], prior: Prior
) -> float:
    """What values at these positions, each with this prior, gain by a scatter that they share."""
    if not isinstance(prior, Normal) or (parameter.replaces and at.size == 1):
        return 0.0
    density = None
    if parameter.replaces:
        shared = fit.density.replaced.get(parameter.replaces, prior)
        density = float(shared.log_density(np.array(fit.mode[at].mean())))
    return shared_sd_evidence(fit.mode[at], fit.covariance[np.ix_(at, at)], prior, density)


def shared_sd_evidence(
    mode: Array, covariance: Array, prior: Normal, density: float | None
) -> float:
    """Evidence of a common scatter about a common mean over that of independent priors, nats.

    Parameters
    ----------
    mode, covariance : (K,), (K, K) posterior under independent priors
    prior : of each value
    density : log density of the prior of their mean, flat as far as the values say where that is;
        None for a mean that is known, the prior's
    """
    size = mode.size
    posterior = inverse(covariance)
    values, vectors = np.linalg.eigh(posterior * prior.sd**2 - np.eye(size))
    # covariance of the likelihood
    measured = (vectors * (prior.sd**2 / np.maximum(values, UNMEASURED))) @ vectors.T
    centre = measured @ (posterior @ (mode - prior.mean))
    shared = [
        _log_density(centre, (s * prior.sd) ** 2 * np.eye(size) + measured, density)
        for s in SHARED_SDS
    ]
    each = _log_density(centre, prior.sd**2 * np.eye(size) + measured, None)
    return float(special.logsumexp(shared) - np.log(SHARED_SDS.size) - each)


def _log_density(x: Array, covariance: Array, density: float | None) -> float:
    """Log density of N(m, covariance) at x, m = 0, or over a mean m of all its parts with this log
    density, without the factors of 2 pi; no more than at the best mean.
    """
    if density is None:
        square = float(x @ np.linalg.solve(covariance, x))
        return -0.5 * (float(np.linalg.slogdet(covariance)[1]) + square)
    _, log_det = np.linalg.slogdet(covariance)
    solved = np.linalg.solve(covariance, np.column_stack([x, np.ones(x.size)]))
    precision = float(solved[:, 1].sum())
    mean = float(solved[:, 0].sum()) / precision
    width = 0.5 * float(np.log(2 * np.pi / precision))
    left = x - mean
    square = float(left @ (solved[:, 0] - mean * solved[:, 1]))
    return -0.5 * (float(log_det) + square) + min(density + width, 0.0)


def log_evidence(fit: Fit) -> float:
    """Log marginal likelihood by Laplace's method.

    A parameter with a bound near its mode gets the normal mass that is left inside: Phi of the
    distance, or, where the mode sits on the bound with a slope, the exact one-dimensional integral
    of the exponential of a quadratic. A parameter with a log-normal prior is near normal in its
    logarithm; there the mode lies a little higher, by a slope of one. Accurate for the
    near-Gaussian posteriors of this problem (Tierney and Kadane 1986).
    """
    if not np.isfinite(fit.log_posterior) or not np.isfinite(fit.sd).all():
        return -np.inf
    lower = np.maximum(
        fit.density.priors.lower, [p.lower for p in fit.density.oscillator.layout.parameters]
    )
    sign, log_det = np.linalg.slogdet(_unit(fit.covariance))
    scale = np.log(fit.sd).sum()
    if sign <= 0:
        return -np.inf
    value = fit.log_posterior + 0.5 * fit.mode.size * np.log(2 * np.pi) + 0.5 * log_det + scale
    logs = _log_normal(fit)
    value += 0.5 * float(
        np.sum(fit.covariance[np.ix_(logs, logs)] / np.outer(*[fit.mode[logs]] * 2))
    )
    inside = (fit.mode - lower) / fit.sd
    inside[logs] = np.inf
    for i in np.flatnonzero(inside < 8).tolist():
        value += _boundary(float(inside[i]), i, fit)
    return float(value)


def _log_normal(fit: Fit) -> NDArray[np.int64]:
    """Positions of parameters, the noise level apart, with log-normal priors."""
    priors = fit.density.priors.parameters
    moving = fit.density.oscillator.layout.roles("physical", "effect", "nuisance")
    return np.array([i for i in moving if isinstance(priors[i], LogNormal)], dtype=np.int64)


def _unit(covariance: Array) -> Array:
    sd = np.sqrt(np.diag(covariance))
    return np.asarray(covariance / np.outer(sd, sd))


def _boundary(distance: float, index: int, fit: Fit) -> float:
    if distance > 1e-6:
        return float(stats.norm.logcdf(distance))
    slope = -gradient(fit)[index] * fit.sd[index]  # of the negative log posterior, per sd, >= 0
    return float(np.log(special.erfcx(max(slope, 0.0) / np.sqrt(2)) / 2))


def gradient(fit: Fit) -> Array:
    """Gradient of the log posterior at a fit, (d,)."""
    sigma = fit.mode[fit.density.likelihood.sigma_columns]
    slope = likelihood_gradient(fit.linearisation, sigma, fit.mode.size)
    return np.asarray(slope + fit.density.priors.gradient(fit.mode))
