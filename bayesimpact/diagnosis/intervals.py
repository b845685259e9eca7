"""Intervals of the parameters, with what stays unexplained carried into them.

Where a model leaves nothing, its posterior is near normal about the mode. Where something remains,
a discrepancy is part of every hypothesis: a residual force with a posterior of its own (`force`),
and noise of whatever colour the residual has. Had the force been modelled, the parameters would
have moved by what they now absorb of it: a shift and an extra covariance, both closed forms in the
linearised problem. Where the misfit is large, that problem gives the size of the shift but not its
direction, and the shift is counted as uncertainty.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from bayesimpact.diagnosis.directions import sigma_of
from bayesimpact.diagnosis.naming import State, is_large
from bayesimpact.inference.fit import Fit

LAGS_PER_ROOT = 3.0  # lags of the long-run covariance, times the root of the number of samples

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Intervals:
    """A normal posterior of a model's parameters, cut at their physical bounds.

    Attributes
    ----------
    names : of the parameters
    mean, covariance : (d,) and (d, d), before the cut
    lower, upper : physical bounds (d,)
    """

    names: tuple[str, ...]
    mean: Array
    covariance: Array
    lower: Array
    upper: Array

    def quantiles(self, name: str) -> tuple[float, float, float]:
        """Quantiles 0.05, 0.5 and 0.95 of one parameter; KeyError for an unknown name."""
        if name not in self.names:
            raise KeyError(name)
        i = self.names.index(name)
        middle, sd = float(self.mean[i]), float(np.sqrt(self.covariance[i, i]))
        low, high = float(self.lower[i]), float(self.upper[i])
        if not sd > 0.0:
            held = min(max(middle, low), high)
            return held, held, held
        within = stats.truncnorm((low - middle) / sd, (high - middle) / sd, middle, sd)
        found = [float(within.ppf(q)) for q in (0.05, 0.5, 0.95)]
        if not np.all(np.isfinite(found)):  # all of the mass lies far beyond a bound
            held = min(max(middle, low), high)
            found = [max(held - 1.645 * sd, low), held, min(held + 1.645 * sd, high)]
        return found[0], found[1], found[2]


def intervals(fit: Fit, state: State | None = None) -> Intervals:
    """Intervals of a fit; `state` is the model whose remainder was examined, where one remains.

    A fit that has the residual force among its effects carries it along already.
    """
    if state is None:
        return _cut(fit, fit.mode, fit.covariance)
    if fit is not state.candidate.fit:
        return _cut(fit, fit.mode, sandwich(fit))
    force = state.unknown
    absorbed, spread = force.projection.absorbed, force.covariance
    mean = fit.mode
    if is_large(fit):
        spread = spread + np.outer(force.mean, force.mean)
    else:
        mean = mean - absorbed @ force.mean
    return _cut(fit, mean, sandwich(fit) + absorbed @ spread @ absorbed.T)


def _cut(fit: Fit, mean: Array, covariance: Array) -> Intervals:
    bounds = np.array([(p.lower, p.upper) for p in fit.target.oscillator.layout.parameters])
    return Intervals(fit.names, mean, covariance, bounds[:, 0], bounds[:, 1])


def sandwich(fit: Fit) -> Array:
    """Covariance (d, d) of the mode under residuals of any colour, Bartlett weights over one
    period (Huber 1967; Newey and West 1987).
    """
    middle = np.zeros((fit.mode.size, fit.mode.size))
    sigma = sigma_of(fit)
    for part, level in zip(fit.linearisation, sigma, strict=True):
        scores = part.jacobian * part.residual[:, None] / level**2
        where = np.ix_(part.columns, part.columns)
        middle[where] += scores.T @ scores
        lags = int(LAGS_PER_ROOT * np.sqrt(scores.shape[0]))
        for lag in range(1, min(lags, scores.shape[0] - 1)):
            cross = scores[:-lag].T @ scores[lag:]
            middle[where] += (1 - lag / lags) * (cross + cross.T)
    found = fit.covariance @ middle @ fit.covariance
    wider = np.sqrt(np.maximum(np.diag(found) / np.diag(fit.covariance), 1.0))
    return np.asarray(fit.covariance * np.outer(wider, wider))
