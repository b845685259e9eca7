"""Log marginal likelihood of a fit by Laplace's method, with bounds and structured priors.

Values of one kind, one per obstacle or recording, share a spread that is not known beforehand:
normal about a common mean with a standard deviation between the physical scale and a hundred
thousandth of it, uniform in the logarithm. Priors of the full scale for each of them would make
small differences, however certain, cost eight nats apiece.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import special, stats

from bayesimpact.inference.fit import Fit, inverse, likelihood_gradient
from bayesimpact.inference.prior import LogNormal, Normal, Uniform

Array = NDArray[np.float64]

SPREADS = np.logspace(-5, 0, 11)  # of values of one kind, in physical scales
UNMEASURED = 1e-4  # precision, in that of the prior, from which on nothing was measured


def model_evidence(fit: Fit) -> float:
    """Log evidence of a fit with everything that its priors mean together."""
    value = log_evidence(fit)
    return value + structure(fit) if np.isfinite(value) else value


def structure(fit: Fit) -> float:
    """What `log_evidence` must gain for phases, and for values that share a spread, nats."""
    gain = 0.0
    for effect in fit.target.oscillator.acting:
        for parameter in effect.parameters:
            own = f"{effect.id}.{parameter.name}"
            at = np.array([i for i, n in enumerate(fit.names) if n.split("[")[0] == own], np.int64)
            priors = [fit.target.priors.parameters[i] for i in at]
            if parameter.circular:  # the interval of three turns holds the mode three times
                turns = [(p.upper - p.lower) / (2 * np.pi) for p in priors if type(p) is Uniform]
                gain += float(np.sum(np.log(np.maximum(turns, 1.0))))
            elif parameter.replaces and at.size > 1 and len(set(priors)) == 1:
                prior = priors[0]
                if isinstance(prior, Normal):
                    gain += common_spread(
                        fit.mode[at], fit.covariance[np.ix_(at, at)], prior.mean, prior.sd
                    ) + common_mean(fit, parameter.replaces, float(fit.mode[at].mean()), prior)
    return gain


def common_mean(fit: Fit, slot: str, value: float, prior: Normal) -> float:
    """Log density of a common mean under the prior of what it replaces, over that of `prior`."""
    before = fit.target.replaced.get(slot)
    if before is None:
        return 0.0
    return float(before.log_density(np.array(value)) - prior.log_density(np.array(prior.mean)))


def common_spread(mode: Array, covariance: Array, mean: float, sd: float) -> float:
    """Evidence of a common spread over that of independent normal priors, nats.

    Parameters
    ----------
    mode, covariance : (K,), (K, K) posterior under independent priors N(mean, sd^2)
    """
    size = mode.size
    posterior = inverse(covariance)
    values, vectors = np.linalg.eigh(posterior * sd**2 - np.eye(size))
    likelihood = (vectors * (sd**2 / np.maximum(values, UNMEASURED))) @ vectors.T  # its covariance
    centre = likelihood @ (posterior @ (mode - mean))
    together = sd**2 * np.ones((size, size))
    shared = [
        _log_normal_density(centre, (s * sd) ** 2 * np.eye(size) + together + likelihood)
        for s in SPREADS
    ]
    independent = _log_normal_density(centre, sd**2 * np.eye(size) + likelihood)
    return float(special.logsumexp(shared) - np.log(SPREADS.size) - independent)


def _log_normal_density(x: Array, covariance: Array) -> float:
    """Log density of N(0, covariance) at x, without the factors of 2 pi."""
    _, log_det = np.linalg.slogdet(covariance)
    return float(-0.5 * (x @ np.linalg.solve(covariance, x) + log_det))


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
        fit.target.priors.lower, [p.lower for p in fit.target.oscillator.layout.parameters]
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
    priors = fit.target.priors.parameters
    moving = fit.target.oscillator.layout.roles("physical", "effect", "nuisance")
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
    sigma = fit.mode[fit.target.likelihood.sigma_columns]
    slope = likelihood_gradient(fit.linearisation, sigma, fit.mode.size)
    return np.asarray(slope + fit.target.priors.gradient(fit.mode))
