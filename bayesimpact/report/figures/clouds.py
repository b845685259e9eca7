"""Posteriors as a corner plot shows them: clouds of draws, or normal laws in closed form."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from bayesimpact.inference.sampling.convergence import quiet_arviz
from bayesimpact.report.figures.style import Array, LabScale
from bayesimpact.report.results import Draws

LEVELS = (1 - float(np.exp(-0.5)), 1 - float(np.exp(-2.0)))
"""Probability inside the ellipses of one and two standard deviations of a Gaussian in the plane."""
_REACH = 3.0  # standard deviations to which a normal law is drawn
_CURVE = np.linspace(-_REACH, _REACH, 121)
_CIRCLE = np.linspace(0.0, 2 * np.pi, 121)


@dataclass(frozen=True, eq=False)
class NormalLaw:
    """A normal law of p parameters: mean (p,) and covariance (p, p), SI; names as in `Draws`."""

    label: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    mean: Array
    covariance: Array

    @property
    def values(self) -> Array:
        """(3, p), mean and two standard deviations to either side."""
        return np.asarray(self.mean + np.outer([-2.0, 0.0, 2.0], np.sqrt(np.diag(self.covariance))))


Law = Draws | NormalLaw


class Cloud(ABC):
    """One posterior on the axes of the plot; parameters that it lacks are NaN."""

    colour: str
    label: str

    @property
    @abstractmethod
    def ranges(self) -> Array:
        """(p, 2), what nearly all of it spans."""

    @abstractmethod
    def marginal(self, axis: Axes, k: int) -> None:
        """Draw the density of parameter k."""

    @abstractmethod
    def pair(self, axis: Axes, i: int, j: int) -> None:
        """Draw the contours of parameter i over parameter j."""

    def has(self, k: int) -> bool:
        """True when parameter k is known and not constant."""
        low, high = self.ranges[k]
        return bool(np.isfinite(low) and high > low)


@dataclass(frozen=True, eq=False)
class DrawCloud(Cloud):
    """Draws as plotted, (S, p)."""

    values: Array
    colour: str
    label: str

    @cached_property
    def ranges(self) -> Array:
        """Percentiles that leave three in a thousand draws out."""
        return np.percentile(self.values, [0.15, 99.85], axis=0).T

    def marginal(self, axis: Axes, k: int) -> None:
        """Histogram."""
        shared: dict[str, Any] = {"bins": 28, "range": tuple(self.ranges[k]), "density": True}
        shared["color"] = self.colour
        axis.hist(self.values[:, k], histtype="stepfilled", alpha=0.25, **shared)
        axis.hist(self.values[:, k], histtype="step", lw=1.0, **shared)

    def pair(self, axis: Axes, i: int, j: int) -> None:
        """Smoothed contours."""
        quiet_arviz()  # corner imports it, with its announcement
        import corner

        corner.hist2d(
            self.values[:, j],
            self.values[:, i],
            ax=axis,
            range=[tuple(self.ranges[j]), tuple(self.ranges[i])],
            bins=20,
            levels=LEVELS,
            smooth=1.2,
            color=self.colour,
            plot_datapoints=False,
            plot_density=False,
            no_fill_contours=True,
            fill_contours=False,
            contour_kwargs={"linewidths": 0.9},
            quiet=True,
        )


@dataclass(frozen=True, eq=False)
class NormalCloud(Cloud):
    """A normal law as plotted: mean (p,), covariance (p, p)."""

    mean: Array
    covariance: Array
    colour: str
    label: str

    @cached_property
    def ranges(self) -> Array:
        """Three standard deviations to either side."""
        sd = np.sqrt(np.diag(self.covariance))
        return np.stack([self.mean - _REACH * sd, self.mean + _REACH * sd], axis=1)

    def marginal(self, axis: Axes, k: int) -> None:
        """The density itself."""
        sd = float(np.sqrt(self.covariance[k, k]))
        x, density = self.mean[k] + sd * _CURVE, np.exp(-0.5 * _CURVE**2) / sd
        axis.fill_between(x, density, color=self.colour, alpha=0.25, lw=0)
        axis.plot(x, density, color=self.colour, lw=1.0)

    def pair(self, axis: Axes, i: int, j: int) -> None:
        """Ellipses of one and two standard deviations."""
        block = self.covariance[np.ix_([j, i], [j, i])]
        values, vectors = np.linalg.eigh(block)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        circle = np.stack([np.cos(_CIRCLE), np.sin(_CIRCLE)])
        for size in (1.0, 2.0):
            x, y = self.mean[[j, i], None] + size * root @ circle
            axis.plot(x, y, color=self.colour, lw=0.9)


def plotted(law: Law, names: tuple[str, ...], axes: list[LabScale], colour: str) -> Cloud:
    """A posterior on the axes of the plot, in the order of `names`."""
    columns = [law.names.index(name) if name in law.names else -1 for name in names]
    known = np.array(columns) >= 0
    if isinstance(law, NormalLaw):
        scale = np.array([axis.scale for axis in axes])
        mean = [axis(law.mean[c]) for axis, c in zip(axes, columns, strict=True)]
        covariance = law.covariance[np.ix_(columns, columns)] * np.outer(scale, scale)
        covariance[~np.outer(known, known)] = np.nan
        return NormalCloud(np.where(known, mean, np.nan), covariance, colour, law.label)
    values = np.column_stack(
        [axis(law.values[:, c]) for axis, c in zip(axes, columns, strict=True)]
    )
    return DrawCloud(np.where(known, values, np.nan), colour, law.label)
