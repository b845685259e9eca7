"""A posterior density, and its mode with the curvature there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from bayesimpact.data.recording import Recording
from bayesimpact.data.short_repr import short_repr
from bayesimpact.inference.likelihood import Likelihood, Linearisation
from bayesimpact.inference.prior import Prior
from bayesimpact.inference.priors import Priors
from bayesimpact.model.oscillator import Oscillator
from bayesimpact.model.parameters import SLOTS

Array = NDArray[np.float64]
_OFFSET = SLOTS.index("offset")
Z90 = 1.6448536269514722  # 95 % quantile of the standard normal distribution
RANK = 1e-14  # of the largest eigenvalue: smaller ones are rounding


@dataclass(frozen=True, eq=False)
class PosteriorDensity:
    """A posterior density: likelihood times priors.

    Attributes
    ----------
    replaced : priors of base parameters in whose place an effect has put others
    """

    likelihood: Likelihood
    priors: Priors
    replaced: Mapping[str, Prior] = field(default_factory=dict)

    __repr__ = short_repr

    @property
    def oscillator(self) -> Oscillator:
        """The model behind the likelihood."""
        return self.likelihood.oscillator

    def __call__(self, theta: Array) -> Array:
        """Log posterior up to the evidence, (B,); -inf where inadmissible."""
        theta = np.atleast_2d(theta)
        value = self.priors.log_density(theta)
        inside = np.isfinite(value)
        if inside.any():
            value[inside] += self.likelihood(theta[inside])
        return np.asarray(value)


@dataclass(frozen=True, eq=False)
class Fit:
    """The mode of one model's posterior.

    Attributes
    ----------
    density : what was maximised
    mode : (d,) parameters in the order of `density.oscillator.layout`
    covariance : (d, d) inverse of the negative log posterior's Gauss-Newton Hessian (Laplace)
    log_posterior : at the mode
    sums : (R,) whitened sums of squares, squared unit of the readings
    converged : the last step was below 1e-3 standard deviations
    iterations : steps taken
    linearisation : of every recording at the mode
    """

    density: PosteriorDensity
    mode: Array
    covariance: Array
    log_posterior: float
    sums: Array
    converged: bool
    iterations: int
    linearisation: tuple[Linearisation, ...]

    def __repr__(self) -> str:
        """One line."""
        return f"<Fit of {self.words}>"

    @property
    def words(self) -> str:
        """Campaign, size and state."""
        state = "converged" if self.converged else "not converged"
        campaign = self.density.oscillator.campaign.name
        return f"{campaign!r}: {self.mode.size} parameters, {state}"

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return self.density.oscillator.layout.names

    @property
    def sd(self) -> Array:
        """Standard deviations in the Laplace approximation, (d,)."""
        return np.sqrt(np.diag(self.covariance))

    def draws(self, rng: np.random.Generator, count: int, wider: float = 1.0) -> Array:
        """Draws of the Laplace approximation, `wider` times its standard deviations, (count, d).

        In units of these: of parameters whose scales are ten decades apart the covariance itself
        has no root that is accurate for all.
        """
        sd = self.sd
        values, axes = np.linalg.eigh(self.covariance / np.outer(sd, sd))
        root = axes * np.sqrt(np.maximum(values, 0.0))
        return np.asarray(self.mode + wider * sd * (rng.standard_normal((count, sd.size)) @ root.T))

    def value(self, name: str) -> float:
        """The mode of one parameter."""
        return float(self.mode[self.density.oscillator.layout.index(name)])

    def with_recordings(self, recordings: Sequence[Recording]) -> Fit:
        """The same point of a posterior of other recordings, of the same names: no mode of it, but
        what problems about the fit are posed on.
        """
        o = self.density.oscillator
        o = replace(o, campaign=replace(o.campaign, recordings=tuple(recordings)))
        likelihood = replace(self.density.likelihood, oscillator=o)
        return replace(self, density=replace(self.density, likelihood=likelihood))

    @property
    def log_likelihood(self) -> float:
        """Of the mode, nats."""
        return self.log_posterior - float(self.density.priors.log_density(self.mode[None])[0])

    @property
    def reduced_chi2(self) -> float:
        """Misfit per degree of freedom against the noise level estimated from recordings alone."""
        likelihood = self.density.likelihood
        freedom = float(likelihood.sizes.sum()) - (self.mode.size - 1)
        return float(self.sums.sum() / likelihood.noise.level**2 / freedom)

    @cached_property
    def seen(self) -> tuple[Array, ...]:
        """What the probe would have seen, per recording (n,), in the recording's SI unit."""
        return self.density.oscillator.predict(self.mode)

    @cached_property
    def predicted(self) -> tuple[Array, ...]:
        """The same as it would have been read on average, where readings come in steps."""
        average = self.density.likelihood.average
        return tuple(average(r, seen) for r, seen in enumerate(self.seen))

    @cached_property
    def readings(self) -> tuple[Array, ...]:
        """What was seen, counted from the reading at rest."""
        offsets = self.density.oscillator.layout.slots(self.mode)[:, _OFFSET]
        return tuple(p - b for p, b in zip(self.seen, offsets, strict=True))

    @cached_property
    def displacements(self) -> tuple[Array, ...]:
        """Where the mass was by the model, per recording (n,), m, from its true rest.

        For displacements as the probe saw it, sensor effects and filter included.
        """
        o = self.density.oscillator
        return self.readings if o.reads_displacements else o.displacements(self.mode)

    @cached_property
    def residuals(self) -> tuple[Array, ...]:
        """Recorded minus predicted, per recording (n,), in the recording's SI unit.

        0 where a sample is set aside.
        """
        recordings = self.density.oscillator.campaign.recordings
        pairs = zip(recordings, self.predicted, strict=True)
        return tuple(
            r.samples - p if r.used is None else np.where(r.used, r.samples - p, 0.0)
            for r, p in pairs
        )

    @property
    def rms(self) -> float:
        """Root mean square residual over all samples that count, in the first recording's unit.

        Residuals of other quantities count by their noise, as in the likelihood.
        """
        count = sum(r.count for r in self.density.oscillator.campaign.recordings)
        pairs = zip(self.residuals, self.density.likelihood.scales, strict=True)
        return float(np.sqrt(sum(float(np.sum((r / s) ** 2)) for r, s in pairs) / count))

    @property
    def signal(self) -> float:
        """The same of the readings about their means."""
        recordings = self.density.oscillator.campaign.recordings
        pairs = zip(recordings, self.density.likelihood.scales, strict=True)
        centred = np.concatenate([(r.samples - r.samples.mean()) / s for r, s in pairs])
        return float(np.sqrt(np.mean(centred**2)))


def grams(linearisation: Sequence[Linearisation]) -> tuple[Array, ...]:
    """J'J (k, k) of every recording; not finite where a motion runs away."""
    with np.errstate(over="ignore", invalid="ignore"):
        return tuple(part.jacobian.T @ part.jacobian for part in linearisation)


def likelihood_information(
    linearisation: Sequence[Linearisation], products: Sequence[Array], sigma: Array, size: int
) -> Array:
    """J'J / sigma^2 (size, size), summed; `products` of `grams`, noise levels `sigma` (R,)."""
    matrix = np.zeros((size, size))
    for part, product, level in zip(linearisation, products, sigma, strict=True):
        matrix[np.ix_(part.columns, part.columns)] += product / level**2
    return matrix


def likelihood_gradient(linearisation: Sequence[Linearisation], sigma: Array, size: int) -> Array:
    """J'r / sigma^2 (size,), summed; noise levels `sigma` (R,)."""
    vector = np.zeros(size)
    for part, level in zip(linearisation, sigma, strict=True):
        vector[part.columns] += part.jacobian.T @ part.residual / level**2
    return vector


def inverse(matrix: Array) -> Array:
    """Inverse of a symmetric positive (semi)definite matrix, after scaling to unit diagonal.

    NaN throughout where the matrix is not finite; inf where an inverse exceeds what a number holds.
    """
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        unit = matrix / np.outer(scale, scale)
        if not np.isfinite(unit).all():
            return np.full(matrix.shape, np.nan)
        return np.asarray(_pseudo_inverse(unit) / np.outer(scale, scale))


def _pseudo_inverse(unit: Array) -> Array:
    """Of a symmetric matrix with a diagonal of one.

    LAPACK's divide and conquer, which NumPy calls, did not converge on a well-conditioned
    matrix of 32 rows (OpenBLAS on one processor); QR iteration, which is slower, does not.
    """
    try:
        return np.asarray(np.linalg.pinv(unit, rcond=RANK, hermitian=True))
    except np.linalg.LinAlgError:
        values, vectors = eigh(unit, driver="ev")
        kept = np.abs(values) > RANK * np.abs(values).max()
        return np.asarray((vectors[:, kept] / values[kept]) @ vectors[:, kept].T)
