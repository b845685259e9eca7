"""Intervals of a model's parameters, with what stays unexplained carried into them.

Where a model leaves nothing, its posterior is near normal about the mode. Where something remains,
a force of time is part of what the recordings are (`discrepancy`): it scatters the mode as noise
does, and the part of it that a parameter can imitate, which no remainder shows, is as large as
the part that remains (`hidden`). Models that do not stand out from this one make other values of
a parameter; their scatter is added (`comparable`). Medians stay at the mode, whose motion the
figures show, also where such a width reaches beyond a bound: it is no posterior's, and a normal cut
there would tell a median that no model has.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from bayesimpact.data.short_repr import short_repr
from bayesimpact.diagnosis.measurement.repetition import residual_repetition
from bayesimpact.diagnosis.residual_force.discrepancy import Discrepancy, discrepancy
from bayesimpact.diagnosis.selection.comparable import Comparable
from bayesimpact.inference.fit import Fit

Array = NDArray[np.float64]

NINETY = 1.645  # standard deviations to either end of a 90 % interval


@dataclass(frozen=True, eq=False)
class Intervals:
    """A normal posterior of a model's parameters, cut at their physical bounds.

    Attributes
    ----------
    names : of the parameters
    mean, covariance : (d,) and (d, d), before the cut
    lower, upper : physical bounds (d,)
    at_mode : the median is the mean, and both ends of an interval stop at the bounds
    """

    names: tuple[str, ...]
    mean: Array
    covariance: Array
    lower: Array
    upper: Array
    at_mode: bool = False

    __repr__ = short_repr

    def quantiles(self, name: str) -> tuple[float, float, float]:
        """Quantiles 0.05, 0.5 and 0.95 of one parameter; KeyError for an unknown name."""
        if name not in self.names:
            raise KeyError(name)
        i = self.names.index(name)
        middle, sd = float(self.mean[i]), float(np.sqrt(self.covariance[i, i]))
        low, high = float(self.lower[i]), float(self.upper[i])
        clipped = min(max(middle, low), high)
        if not sd > 0.0:
            return clipped, clipped, clipped
        if self.at_mode:
            return max(clipped - NINETY * sd, low), clipped, min(clipped + NINETY * sd, high)
        within = stats.truncnorm((low - middle) / sd, (high - middle) / sd, middle, sd)
        found = [float(within.ppf(q)) for q in (0.05, 0.5, 0.95)]
        if not np.all(np.isfinite(found)):  # all of the mass lies far beyond a bound
            found = [max(clipped - NINETY * sd, low), clipped, min(clipped + NINETY * sd, high)]
        return found[0], found[1], found[2]


def intervals(
    fit: Fit,
    *,
    remains: bool = False,
    known: Discrepancy | None = None,
    beside: Comparable | None = None,
) -> Intervals:
    """Intervals of a fit; `remains`: something beside the noise is left, of which a force of time
    may be `known`, perhaps of another fit; `beside`: models that do not stand out from it.
    """
    mean, covariance = fit.mode, fit.covariance
    if remains:
        left = known if known is not None and known.fit is fit else discrepancy(fit)
        if left is None:
            covariance = covariance * residual_repetition(fit)
        else:
            mean, covariance = left.posterior
    if beside is not None:
        covariance = covariance + beside.between(fit)
    bounds = np.array([(p.lower, p.upper) for p in fit.density.oscillator.layout.parameters])
    return Intervals(fit.names, mean, covariance, bounds[:, 0], bounds[:, 1], remains)
