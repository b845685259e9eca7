"""What a set of effects would leave, by a few steps of its fit over periods ahead.

The equation of motion in flight, the same over all stretches and periods ahead each propose sets of
effects with values. What they leave of their own problems is not comparable: forces, or states, in
rows of their own. One measure for all is the misfit of every period ahead (multiple shooting) after
one step of Gauss and Newton from the values that are proposed, or a few: as no period is out of
step with its recording, the second and third lead to where laws differ that the first cannot tell
apart. A set pays for its parameters as in Schwarz's criterion (Schwarz 1978, Annals of Statistics
6:461).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.diagnosis.candidates.term_sets import EffectSet
from bayesimpact.diagnosis.refits.extend import difference_steps
from bayesimpact.diagnosis.refits.refit import start_of_set, step_sizes
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.initial.multiple_shooting import (
    MultipleShooting,
    Starts,
    from_starts,
    multiple_shooting,
)
from bayesimpact.inference.likelihood import Linearisation
from bayesimpact.model.effects.effect import Scales

Array = NDArray[np.float64]

RANK = 1e-13  # of the largest eigenvalue of products: less is rounding


@dataclass(frozen=True, eq=False)
class SteppedSet:
    """A set by steps of its fit over periods ahead.

    Attributes
    ----------
    left : minus the log likelihood of periods ahead that they reach, over that of white noise, nats
    price : of its parameters, nats
    chosen : the set with the values from which the last step was made
    """

    left: float
    price: float
    chosen: EffectSet

    @property
    def cost(self) -> float:
        """What sets are compared by, nats."""
        return self.left + self.price


def after_steps(
    base: Fit, chosen: EffectSet, scales: Scales, steps: int = 1, starts: tuple[Starts, ...] = ()
) -> SteppedSet:
    """A set by up to so many steps from its values; what is left is infinite where no period is
    told, or the motion runs away. Steps end where one has led to a larger misfit.

    starts : of periods, with the responses to them, for the first step; as the set has them where
        there are none
    """
    density, theta = start_of_set(base, chosen.effects, chosen.values, scales)
    layout, priors = density.oscillator.layout, density.priors
    low = np.maximum([p.lower for p in layout.parameters], priors.lower)
    high = np.minimum([p.upper for p in layout.parameters], priors.upper)
    moving = np.setdiff1d(np.arange(theta.size), layout.roles("noise"))
    sizes = step_sizes(layout.names, density.oscillator.acting, scales, ())
    differences = difference_steps(base, density, sizes)
    found, least, price, reached = np.inf, np.inf, 0.0, theta
    for _ in range(steps):
        with np.errstate(over="ignore", invalid="ignore"):
            if starts:
                ahead: MultipleShooting | None = from_starts(density.likelihood, starts)
            else:
                ahead = multiple_shooting(density.likelihood, theta)
            starts = ()
            if ahead is None:
                break
            parts = ahead.linearise(theta, differences, roughly=True)
            now, left, change = _step(parts, moving, theta.size)
        if not now < least:
            break
        count = float(ahead.sizes.sum())
        reduced = left / ahead.noise.level**2 / count
        price = 0.5 * moving.size * float(np.log(count))
        found, least = 0.5 * count * float(np.log(max(reduced, 1.0))), now
        reached, theta = theta, np.clip(theta + change, low, high)
    values = dict(zip(layout.names, map(float, reached), strict=True))
    return SteppedSet(found, price, replace(chosen, values=values) if steps > 1 else chosen)


def _step(
    parts: tuple[Linearisation, ...], moving: NDArray[np.int64], size: int
) -> tuple[float, float, Array]:
    """Sums of squares of whitened residuals as they are, and when the `moving` ones of `size`
    parameters have taken what is linear in them; and by how much these change. Infinite where they
    are not finite.
    """
    jacobian = np.concatenate([part.whole(size)[:, moving] for part in parts])
    residual = np.concatenate([part.residual for part in parts])
    change = np.zeros(size)
    if not (np.isfinite(jacobian).all() and np.isfinite(residual).all()):
        return np.inf, np.inf, change
    products, slope = jacobian.T @ jacobian, jacobian.T @ residual
    norm = np.sqrt(np.diag(products))
    norm[norm == 0.0] = 1.0
    values, axes = np.linalg.eigh(products / np.outer(norm, norm))
    told = values > RANK * values[-1]
    step = axes[:, told] @ ((axes[:, told].T @ (slope / norm)) / values[told])
    change[moving] = step / norm
    left = float(np.sum((residual - jacobian @ change[moving]) ** 2))
    return float(residual @ residual), left, change
