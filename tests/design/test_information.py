"""The covariance after one more recording, against a regression on all data at once."""

from __future__ import annotations

import numpy as np
import pytest

from bayesimpact.design.information import updated_covariance


def test_it_is_that_of_a_regression_on_everything() -> None:
    rng = np.random.default_rng(1)
    scale = np.array([1e3, 1e-3, 1.0, 1e-6])  # as parameters of an impact oscillator differ
    old = rng.standard_normal((50, 4)) / scale
    shared = np.array([0, 2, 3])
    new, own = rng.standard_normal((40, 3)) / scale[shared], 30 * rng.standard_normal((40, 2))
    covariance = np.linalg.inv(scale[:, None] * (old.T @ old) * scale) * np.outer(scale, scale)
    after = updated_covariance(covariance, new, shared, own)
    design = np.zeros((92, 6))  # old data, new data, priors of its own parameters
    design[:50, :4], design[50:90, shared], design[50:90, 4:] = old, new, own
    design[90:, 4:] = np.eye(2)
    unit = np.concatenate([scale, np.ones(2)])
    whole = np.linalg.inv((design * unit).T @ (design * unit)) * np.outer(unit, unit)
    assert after / np.outer(scale, scale) == pytest.approx(
        whole[:4, :4] / np.outer(scale, scale), rel=1e-8, abs=1e-12
    )


def test_a_recording_of_start_values_alone_tells_nothing() -> None:
    rng = np.random.default_rng(2)
    own = 1e5 * rng.standard_normal((30, 2))
    before = np.diag([4.0, 9.0])
    jacobian = own @ rng.standard_normal((2, 2)) * 1e-5
    after = updated_covariance(before, jacobian, np.array([0, 1]), own)
    assert after == pytest.approx(before, rel=1e-6, abs=1e-6)
