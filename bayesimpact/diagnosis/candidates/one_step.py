"""What a set of effects would leave, by one step of its fit over periods ahead.

The equation of motion in flight, the same over all stretches and periods ahead each propose sets of
effects with values. What they leave of their own problems is not comparable: forces, or states, in
rows of their own. One measure for all is the misfit of every period ahead (multiple shooting) after
one step of Gauss and Newton from the values that are proposed; a set pays for its parameters as in
Schwarz's criterion (Schwarz 1978, Annals of Statistics 6:461).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesimpact.diagnosis.candidates.term_sets import EffectSet
from bayesimpact.diagnosis.refits.extend import difference_steps
from bayesimpact.diagnosis.refits.refit import start_of_set, step_sizes
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.initial.multiple_shooting import multiple_shooting
from bayesimpact.inference.likelihood import Linearisation
from bayesimpact.model.effects.effect import Scales

Array = NDArray[np.float64]

RANK = 1e-9  # of the largest singular value: what parameters do not tell apart


def criterion_after_a_step(base: Fit, chosen: EffectSet, scales: Scales) -> float:
    """Minus the log likelihood of periods ahead that a set reaches by one step from its values, and
    half the logarithm of the number of samples for each of its parameters, nats; infinite where no
    period is told, or the motion runs away.
    """
    density, start = start_of_set(base, chosen.effects, chosen.values, scales)
    with np.errstate(over="ignore", invalid="ignore"):
        ahead = multiple_shooting(density.likelihood, start)
        if ahead is None:
            return np.inf
        layout = density.oscillator.layout
        sizes = step_sizes(layout.names, density.oscillator.acting, scales, ())
        steps = difference_steps(base, density, sizes)
        parts = ahead.linearise(start, steps, roughly=True)
        moving = np.setdiff1d(np.arange(start.size), layout.roles("noise"))
        left = _after_a_step(parts, moving, start.size)
    if not np.isfinite(left):
        return np.inf
    count = float(ahead.sizes.sum())
    reduced = left / ahead.noise.level**2 / count
    return 0.5 * count * float(np.log(max(reduced, 1.0))) + 0.5 * moving.size * float(np.log(count))


def _after_a_step(parts: tuple[Linearisation, ...], moving: NDArray[np.int64], size: int) -> float:
    """Sum of squares that is left of whitened residuals when the `moving` ones of `size` parameters
    have taken what is linear in them.
    """
    jacobian = np.concatenate([part.whole(size)[:, moving] for part in parts])
    residual = np.concatenate([part.residual for part in parts])
    if not (np.isfinite(jacobian).all() and np.isfinite(residual).all()):
        return np.inf
    norm = np.linalg.norm(jacobian, axis=0)
    scaled = jacobian / np.where(norm > 0.0, norm, 1.0)
    step = np.linalg.lstsq(scaled, residual, rcond=RANK)[0]
    return float(np.sum((residual - scaled @ step) ** 2))
