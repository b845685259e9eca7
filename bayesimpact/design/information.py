"""What a recording would tell of the parameters of a model: posterior information and its own.

Start values and rest reading of the new recording are eliminated; the rest adds to the information
of the recordings so far (Lindley 1956; Chaloner and Verdinelli 1995, Eq. 9, for Laplace's
approximation).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def updated_covariance(
    covariance: Array, jacobian: Array, shared: NDArray[np.int64], own: Array
) -> Array:
    """Covariance (d, d) of a model's parameters once a recording has been added.

    Parameters
    ----------
    covariance : (d, d) before
    jacobian : (n, s) derivatives of the recording with respect to the parameters `shared` (s,),
        whitened and in units of the noise
    own : (n, k) the same with respect to parameters of this recording alone, times the standard
        deviations of their priors
    """
    inner = np.eye(own.shape[1]) + own.T @ own
    cross = own.T @ jacobian
    information = jacobian.T @ jacobian - cross.T @ np.linalg.solve(inner, cross)
    scale = np.sqrt(np.diag(covariance))
    safe = np.where(scale > 0, scale, 1.0)
    unit = covariance / np.outer(safe, safe)
    part = information * np.outer(safe[shared], safe[shared])
    rows = unit[:, shared]
    gain = np.linalg.solve(np.eye(shared.size) + part @ unit[np.ix_(shared, shared)], part)
    after = unit - rows @ gain @ rows.T
    return np.asarray(0.5 * (after + after.T) * np.outer(scale, scale))
