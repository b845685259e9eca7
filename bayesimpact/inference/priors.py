"""Independent priors of all parameters, and how campaign.toml writes one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray

from bayesimpact.data.short_repr import short_repr
from bayesimpact.errors import InputError
from bayesimpact.inference.prior import (
    Cauchy,
    HalfCauchy,
    HalfNormal,
    LogNormal,
    LogUniform,
    Normal,
    Prior,
    Uniform,
    require,
)

Array = NDArray[np.float64]

KINDS: Mapping[str, type[Prior]] = {
    prior.kind: prior
    for prior in (Uniform, Normal, HalfNormal, Cauchy, HalfCauchy, LogNormal, LogUniform)
}


def prior_from_table(name: str, table: Mapping[str, Any]) -> Prior:
    """Prior of parameter `name` from its table in campaign.toml's [priors], SI units.

    `{distribution = "uniform", lower =, upper =}` · `{"normal", mean =, sd =}` ·
    `{"halfnormal", scale =}` · `{"cauchy", median =, scale =}` · `{"halfcauchy", scale =}` ·
    `{"lognormal", median =, sigma =}` · `{"loguniform", lower =, upper =}`.

    Raises
    ------
    InputError : unknown distribution, missing or unknown key, or a value that cannot be used
    """
    where = f"[priors] {name}"
    kind = table.get("distribution")
    known = isinstance(kind, str) and kind in KINDS
    require(known, f"{where}, distribution", repr(kind), " | ".join(KINDS))
    prior = KINDS[str(kind)]
    wanted = [field.name for field in fields(prior)]
    given = [key for key in table if key != "distribution"]
    require(
        sorted(given) == sorted(wanted),
        f"{where} ({kind})",
        "the keys " + (", ".join(map(str, given)) or "(none)"),
        "the keys " + ", ".join(wanted),
    )
    try:
        return prior(**{key: table[key] for key in given})
    except InputError as error:
        raise InputError(f"{where}: {error.where}", error.found, error.accepted) from None


@dataclass(frozen=True)
class Priors:
    """Independent priors of all d parameters, in the order of the parameter vector.

    Raises
    ------
    InputError : no parameter, or `theta` of the wrong length
    """

    parameters: tuple[Prior, ...]

    __repr__ = short_repr

    def __post_init__(self) -> None:
        require(len(self.parameters) > 0, "priors", "none", "one prior per parameter")

    def __len__(self) -> int:
        return len(self.parameters)

    def log_density(self, theta: npt.ArrayLike) -> Array:
        """Joint log density (B,) of theta (B, d); any leading shape, none included."""
        theta = self._checked(theta)
        total = np.zeros(theta.shape[:-1])
        for columns, prior in self._kinds:
            total += prior.log_density(theta[..., columns]).sum(axis=-1)
        return total

    def gradient(self, theta: npt.ArrayLike) -> Array:
        """Gradient (d,) of the log density at theta (d,); any leading shape as well."""
        return self._each(theta, lambda prior, x: prior.gradient(x))

    def hessian(self, theta: npt.ArrayLike) -> Array:
        """Diagonal (d,) of the log density's Hessian at theta (d,); the rest of it is zero."""
        return self._each(theta, lambda prior, x: prior.curvature(x))

    def information(self, theta: npt.ArrayLike) -> Array:
        """What the priors add to the information at theta (d,): inverse variances, never negative.

        See `Prior.information`; any leading shape as well.
        """
        return self._each(theta, lambda prior, x: prior.information(x))

    def ppf(self, q: npt.ArrayLike) -> Array:
        """Quantiles (B, d) at probabilities q (B, d), parameter by parameter."""
        q = self._checked(q)
        return np.stack([p.ppf(q[..., i]) for i, p in enumerate(self.parameters)], axis=-1)

    def sample(self, rng: np.random.Generator, size: int) -> Array:
        """`size` independent draws (size, d)."""
        return np.stack([p.sample(rng, size) for p in self.parameters], axis=-1)

    @property
    def lower(self) -> Array:
        """Lower ends (d,) of the supports."""
        return np.array([p.support[0] for p in self.parameters])

    @property
    def upper(self) -> Array:
        """Upper ends (d,) of the supports."""
        return np.array([p.support[1] for p in self.parameters])

    @cached_property
    def _kinds(self) -> tuple[tuple[NDArray[np.int64], Prior], ...]:
        """Columns of the priors of each kind, and these in one record."""
        found, kinds = [], list[type[Prior]](dict.fromkeys(map(type, self.parameters)))
        for kind in kinds:
            columns = np.array([i for i, p in enumerate(self.parameters) if type(p) is kind])
            found.append((columns, kind.of_several([self.parameters[i] for i in columns])))
        return tuple(found)

    def _each(self, theta: npt.ArrayLike, function: Callable[[Prior, Array], Array]) -> Array:
        """A function of every parameter's prior and its column of theta (..., d)."""
        theta = self._checked(theta)
        result = np.empty(theta.shape)
        for columns, prior in self._kinds:
            result[..., columns] = function(prior, theta[..., columns])
        return result

    def _checked(self, theta: npt.ArrayLike) -> Array:
        theta = np.asarray(theta, dtype=np.float64)
        require(
            theta.ndim > 0 and theta.shape[-1] == len(self),
            "parameter vector",
            f"shape {theta.shape}",
            f"(..., {len(self)})",
        )
        return theta
