"""The profile likelihood of a shape parameter, to its highest point.

A Maxwell branch that relaxes within the contact looks like a dashpot; its stiffness, its time and
the contact damping then trade against each other along a curve that leaves the response the same to
a few parts in ten thousand. An ascent with all parameters creeps there. With the shape parameter
held the rest is well determined: the profile of the posterior over the logarithm of the shape is
searched in one dimension (Brent 1973).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from bayesimpact.diagnosis.refits.evidence import gradient
from bayesimpact.diagnosis.refits.extend import difference_steps, owner
from bayesimpact.diagnosis.refits.refit import TOLERANCE
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.mode import find_mode
from bayesimpact.model.effects.effect import Effect

Array = NDArray[np.float64]

FIRST = 0.2  # first move along the logarithm of the shape
CLOSE = 0.02  # in that logarithm: how near the mode is found
ENOUGH = 0.02  # nats: or so little above it
FARTHEST = 5.0  # that the shape is followed, in its logarithm
MOST = 12  # moves, and as many more of Brent's method
ITERATIONS = 20  # of an ascent with the shape held


def profiled_shape(fit: Fit) -> int | None:
    """Position of the shape parameter (a time constant, a depth) that an unfinished ascent moves
    on.

    The one that the undamped step would change by the largest factor; None without any. Frequencies
    have side minima, no ridge. Only of effects beside the base model: what its own stops are, is
    known from the base fit.
    """
    effects: Sequence[Effect] = fit.density.oscillator.effects
    own = {f"{e.id}.{p.name}" for e in effects for p in e.parameters}
    step = np.abs(fit.covariance @ gradient(fit))
    found = {}
    for i, name in enumerate(fit.names):
        if name.split("[")[0] in own and fit.mode[i] > 0:
            parameter = owner(effects, name)[1]
            if parameter.is_shape and parameter.grid is not None and not parameter.spectral:
                found[i] = float(step[i] / fit.mode[i])
    return max(found, key=lambda i: found[i], default=None)


def profiled(fit: Fit) -> Fit:
    """The fit that a search along its profile likelihood reaches; never a worse one.

    Converged only where the likelihood falls again on both sides.
    """
    column = profiled_shape(fit)
    if column is None or not np.isfinite(fit.log_posterior):
        return fit
    profile = _Profile(column, fit)
    enclosed = profile.search(float(np.log(fit.mode[column])))
    best = max(profile.fits.values(), key=lambda f: f.log_posterior)
    if best.log_posterior < fit.log_posterior:
        return fit
    return replace(best, converged=best.converged and enclosed)


@dataclass
class _Profile:
    """Fits with one parameter held, by its logarithm."""

    column: int
    first: Fit
    fits: dict[float, Fit] = field(default_factory=dict)

    def __call__(self, x: float) -> float:
        """Minus the log posterior at its mode with the shape held at exp(x)."""
        x = float(x)
        if x not in self.fits:
            near = min(self.fits, key=lambda known: abs(known - x), default=None)
            before = self.first if near is None else self.fits[near]
            start = self.predicted(before, x)
            self.fits[x] = find_mode(
                before.density,
                start,
                steps=difference_steps(before, before.density, {}),
                fixed=[self.column],
                tolerance=TOLERANCE,
                max_iterations=ITERATIONS,
            )
        return -self.fits[x].log_posterior

    def predicted(self, before: Fit, x: float) -> Array:
        """Where the ridge through a fit passes with the shape at exp(x): along its regression.

        Positive parameters move by their logarithms, and at most as the square of the shape.
        """
        c = self.column
        move = x - float(np.log(before.mode[c]))
        change = before.covariance[:, c] / before.covariance[c, c] * before.mode[c] * move
        lower = np.array([p.lower for p in before.density.oscillator.layout.parameters])
        positive = (lower == 0.0) & (before.mode > 0.0)
        change[positive] /= before.mode[positive]
        factor = np.exp(np.clip(change[positive], -2 * abs(move), 2 * abs(move)))
        start = np.asarray(before.mode + change)
        start[positive] = before.mode[positive] * factor
        start[c] = np.exp(x)
        return start

    def search(self, x: float) -> bool:
        """Downhill in growing steps until the profile rises again, then Brent's method.

        False when it never rises.
        """
        step, begun = FIRST, x
        if self(x + step) > self(x):
            step = -step
        low, middle, high = x, x, x + step
        for _ in range(MOST):
            if self(high) > self(middle) or abs(high - begun) > FARTHEST:
                break
            low, middle, step = middle, high, 1.6 * step
            high = middle + step
        if low == middle:  # the first point is the best so far: look behind it
            low = x - step
        if not (self(low) > self(middle) < self(high)):
            return False
        optimize.minimize_scalar(
            self,
            bracket=(low, middle, high),
            method="brent",
            options={
                "xtol": max(CLOSE, self.width(low, middle, high)) / max(1.0, abs(middle)),
                "maxiter": MOST,
            },
        )
        return True

    def width(self, *bracket: float) -> float:
        """How far from the lowest point of the parabola through three it lies ENOUGH higher."""
        curvature = np.polyfit(np.array(bracket) - bracket[1], [self(x) for x in bracket], 2)[0]
        return float(np.sqrt(ENOUGH / curvature))
