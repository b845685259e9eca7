"""Nonlinear least squares in the few unknowns of the initial estimates."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import least_squares

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Minimum:
    """Where a sum of squares is least.

    Attributes
    ----------
    x : (p,) the point
    residuals : (n,) there
    jacobian : (n, p) of the residuals, with the weights of the robust loss
    cost : half the sum of (robust) squares
    """

    x: Floats
    residuals: Floats
    jacobian: Floats
    cost: float

    def standard_errors(self, variance: float, floor: float = 0.0) -> Floats:
        """Standard errors (p,) for residuals of this variance, `floor` added to the information.

        With a floor, a direction that the data do not fix has a large but finite error.
        """
        information = self.jacobian.T @ self.jacobian / variance + floor * np.eye(self.x.size)
        return np.asarray(np.sqrt(np.maximum(np.diag(np.linalg.pinv(information)), 0.0)))


def least(
    residuals: Callable[[Floats], Floats],
    starts: Sequence[ArrayLike],
    *,
    scale: ArrayLike,
    bounds: tuple[ArrayLike, ArrayLike] = (-np.inf, np.inf),
    robust: float | None = None,
    favour: float = 1.0,
    evaluations: int = 40,
    tolerance: float = 1e-8,
) -> Minimum:
    """The lowest minimum found from several starting points (trust region, SciPy).

    Parameters
    ----------
    residuals : function of the point, in a unit in which 1 is a fair size
    starts : points to start from
    scale : typical change of each coordinate
    bounds : lower and upper
    robust : residuals beyond this count linearly instead of by their square
    favour : a later start wins when its cost is below this fraction of the best so far
    evaluations : at most, per start
    tolerance : stop when a step changes cost or point by less than this, relative
    """
    low, high = (np.asarray(b, dtype=np.float64) for b in bounds)
    best: Minimum | None = None
    for start in starts:
        point = np.asarray(start, dtype=np.float64)
        if np.isfinite(low).all() and np.isfinite(high).all():
            margin = 1e-6 * (high - low)
            point = np.clip(point, low + margin, high - margin)
        found = least_squares(
            residuals,
            point,
            bounds=(low, high),
            x_scale=np.asarray(scale, dtype=np.float64),
            loss="linear" if robust is None else "soft_l1",
            f_scale=robust or 1.0,
            ftol=tolerance,
            xtol=tolerance,
            gtol=1e-12,
            max_nfev=evaluations,
        )
        if best is None or found.cost < favour * best.cost:
            best = Minimum(
                np.asarray(found.x),
                np.asarray(found.fun),
                np.asarray(found.jac, dtype=np.float64),
                float(found.cost),
            )
    assert best is not None
    return best
