"""The ln odds that a recording is expected to give one model over another.

Each model predicts the recording as a Gaussian: y = m + A u + e, with u and the noise e standard
normal, A the sensitivities times what the model's parameters are uncertain by (base parameters,
sizes of effects, start values of the new recording), all whitened and in units of the noise. If
model i is right, B the columns of A that the campaign shares, and the recording starts as intended,
the expected ln odds that it gives i over j are

    [ d' W_j d + tr(W_j S) - tr(W_i S) + ln det S_j - ln det S_i ] / 2,

S_i = I + A A', W_i = S_i^-1, S = I + B B', d = m_i - m_j: Box and Hill (1967, Technometrics 9:57)
for one observation of n dimensions. d' W_j d is the criterion T of Atkinson and Fedorov (1975,
Biometrika 62:57): the sum of squares that is left of the difference when the parameters of j have
imitated as much of it as they may.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PredictedRecording:
    """What a model predicts of one recording, whitened and in units of the noise.

    Attributes
    ----------
    mean : (n,)
    factor : (n, k) A, derivatives with respect to parameters scaled to unit variance
    shared : how many of its columns, the first ones, belong to the whole campaign
    """

    mean: Array
    factor: Array
    shared: int

    @property
    def common(self) -> Array:
        """B, (n, shared)."""
        return self.factor[:, : self.shared]

    @cached_property
    def root(self) -> Array:
        """Lower factor of I + A'A, (k, k)."""
        k = self.factor.shape[1]
        return np.asarray(np.linalg.cholesky(np.eye(k) + self.factor.T @ self.factor))

    @property
    def log_det(self) -> float:
        """ln det S."""
        return 2.0 * float(np.sum(np.log(np.diag(self.root))))

    @cached_property
    def taken(self) -> Array:
        """P (n, k) with W = I - P P': what the parameters take of the readings."""
        return np.asarray(solve_triangular(self.root, self.factor.T, lower=True).T)

    @property
    def freedom(self) -> float:
        """n - tr W."""
        return float(np.sum(self.taken**2))

    def weighed(self, x: Array) -> Array:
        """W x for x (n,) or (n, m)."""
        return np.asarray(x - self.taken @ (self.taken.T @ x))


@dataclass(frozen=True, eq=False)
class Odds:
    """ln odds for a model that is right, over a rival, nats.

    Attributes
    ----------
    mean : expected
    means, sds : (S,) mean and standard deviation over the noise, for draws of the right model's
        parameters
    """

    mean: float
    means: Array
    sds: Array


def expected_odds(
    right: PredictedRecording,
    other: PredictedRecording,
    draws: Array,
    left: Array | None = None,
    distance: float | None = None,
) -> Odds:
    """ln odds that a recording is expected to give the right model over another.

    Parameters
    ----------
    draws : (S, shared) standard normal numbers
    left : (n,) what is left of the difference when the other model's parameters have imitated as
        much as they may, and
    distance : the sum of squares T, the cost of their shift included; both where they are known
        better than from the linear problem
    """
    if left is None or distance is None:
        difference = right.mean - other.mean
        left = other.weighed(difference)
        distance = float(difference @ left)
    common, remaining = right.common, other.weighed(right.common)
    gained = common.T @ (remaining - right.weighed(common))  # per parameter squared
    fixed = distance + right.freedom - other.freedom + other.log_det - right.log_det
    quadratic = np.einsum("si,ij,sj->s", draws, gained, draws)
    means = 0.5 * (fixed + quadratic) + draws @ (common.T @ left)
    across, square = remaining.T @ left, remaining.T @ remaining
    variances = left @ left + 2 * draws @ across + np.einsum("si,ij,sj->s", draws, square, draws)
    variances += 0.5 * noise_alone(right, other)
    mean = 0.5 * (fixed + float(np.trace(gained)))
    return Odds(mean, means, np.sqrt(np.maximum(variances, 0.0)))


def noise_alone(right: PredictedRecording, other: PredictedRecording) -> float:
    """tr (W_i - W_j)^2: what noise contributes where both models predict the same."""
    own, others = (x.taken.T @ x.taken for x in (right, other))
    both = right.taken.T @ other.taken
    return max(float(np.sum(own**2) + np.sum(others**2) - 2 * np.sum(both**2)), 0.0)
