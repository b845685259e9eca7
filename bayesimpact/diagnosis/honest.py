"""Intervals that hold even when something stays unexplained.

What the fitted model leaves unexplained is a force with a posterior of its own (`force`). Had it
been modelled, the parameters would have moved by what they now absorb of it: a shift and an extra
covariance, both closed forms in the linearised problem. Where no force is left both vanish and the
intervals are the ordinary ones.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesimpact.diagnosis.directions import sigma_of
from bayesimpact.diagnosis.naming import State, is_gross
from bayesimpact.inference.fit import Fit

LAGS_PER_ROOT = 3.0  # lags of the long-run covariance, times the root of the number of samples

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Widened:
    """Parameters with the unexplained force carried along.

    Attributes
    ----------
    names : of the fit's parameters
    mean, covariance : (d,) and (d, d)
    """

    names: tuple[str, ...]
    mean: Array
    covariance: Array

    def interval(self, name: str) -> tuple[float, float]:
        """Central 90 % interval."""
        i = self.names.index(name)
        half = 1.6448536269514722 * float(np.sqrt(self.covariance[i, i]))
        return float(self.mean[i]) - half, float(self.mean[i]) + half


def widened(state: State) -> Widened:
    """Parameters of a model's fit, with what it leaves unexplained carried into them."""
    fit, force = state.candidate.fit, state.unknown
    if is_gross(fit):  # too far for the linearised problem: only the spread is believed
        return Widened(fit.names, fit.mode, sandwich(fit))
    absorbed = force.projection.absorbed
    mean = fit.mode - absorbed @ force.mean
    statistical = fit.covariance if state.is_white else sandwich(fit)
    covariance = statistical + absorbed @ force.covariance @ absorbed.T
    return Widened(fit.names, mean, covariance)


def sandwich(fit: Fit) -> Array:
    """Covariance (d, d) of the mode under residuals of any colour, Bartlett weights over one
    period.
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
