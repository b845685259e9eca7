"""The population that the campaigns come from: mean and scatter of every parameter.

A normal hierarchical model, x_i ~ N(mu, tau^2 + s_i^2), flat in mu and half-Cauchy in tau (Gelman
2006): the single posteriors of these campaigns are near normal and their priors wide, so mu is
normal for every tau and the integral over tau is one-dimensional.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.stats import norm

Array = NDArray[np.float64]

FEWEST = 3  # campaigns: two say hardly anything of a scatter
GRID = 400  # values of tau
LEVELS = (0.05, 0.5, 0.95)


@dataclass(frozen=True)
class Population:
    """Quantiles (5, 50, 95 %) of a parameter's mean and scatter over campaigns, SI."""

    parameter: str
    campaigns: int
    mean: tuple[float, float, float]
    scatter: tuple[float, float, float]


def population(parameter: str, estimates: Array, errors: Array) -> Population | None:
    """Posterior of mean and scatter from estimates (n,) and their standard errors (n,).

    None for fewer than `FEWEST` campaigns, or without errors above zero.
    """
    if estimates.size < FEWEST or not (errors > 0).all():
        return None
    scale = float(np.std(estimates)) + float(np.median(errors))
    angle = (np.arange(GRID) + 0.5) / GRID * 0.5 * np.pi  # equal prior mass of a half-Cauchy
    tau = scale * np.tan(angle)
    weights = 1.0 / (errors**2 + tau[:, None] ** 2)
    precision = weights.sum(axis=1)
    mu = (weights @ estimates) / precision
    chi2 = np.einsum("kn,kn->k", weights, (estimates - mu[:, None]) ** 2)
    log_mass = 0.5 * np.log(weights).sum(axis=1) - 0.5 * np.log(precision) - 0.5 * chi2
    mass = np.exp(log_mass - log_mass.max())
    mass /= mass.sum()
    return Population(
        parameter,
        int(estimates.size),
        _mixture(mass, mu, 1.0 / np.sqrt(precision)),
        _quantiles(mass, tau),
    )


def _mixture(mass: Array, mu: Array, sd: Array) -> tuple[float, float, float]:
    """Quantiles of a mixture of normal distributions."""
    kept = mass > 1e-12 * mass.max()
    low, high = float((mu - 9 * sd)[kept].min()), float((mu + 9 * sd)[kept].max())

    def quantile(level: float) -> float:
        def beyond(x: float) -> float:
            return float(mass[kept] @ norm.cdf((x - mu[kept]) / sd[kept])) - level

        return float(brentq(beyond, low, high, xtol=1e-15 * max(abs(low), abs(high), 1e-300)))

    first, middle, last = (quantile(level) for level in LEVELS)
    return first, middle, last


def _quantiles(mass: Array, tau: Array) -> tuple[float, float, float]:
    first, middle, last = np.interp(LEVELS, np.cumsum(mass) - 0.5 * mass, tau)
    return float(first), float(middle), float(last)
