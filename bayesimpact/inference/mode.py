"""The mode of a posterior and its curvature: Levenberg-Marquardt with the noise level profiled out.

For a given motion the best noise level has a one-dimensional optimum, so the search runs on

    f(theta) = sum_r [ n_r log sigma_r + S_r(theta) / (2 sigma_r^2) ] - log prior,   sigma at its
    optimum,

whose Gauss-Newton matrix is J'J / sigma^2 plus the priors' curvature (Levenberg 1944; Marquardt
1963). Raw sums of squares would span nine decades; f spans a few thousand nats.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesimpact.inference.ascent import Ascent
from bayesimpact.inference.fit import Fit, PosteriorDensity
from bayesimpact.inference.likelihood import Linearisation
from bayesimpact.inference.onset_jumps import beyond_onset

Array = NDArray[np.float64]

FIRST_DAMPING = 1e-3  # of the scaled normal equations
NEAR = 1.0  # size of a step, standard deviations, from which on derivatives are to second order
SLOW = 0.5  # of the last step's size: above that, old derivatives are renewed
STALLED = 4.0  # tolerances: a gain that such a step would have brought, or less
STALLS = 2  # such steps in a row, with new derivatives: these tell no more
LITTLE = 0.1  # nats: of a step by differences that promised more; two in a row do not lead far
MOST_ONSETS = 3  # readings that an ascent may set right
DOUBTFUL = 1.0  # last step, in standard deviations, that rough derivatives may still promise then


def find_mode(
    density: PosteriorDensity,
    start: Array,
    *,
    steps: Array | None = None,
    slopes: tuple[Linearisation, ...] | None = None,
    fixed: Sequence[int] = (),
    tolerance: float = 1e-3,
    max_iterations: int = 60,
    least_gain: float = 0.0,
    goal: float = -np.inf,
) -> Fit:
    """Ascend from `start` (d,) to the nearest mode.

    `steps` (d,) are difference steps for models without exact derivatives. They are refreshed to a
    twentieth of the standard deviations that each parameter would have if it alone were unknown, as
    these become known, to a tenth of that where an ascent ends short. `slopes` are derivatives that
    hold near enough all the way (the chord method), where they are known and new ones would be
    dear. Parameters `fixed` stay where they start. The noise levels in `start` are ignored. Stops
    when a step is below `tolerance` standard deviations, or when new derivatives twice gain no more
    than a few such steps would (or than `LITTLE`, where differences promised more: not converged
    then). Where gains below `least_gain`, nats, decide nothing, two of them end an ascent. So do
    two that fall short of what every step left would have to gain for a log posterior of `goal`: an
    end below it is of no use. A start where no motion is finite leads nowhere: log posterior -inf.
    Where a reading seems to stand on the wrong side of a contact onset, the ascent goes on beyond
    that (`onset_jumps`).
    """

    limits = _Limits(tolerance, max_iterations, least_gain, goal)

    def ascended(start: Array) -> Fit:
        return _ascended(Ascent(density, steps, slopes, fixed), start, limits)

    found = ascended(start)
    for _ in range(MOST_ONSETS):
        beyond = beyond_onset(found, fixed)
        there = None if beyond is None else ascended(beyond)
        if there is None or there.log_posterior <= found.log_posterior:
            break
        found = there
    return found


@dataclass(frozen=True)
class _Limits:
    """When an ascent ends, see `find_mode`."""

    tolerance: float
    max_iterations: int
    least_gain: float
    goal: float


def _ascended(ascent: Ascent, start: Array, limits: _Limits) -> Fit:
    """One ascent, see `find_mode`."""
    tolerance, max_iterations = limits.tolerance, limits.max_iterations
    here, differences = ascent.evaluate(start), ascent.steps is not None
    if not np.isfinite(here.value):
        return ascent.without_mode(here, ())
    damping, converged, last, stalls = FIRST_DAMPING, False, np.inf, 0
    while ascent.iterations < max_iterations and not converged:
        slope = ascent.linear(here)
        if not slope.is_finite:
            break
        whole = ascent.step(here.theta, slope, 0.0)
        size = float(np.sqrt(np.maximum(whole @ slope.matrix @ whole, 0.0)))  # undamped
        if ascent.roughly and size < NEAR:
            ascent.refine()  # rough derivatives do not decide either
            continue
        if ascent.stale and (size < tolerance or size > SLOW * last):
            ascent.renew()  # old derivatives neither decide nor creep
            continue
        ascent.iterations += 1
        last, converged = size, size < tolerance
        there, used = ascent.descend(here, slope, damping, once=converged or ascent.stale)
        gain, moved = here.value - there.value, there is not here
        here, damping = there, max(used * 0.1, 1e-12) if moved else damping
        if ascent.stale and not moved:
            ascent.renew()
        elif not (ascent.stale or converged):
            creeps = differences and size > DOUBTFUL and gain < LITTLE
            least = max(
                limits.least_gain,
                (limits.goal + here.value) / (max_iterations - ascent.iterations + 1),
            )
            creeps = creeps or gain < max(least, 0.5 * (STALLED * tolerance) ** 2)
            stalls = stalls + 1 if creeps else 0
            if stalls < STALLS and moved:
                continue
            if stalls and least > LITTLE:
                break
            stalls = 0
            if ascent.roughly:
                ascent.refine()
            elif size > STALLED * tolerance and ascent.can_shorten:
                ascent.shorten()
                damping = FIRST_DAMPING
            else:
                converged = moved and size < DOUBTFUL
                break
    return ascent.fit(here, converged)
