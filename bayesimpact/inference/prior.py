"""Prior densities of the parameters: seven kinds, closed forms, one frozen record per parameter.

Every record knows its log density with two derivatives (for the Laplace approximation), its
quantile function and its support, all vectorised over x and in the parameter's SI unit. The forms
are the usual ones (Johnson, Kotz & Balakrishnan 1994, Continuous Univariate Distributions, 1).

Outside its support a density is zero: the log density is -inf there, also for NaN, and the
derivatives are NaN, for they do not exist.
"""

from __future__ import annotations

import math
import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import ClassVar, Self

import numpy as np
import numpy.typing as npt
from scipy.special import erfinv, ndtri

from bayesimpact.errors import InputError

Array = npt.NDArray[np.float64]

_LOG_SQRT_2PI = 0.5 * math.log(2 * math.pi)
_LARGEST = sys.float_info.max


def require(condition: bool, where: str, found: str, accepted: str) -> None:
    """Raise InputError unless `condition`."""
    if not condition:
        raise InputError(where, found, accepted)


@dataclass(frozen=True)
class Prior(ABC):
    """The prior density of one parameter; the kinds below say which."""

    kind: ClassVar[str]
    _open_at_zero: ClassVar[bool] = False

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            usable = isinstance(value, int | float | np.floating | np.integer)
            usable = usable and not isinstance(value, bool) and abs(value) <= _LARGEST
            require(usable, f"{self.kind} prior, {field.name}", repr(value), "a finite number")
            object.__setattr__(self, field.name, float(value))  # integers of TOML included
        self._check()

    def log_density(self, x: npt.ArrayLike) -> Array:
        """Log of the normalised density at x, elementwise; -inf outside the support and at NaN."""
        return self._inside(x, self._log_density, -np.inf)

    def gradient(self, x: npt.ArrayLike) -> Array:
        """First derivative of the log density at x, elementwise; NaN outside the support."""
        return self._inside(x, self._gradient, np.nan)

    def curvature(self, x: npt.ArrayLike) -> Array:
        """Second derivative of the log density at x, elementwise; NaN outside the support."""
        return self._inside(x, self._curvature, np.nan)

    def information(self, x: npt.ArrayLike) -> Array:
        """What the prior adds to the information at x, elementwise; never negative.

        Minus the curvature, and at least the inverse variance of a flat density: next to what the
        recordings say it is nothing, and where they say nothing (an obstacle that was never
        touched) it keeps steps and covariances finite.
        """
        lower, upper = self.support
        return np.maximum(np.nan_to_num(-self.curvature(x)), 12.0 / (upper - lower) ** 2)

    def ppf(self, q: npt.ArrayLike) -> Array:
        """Quantile at probability q, elementwise; NaN where q is not in [0, 1]."""
        q = np.asarray(q, dtype=np.float64)
        return np.asarray(self._ppf(np.where((q >= 0) & (q <= 1), q, np.nan)))

    def sample(self, rng: np.random.Generator, size: int | tuple[int, ...] = ()) -> Array:
        """Independent draws of the given shape, by inversion."""
        # From the smallest normal number, for a q of exactly 0 is at minus infinity for a normal.
        return self.ppf(rng.uniform(np.finfo(np.float64).tiny, 1.0, size))

    @classmethod
    def of_several(cls, priors: Sequence[Prior]) -> Self:
        """One record for K priors of this kind, its fields (K,): functions of x (..., K).

        The priors have been checked, each by itself.
        """
        record = object.__new__(cls)
        for field in fields(cls):
            values = np.array([getattr(prior, field.name) for prior in priors])
            object.__setattr__(record, field.name, values)
        return record

    @property
    @abstractmethod
    def support(self) -> tuple[float, float]:
        """Smallest and largest value of non-zero density; both may be infinite."""

    @abstractmethod
    def _check(self) -> None: ...

    @abstractmethod
    def _log_density(self, x: Array) -> Array: ...

    @abstractmethod
    def _gradient(self, x: Array) -> Array: ...

    @abstractmethod
    def _curvature(self, x: Array) -> Array: ...

    @abstractmethod
    def _ppf(self, q: Array) -> Array: ...

    def _inside(
        self, x: npt.ArrayLike, function: Callable[[Array], Array], outside: float
    ) -> Array:
        """`function` where x lies in the support, `outside` elsewhere."""
        x = np.asarray(x, dtype=np.float64)
        lower, upper = self.support
        inside = (x >= lower) & (x <= upper) & np.isfinite(x)
        if self._open_at_zero:
            inside &= x > 0
        if inside.all():
            return np.asarray(function(x))
        with np.errstate(all="ignore"):  # outside it may not exist
            return np.where(inside, function(x), outside)


@dataclass(frozen=True)
class Uniform(Prior):
    """Constant on [lower, upper]."""

    lower: float
    upper: float
    kind: ClassVar[str] = "uniform"

    @property
    def support(self) -> tuple[float, float]:
        """[lower, upper]."""
        return self.lower, self.upper

    def _check(self) -> None:
        found = f"lower = {self.lower!r}, upper = {self.upper!r}"
        require(self.lower < self.upper, "uniform prior", found, "lower < upper")
        require(math.isfinite(self.upper - self.lower), "uniform prior", found, "a finite width")

    def _log_density(self, x: Array) -> Array:
        return np.full(x.shape, -np.log(self.upper - self.lower))

    def _gradient(self, x: Array) -> Array:
        return np.zeros(x.shape)

    def _curvature(self, x: Array) -> Array:
        return np.zeros(x.shape)

    def _ppf(self, q: Array) -> Array:
        # The minimum, for rounding may carry the last quantile beyond the support.
        return np.minimum(self.lower + q * (self.upper - self.lower), self.upper)


@dataclass(frozen=True)
class Normal(Prior):
    """Gaussian with mean and standard deviation."""

    mean: float
    sd: float
    kind: ClassVar[str] = "normal"

    @property
    def support(self) -> tuple[float, float]:
        """The whole line."""
        return -math.inf, math.inf

    def _check(self) -> None:
        require(self.sd > 0, "normal prior, sd", repr(self.sd), "a number above 0")

    def _log_density(self, x: Array) -> Array:
        constant = np.log(self.sd) + _LOG_SQRT_2PI
        return np.asarray(-0.5 * ((x - self.mean) / self.sd) ** 2 - constant)

    def _gradient(self, x: Array) -> Array:
        return (self.mean - x) / self.sd**2

    def _curvature(self, x: Array) -> Array:
        return np.full(x.shape, -1 / self.sd**2)

    def _ppf(self, q: Array) -> Array:
        return np.asarray(self.mean + self.sd * ndtri(q))


@dataclass(frozen=True)
class _Half(Prior):
    """The positive half of a density symmetric about 0."""

    scale: float

    @property
    def support(self) -> tuple[float, float]:
        """[0, inf)."""
        return 0.0, math.inf

    def _check(self) -> None:
        require(self.scale > 0, f"{self.kind} prior, scale", repr(self.scale), "a number above 0")


@dataclass(frozen=True)
class HalfNormal(_Half):
    """The positive half of a Gaussian around 0; `scale` is the whole Gaussian's deviation."""

    kind: ClassVar[str] = "halfnormal"

    def _log_density(self, x: Array) -> Array:
        constant = math.log(2) - np.log(self.scale) - _LOG_SQRT_2PI
        return np.asarray(-0.5 * (x / self.scale) ** 2 + constant)

    def _gradient(self, x: Array) -> Array:
        return -x / self.scale**2

    def _curvature(self, x: Array) -> Array:
        return np.full(x.shape, -1 / self.scale**2)

    def _ppf(self, q: Array) -> Array:
        # erfinv and not ndtri((1 + q) / 2), which loses the digits of a small q.
        return np.asarray(self.scale * math.sqrt(2) * erfinv(q))


def _cauchy_log_density(x: Array, scale: float) -> Array:
    """Of a Cauchy density about 0."""
    return np.asarray(-np.log1p((x / scale) ** 2) - np.log(math.pi * scale))


def _cauchy_gradient(x: Array, scale: float) -> Array:
    z = x / scale
    return np.asarray(-2 * z / (1 + z**2) / scale)


def _cauchy_curvature(x: Array, scale: float) -> Array:
    z = x / scale
    return np.asarray(2 * (z**2 - 1) / (1 + z**2) ** 2 / scale**2)


def _cauchy_information(x: Array, scale: float) -> Array:
    """Of the parabola that touches the log density at x and lies below it everywhere.

    de Leeuw and Lange 2009, Comput. Stat. Data Anal. 53:2471: convex tails add no negative one.
    """
    return np.asarray(2.0 / (scale**2 + x**2))


@dataclass(frozen=True)
class Cauchy(Prior):
    """Bell-shaped about a median, its tails so heavy that a value far beyond the scale costs
    little; half of it lies within `scale` of the median.
    """

    median: float
    scale: float
    kind: ClassVar[str] = "cauchy"

    @property
    def support(self) -> tuple[float, float]:
        """The whole line."""
        return -math.inf, math.inf

    def _check(self) -> None:
        require(self.scale > 0, "cauchy prior, scale", repr(self.scale), "a number above 0")

    def information(self, x: npt.ArrayLike) -> Array:
        """See `_cauchy_information`."""
        return _cauchy_information(np.asarray(x) - self.median, self.scale)

    def _log_density(self, x: Array) -> Array:
        return _cauchy_log_density(x - self.median, self.scale)

    def _gradient(self, x: Array) -> Array:
        return _cauchy_gradient(x - self.median, self.scale)

    def _curvature(self, x: Array) -> Array:
        return _cauchy_curvature(x - self.median, self.scale)

    def _ppf(self, q: Array) -> Array:
        # Each tail by its own probability: the tangent near a right angle loses the digits.
        with np.errstate(divide="ignore", invalid="ignore"):
            far = np.where(q < 0.5, -1 / np.tan(np.pi * q), 1 / np.tan(np.pi * (1 - q)))
        z = np.where(np.abs(q - 0.5) < 0.25, np.tan(np.pi * (q - 0.5)), far)
        return np.asarray(self.median + self.scale * np.where(q == 1.0, np.inf, z))


@dataclass(frozen=True)
class HalfCauchy(_Half):
    """The positive half of a Cauchy density around 0; half of it lies below `scale`.

    The usual prior of a size of which only the order is known (Gelman 2006, Bayesian Analysis
    1:515): next to flat below the scale, and a size ten times as large costs 4.6 nats, not 50.
    """

    kind: ClassVar[str] = "halfcauchy"

    def information(self, x: npt.ArrayLike) -> Array:
        """As of the whole density, see `_cauchy_information`."""
        return _cauchy_information(np.asarray(x), self.scale)

    def _log_density(self, x: Array) -> Array:
        return _cauchy_log_density(x, self.scale) + math.log(2)

    def _gradient(self, x: Array) -> Array:
        return _cauchy_gradient(x, self.scale)

    def _curvature(self, x: Array) -> Array:
        return _cauchy_curvature(x, self.scale)

    def _ppf(self, q: Array) -> Array:
        with np.errstate(divide="ignore"):
            far = 1 / np.tan(0.5 * np.pi * (1 - q))
        z = np.where(q < 0.5, np.tan(0.5 * np.pi * q), far)
        return np.asarray(self.scale * np.where(q == 1.0, np.inf, z))


@dataclass(frozen=True)
class LogNormal(Prior):
    """log x is Gaussian around log(median) with deviation `sigma` (no unit)."""

    median: float
    sigma: float
    kind: ClassVar[str] = "lognormal"
    _open_at_zero: ClassVar[bool] = True

    @property
    def support(self) -> tuple[float, float]:
        """(0, inf)."""
        return 0.0, math.inf

    def _check(self) -> None:
        require(self.median > 0, "lognormal prior, median", repr(self.median), "a number above 0")
        require(self.sigma > 0, "lognormal prior, sigma", repr(self.sigma), "a number above 0")

    def _standardised(self, x: Array) -> Array:
        return np.asarray((np.log(x) - np.log(self.median)) / self.sigma)

    def _log_density(self, x: Array) -> Array:
        z = self._standardised(x)
        return np.asarray(-0.5 * z**2 - np.log(x) - np.log(self.sigma) - _LOG_SQRT_2PI)

    def _gradient(self, x: Array) -> Array:
        return -(1 + self._standardised(x) / self.sigma) / x

    def _curvature(self, x: Array) -> Array:
        return (1 + self._standardised(x) / self.sigma - 1 / self.sigma**2) / x**2

    def information(self, x: npt.ArrayLike) -> Array:
        """What it is in log x, where it is a normal: in x its tail is convex."""
        with np.errstate(divide="ignore", over="ignore"):  # at 0, where the density is 0
            return np.asarray(1.0 / (self.sigma * np.asarray(x)) ** 2)

    def _ppf(self, q: Array) -> Array:
        return np.asarray(self.median * np.exp(self.sigma * ndtri(q)))


@dataclass(frozen=True)
class LogUniform(Prior):
    """log x is constant on [log(lower), log(upper)]: the density falls as 1/x."""

    lower: float
    upper: float
    kind: ClassVar[str] = "loguniform"

    @property
    def support(self) -> tuple[float, float]:
        """[lower, upper]."""
        return self.lower, self.upper

    def _check(self) -> None:
        found = f"lower = {self.lower!r}, upper = {self.upper!r}"
        require(0 < self.lower < self.upper, "loguniform prior", found, "0 < lower < upper")

    @property
    def _log_width(self) -> Array:
        return np.asarray(np.log(self.upper) - np.log(self.lower))

    def _log_density(self, x: Array) -> Array:
        return np.asarray(-np.log(x) - np.log(self._log_width))

    def _gradient(self, x: Array) -> Array:
        return -1 / x

    def _curvature(self, x: Array) -> Array:
        return 1 / x**2

    def _ppf(self, q: Array) -> Array:
        x = np.exp(np.log(self.lower) + q * self._log_width)
        return np.asarray(np.clip(x, self.lower, self.upper))
