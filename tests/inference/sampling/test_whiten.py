"""The BLAS-free algebra agrees with LAPACK and refuses what cannot be factored."""

from __future__ import annotations

import numpy as np
import pytest

from bayesimpact.errors import InputError
from bayesimpact.inference.sampling.whiten import cholesky, invert_lower, squared_norm, transform


def covariance(dimension):
    rng = np.random.default_rng(dimension)
    root = (
        rng.standard_normal((dimension, 2 * dimension))
        * np.geomspace(1e-6, 1e3, dimension)[:, None]
    )
    return root @ root.T


@pytest.mark.parametrize("dimension", [1, 2, 35])
def test_factor_and_inverse(dimension):
    matrix = covariance(dimension)
    factor = cholesky(matrix)
    np.testing.assert_allclose(factor, np.linalg.cholesky(matrix), rtol=1e-9, atol=0.0)
    product = invert_lower(factor) @ factor
    np.testing.assert_allclose(product, np.eye(dimension), atol=1e-9)


def test_transform_and_norm():
    rng = np.random.default_rng(0)
    points, matrix = rng.standard_normal((6, 4)), rng.standard_normal((4, 4))
    np.testing.assert_allclose(transform(points, matrix), points @ matrix.T, rtol=1e-13)
    np.testing.assert_allclose(squared_norm(points), np.square(points).sum(axis=1), rtol=1e-13)


@pytest.mark.parametrize(
    ("matrix", "words"),
    [
        (np.ones((2, 3)), "shape"),
        (np.ones((2, 2)), "singular"),
        (np.array([[1.0, 2.0], [2.0, 1.0]]), "singular"),
        (np.array([[1.0, np.nan], [np.nan, 1.0]]), "not finite"),
        (np.diag([1.0, -1.0]), "not > 0"),
    ],
)
def test_refusals(matrix, words):
    with pytest.raises(InputError, match=words):
        cholesky(matrix)
