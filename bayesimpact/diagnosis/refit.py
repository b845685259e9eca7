"""Full nonlinear refits with added effects, started from what the scores predict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import special, stats

from bayesimpact.diagnosis.extend import (
    difference_steps,
    extend,
    owner,
    replaced_slot,
    transfer,
)
from bayesimpact.diagnosis.scores import Score
from bayesimpact.inference.fit import Fit, find_mode
from bayesimpact.inference.priors import LogNormal
from bayesimpact.model.effects.effect import Effect, Scales
from bayesimpact.model.parameters import is_added

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Candidate:
    """A model with added effects, fitted.

    Attributes
    ----------
    effects : ids, in the order in which they were added
    fit : its mode
    log_evidence : by Laplace's method, with the truncation of bounded parameters
    """

    effects: tuple[Effect, ...]
    fit: Fit
    log_evidence: float

    @property
    def ids(self) -> tuple[str, ...]:
        """Ids of the effects."""
        return tuple(e.id for e in self.effects)


def base_candidate(fit: Fit) -> Candidate:
    """The base model as a candidate."""
    return Candidate(fit.target.oscillator.effects, fit, log_evidence(fit))


def refit(fit: Fit, scores: Sequence[Score], scales: Scales) -> Candidate:
    """Fit the model of `fit` with the effects of `scores` added."""
    effects = (*fit.target.oscillator.effects, *(s.effect for s in scores))
    shapes = {name: value for s in scores for name, value in s.shapes.items()}
    target = extend(fit, effects, scales)
    start = transfer(fit, target.oscillator.layout, effects, scales, shapes)
    _shift(fit, target.oscillator.layout.names, start, scores)
    sizes = step_sizes(target.oscillator.layout.names, effects, scales, scores)
    found = find_mode(
        target, start, steps=difference_steps(fit, target, sizes), tolerance=0.02, max_iterations=20
    )
    return Candidate(effects, found, log_evidence(found))


def without(candidate: Candidate, effect: Effect, scales: Scales) -> Candidate:
    """The candidate's model without one of its effects, refitted."""
    effects = tuple(e for e in candidate.effects if e.id != effect.id)
    target = extend(candidate.fit, effects, scales)
    layout = target.oscillator.layout
    start = transfer(candidate.fit, layout, effects, scales, {})
    sizes = step_sizes(layout.names, effects, scales, ())
    steps = difference_steps(candidate.fit, target, sizes)
    found = find_mode(target, start, steps=steps, tolerance=0.02, max_iterations=20)
    return Candidate(effects, found, log_evidence(found))


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


def tempered_evidence(candidate: Candidate, spread: float) -> float:
    """Log evidence when only one sample in `spread` tells something new.

    Where a gross misfit stays, residuals repeat themselves over many samples and the ordinary
    evidence counts every repetition. The likelihood to the power 1 / spread counts each once (a
    power posterior, Friel and Pettitt 2008); its curvature is flatter by the same factor.
    """
    fit = candidate.fit
    if spread <= 1.0 or not np.isfinite(candidate.log_evidence):
        return candidate.log_evidence
    prior = float(fit.target.priors.log_density(fit.mode[None])[0])
    lost = (1.0 - 1.0 / spread) * (fit.log_posterior - prior)
    return candidate.log_evidence - lost + 0.5 * fit.mode.size * float(np.log(spread))


def correlation_spread(fit: Fit) -> float:
    """Samples over which a residual repeats itself: 1 + 2 sum of its correlations, at least 1."""
    values = []
    for part in fit.linearisation:
        x = part.residual - part.residual.mean()
        power = np.abs(np.fft.rfft(x, 2 * x.size)) ** 2
        rho = np.fft.irfft(power)[: x.size]
        rho = rho / rho[0]
        below = np.flatnonzero(rho < 0.05)
        last = int(below[0]) if below.size else x.size
        values.append(1.0 + 2.0 * float(np.sum(rho[1:last])))
    return max(1.0, float(np.mean(values)))


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
    slope = -_gradient(fit)[index] * fit.sd[index]  # of the negative log posterior, per sd, >= 0
    return float(np.log(special.erfcx(max(slope, 0.0) / np.sqrt(2)) / 2))


def _gradient(fit: Fit) -> Array:
    sigma = fit.mode[fit.target.likelihood.sigma_columns]
    vector = np.array(fit.target.priors.gradient(fit.mode))
    for lin, s in zip(fit.linearisation, sigma, strict=True):
        vector[lin.columns] += lin.jacobian.T @ lin.residual / s**2
    return vector


def effect_values(candidate: Candidate) -> Mapping[str, float]:
    """Modes of the added effects' parameters."""
    fit = candidate.fit
    return {n: float(v) for n, v in zip(fit.names, fit.mode, strict=True) if is_added(n)}


__all__ = ["Candidate", "base_candidate", "log_evidence", "refit", "replaced_slot", "without"]
