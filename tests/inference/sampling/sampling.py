"""What the tests of the sampler share: posteriors, interruptions, one run."""

from __future__ import annotations

import numpy as np

from bayesimpact.inference.sampling.sample import sample_posterior

SIZES = np.geomspace(1e-6, 1e3, 6)  # as unlike as g in m and k1 in N/m


def correlated(dimension=6):
    rng = np.random.default_rng(1)
    basis = np.linalg.qr(rng.standard_normal((dimension, dimension)))[0]
    sizes = np.geomspace(SIZES[0], SIZES[-1], dimension)
    covariance = (basis * np.geomspace(1.0, 100.0, dimension)) @ basis.T
    covariance *= sizes * sizes[:, None]
    mode = 1e3 * sizes
    inverse = np.linalg.inv(np.linalg.cholesky(covariance))

    def log_posterior(theta):
        return -0.5 * np.square((theta - mode) @ inverse.T).sum(axis=1)

    return log_posterior, mode, covariance


class Interrupted:
    """A log posterior that is interrupted at one of its calls; every row on its own."""

    def __init__(self, call=None, act=None):
        self.calls = 0
        self.call = call
        self.act = act

    def __call__(self, theta):
        self.calls += 1
        if self.calls == self.call:
            self.act()
        x = theta - 1.0
        return -0.5 * np.square(x).sum(axis=1) - 0.02 * x[:, 0] ** 4


def interrupt():
    raise KeyboardInterrupt


def small(function, **options):
    """A short run of three parameters: 20 steps of burn-in, up to 120 kept ones."""
    defaults = {"seed": 5, "walkers": 10, "block": 20, "max_steps": 120, "target_ess": 1e9}
    return sample_posterior(function, np.ones(3), np.eye(3), **(defaults | options))


def assert_same(first, second):
    assert first.draws.tobytes() == second.draws.tobytes()
    assert first.log_posterior.tobytes() == second.log_posterior.tobytes()
    assert first.convergence.reasons == second.convergence.reasons
    np.testing.assert_array_equal(first.acceptance, second.acceptance)
    for name, shares in first.move_acceptance.items():
        np.testing.assert_array_equal(shares, second.move_acceptance[name])
