"""Small dense algebra whose last bit does not depend on the number of threads.

A threaded BLAS may sum in another order when it is given another number of threads. A resumed
chain has to equal the uninterrupted one bit for bit on any machine setting, so whatever a chain
depends on goes through `numpy.einsum` loops (never BLAS). Sizes here are tens, not thousands.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesimpact.errors import InputError

Array = NDArray[np.float64]


def cholesky(covariance: Array) -> Array:
    """Lower factor L of a covariance matrix, L L^T = covariance.

    Parameters
    ----------
    covariance : (d, d) symmetric, any units; scaled to a correlation matrix first, because the
        parameters of an impact oscillator differ by 1e9 in size

    Returns
    -------
    (d, d) lower triangular

    Raises
    ------
    InputError : the matrix is not square, not finite, or not positive definite
    """
    covariance = np.asarray(covariance, dtype=np.float64)
    if covariance.ndim != 2 or covariance.shape[0] != covariance.shape[1]:
        raise InputError("covariance", f"shape {covariance.shape}", "a square matrix")
    variances = np.diag(covariance)
    if not (np.isfinite(covariance).all() and (variances > 0.0).all()):
        raise InputError(
            "covariance",
            "values that are not finite or variances that are not > 0",
            "a finite covariance matrix with positive variances",
        )
    scale = np.sqrt(variances)
    correlation = covariance / scale[:, None] / scale
    factor = np.zeros_like(correlation)
    for j in range(len(scale)):
        row = factor[j, :j]
        pivot = correlation[j, j] - np.einsum("i,i->", row, row)
        if not pivot > len(scale) * np.finfo(np.float64).eps:
            raise InputError(
                "covariance",
                f"a singular matrix (pivot {j + 1}: {pivot:.3g})",
                "a positive definite matrix",
            )
        factor[j, j] = np.sqrt(pivot)
        below = correlation[j + 1 :, j] - np.einsum("ki,i->k", factor[j + 1 :, :j], row)
        factor[j + 1 :, j] = below / factor[j, j]
    return scale[:, None] * factor


def invert_lower(factor: Array) -> Array:
    """Inverse of a lower triangular matrix, (d, d), by forward substitution."""
    inverse = np.zeros_like(factor)
    for j in range(len(factor)):
        inverse[j, :j] = -np.einsum("i,ik->k", factor[j, :j], inverse[:j, :j]) / factor[j, j]
        inverse[j, j] = 1.0 / factor[j, j]
    return inverse


def transform(points: Array, matrix: Array) -> Array:
    """Matrix times every row of points: (n, d), (e, d) -> (n, e)."""
    return np.asarray(np.einsum("ni,ji->nj", points, matrix), dtype=np.float64)


def squared_norm(points: Array) -> Array:
    """Sum of squares of every row, (n, d) -> (n,)."""
    return np.asarray(np.einsum("ni,ni->n", points, points), dtype=np.float64)
