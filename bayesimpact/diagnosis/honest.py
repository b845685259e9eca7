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

from bayesimpact.diagnosis.name import State

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
    """Parameters of a model's fit, with the force that it leaves unexplained carried into them."""
    fit, force = state.candidate.fit, state.force
    absorbed = force.projection.absorbed
    mean = fit.mode - absorbed @ force.mean
    covariance = fit.covariance + absorbed @ force.covariance @ absorbed.T
    return Widened(fit.names, mean, covariance)
