"""A mixture of Gaussians and Student-t distributions around common centres: the proposal density.

Every component is elliptical and lives in one of a few frames (centre, factor of the scatter
matrix); components of one frame differ in scale and in degrees of freedom only, so that all their
densities follow from one squared distance. A Gaussian component gives an acceptance near one where
the posterior is Gaussian; the Student-t component keeps posterior/proposal bounded in the tails
(defensive mixture: Hesterberg 1995, Technometrics 37:185; Owen & Zhou 2000, JASA 95:135).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import lgamma, log, pi

import numpy as np
from numpy.typing import NDArray

from bayesimpact.inference.sampling.whiten import invert_lower, squared_norm, transform

Array = NDArray[np.float64]

# (scale, degrees of freedom) of the components of every frame. Chosen by measurement on Gaussian
# and skewed targets of 7 and 35 dimensions; which of them is used is fitted to the burn-in.
SHAPES = ((1.0, np.inf), (1.1, np.inf), (1.0, 30.0), (1.0, 5.0))
FIRST_WEIGHTS = (0.5, 0.2, 0.1, 0.2)


@dataclass(frozen=True, eq=False)
class Frame:
    """Centre and scatter of a family of elliptical distributions.

    Attributes
    ----------
    centre : (d,)
    factor : (d, d) lower triangular; factor @ factor.T is the covariance of the Gaussian of scale 1
    inverse : (d, d), of the factor
    log_det : log determinant of the factor
    """

    centre: Array
    factor: Array
    inverse: Array = field(init=False)
    log_det: float = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "inverse", invert_lower(self.factor))
        object.__setattr__(self, "log_det", float(np.log(np.diag(self.factor)).sum()))

    def distance2(self, points: Array) -> Array:
        """Squared distance from the centre in units of the scatter, (n, d) -> (n,)."""
        return squared_norm(transform(points - self.centre, self.inverse))


def log_student(distance2: Array, dimension: int, scale: float, dof: float) -> Array:
    """Log density of a multivariate Student-t (or Gaussian, dof = inf) at squared distances.

    Kotz & Nadarajah 2004, Multivariate t Distributions, Eq. 1.1; the scatter's determinant is
    left to the caller.
    """
    r2 = distance2 / scale**2
    constant = -dimension * log(scale)
    if np.isinf(dof):
        return constant - 0.5 * dimension * log(2.0 * pi) - 0.5 * r2
    constant += lgamma(0.5 * (dof + dimension)) - lgamma(0.5 * dof)
    constant -= 0.5 * dimension * log(dof * pi)
    return np.asarray(constant - 0.5 * (dof + dimension) * np.log1p(r2 / dof))


@dataclass(frozen=True, eq=False)
class Mixture:
    """Weighted elliptical components.

    Attributes
    ----------
    frames : F frames
    weights : (F, K) of every frame's K shapes, >= 0, sum 1
    shapes : K pairs (scale, degrees of freedom)
    """

    frames: tuple[Frame, ...]
    weights: Array
    shapes: tuple[tuple[float, float], ...] = SHAPES

    def log_components(self, points: Array) -> Array:
        """Log density of every component, (n, d) -> (n, F K)."""
        columns = []
        for frame in self.frames:
            distance2 = frame.distance2(points)
            columns += [
                log_student(distance2, points.shape[1], scale, dof) - frame.log_det
                for scale, dof in self.shapes
            ]
        return np.stack(columns, axis=1)

    def log_density(self, points: Array) -> Array:
        """Exact, normalised log density, (n, d) -> (n,)."""
        used = self.weights.ravel() > 0.0
        terms = self.log_components(points)[:, used] + np.log(self.weights.ravel()[used])
        top = terms.max(axis=1)
        return np.asarray(top + np.log(np.exp(terms - top[:, None]).sum(axis=1)))

    def draw(self, random: np.random.RandomState, size: int) -> Array:
        """Independent draws, (size, d)."""
        dimension = len(self.frames[0].centre)
        chosen = random.choice(self.weights.size, size=size, p=self.weights.ravel())
        points = random.standard_normal((size, dimension))
        for k, (scale, dof) in enumerate(self.shapes):
            mine = chosen % len(self.shapes) == k
            stretch = np.full(int(mine.sum()), scale)
            if np.isfinite(dof):
                stretch *= np.sqrt(dof / random.chisquare(dof, size=stretch.size))
            points[mine] *= stretch[:, None]
        for f, frame in enumerate(self.frames):
            mine = chosen // len(self.shapes) == f
            points[mine] = frame.centre + transform(points[mine], frame.factor)
        return points

    def reweighted(self, points: Array, *, iterations: int = 30, heavy: float = 0.1) -> Mixture:
        """The same components with the weights most likely for the points (EM).

        Maximises the mean log density at the points, which minimises the Kullback-Leibler
        divergence from the distribution they come from.

        Parameters
        ----------
        points : (n, d)
        iterations : EM steps
        heavy : least weight kept for the heaviest tails; spread over the frames
        """
        logs = self.log_components(points)
        densities = np.exp(logs - logs.max(axis=1)[:, None])
        weights = np.full(self.weights.size, 1.0 / self.weights.size)
        for _ in range(iterations):
            shares = densities * weights
            weights = (shares / shares.sum(axis=1)[:, None]).mean(axis=0)
        floor = np.zeros_like(self.weights)
        floor[:, int(np.argmin([dof for _, dof in self.shapes]))] = heavy / len(self.frames)
        return replace(self, weights=(1.0 - heavy) * weights.reshape(floor.shape) + floor)
