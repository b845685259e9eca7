"""Does a parameter drift or jump from session to session, or go with a condition?

Estimates x_i with standard errors s_i, and a scatter between sessions of unknown size, tau. Under
the hypothesis that nothing changes the sessions may be exchanged, so the largest log likelihood
ratio over a line and all single steps is judged against its own law under permutations (Westfall
and Young 1993); the price for the number of parameters is Bonferroni's. What changed is then told
by the likelihoods of a line and of a step with tau fitted in each, the step paying for the choice
of its place.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

Array = NDArray[np.float64]

FEWEST = 6  # sessions: of 720 orders two are as clear as a rising one; a step needs more of them
PERMUTATIONS = 4000
FALSE_ALARM = 0.02  # per fleet and column: that anything is said to change where nothing does
BESIDE = 2  # sessions at least on either side of a step
NORMAL_90 = 1.6448536269514722


@dataclass(frozen=True)
class Trend:
    """A change of one parameter with time or with a condition.

    Attributes
    ----------
    parameter, along : names; `along` is "date", "order" or a condition
    kind : a drift (per unit of `along`) or a step
    amount, error : slope or height, SI units of the parameter, and its standard error
    place : of a step, between two values of `along`; both equal to NaN for a drift
    p_value : corrected for the number of parameters
    """

    parameter: str
    along: str
    kind: Literal["drift", "step"]
    amount: float
    error: float
    place: tuple[float, float]
    p_value: float

    @property
    def ci90(self) -> tuple[float, float]:
        """90 % interval of the amount."""
        half = NORMAL_90 * self.error
        return self.amount - half, self.amount + half


def find_trend(
    names: tuple[str, str],
    t: Array,
    estimates: Array,
    errors: Array,
    *,
    rng: np.random.Generator,
    tests: int = 1,
    steps: bool = True,
) -> Trend | None:
    """The change of a parameter along t (n,), if there is one.

    Parameters
    ----------
    names : of the parameter and of what t is
    estimates, errors : (n,) of every session, SI
    tests : how many parameters are tested beside one another
    steps : whether a single step is looked for beside a line
    """
    if t.size < FEWEST or np.ptp(t) == 0.0:
        return None
    order = np.argsort(t, kind="stable")
    t, x, s = t[order], estimates[order], errors[order]
    designs = _designs(t, steps)
    weights = 1.0 / (s**2 + _scatter(np.ones((t.size, 1)), x, s) ** 2)
    found = _ratio(designs, x, weights)
    draws = np.array([rng.permutation(t.size) for _ in range(PERMUTATIONS)])
    null = np.max([_ratios(d, x[draws], weights[draws]) for d in designs], axis=0)
    p_value = min(1.0, tests * float(1 + np.sum(null >= found.max())) / (1 + PERMUTATIONS))
    if p_value > FALSE_ALARM:
        return None
    return _described(names, t, x, s, designs, p_value)


def _designs(t: Array, steps: bool) -> list[Array]:
    """What may change beside a constant: a line, and steps at every place between sessions."""
    line = (t - t.mean()) / np.ptp(t)
    places = range(BESIDE, t.size - BESIDE + 1) if steps else ()
    jumps = [np.where(np.arange(t.size) >= k, 1.0, 0.0) for k in places if t[k] > t[k - 1]]
    return [line, *jumps]


def _ratio(designs: list[Array], x: Array, weights: Array) -> Array:
    return np.array([_ratios(d, x[None], weights[None])[0] for d in designs])


def _ratios(design: Array, x: Array, weights: Array) -> Array:
    """Log likelihood ratios of a change of one shape (n,) in rows of x (m, n)."""
    total = weights.sum(axis=1, keepdims=True)
    shape = design - (weights * design).sum(axis=1, keepdims=True) / total
    rest = x - (weights * x).sum(axis=1, keepdims=True) / total
    slope = (weights * shape * rest).sum(axis=1)
    return np.asarray(0.5 * slope**2 / (weights * shape**2).sum(axis=1))


def _scatter(design: Array, x: Array, s: Array) -> float:
    """Scatter between sessions beside a linear model, by restricted likelihood."""
    most = float(np.std(x)) * 3 + float(np.median(s))
    found = minimize_scalar(
        lambda u: -_likelihood(design, x, s, most * float(u)), bounds=(0.0, 1.0), method="bounded"
    )
    return most * float(found.x)


def _likelihood(design: Array, x: Array, s: Array, tau: float) -> float:
    """Restricted log likelihood of a scatter (Patterson and Thompson 1971)."""
    weights = 1.0 / (s**2 + tau**2)
    normal = design.T @ (weights[:, None] * design)
    rest = x - design @ np.linalg.solve(normal, design.T @ (weights * x))
    log_det = float(np.linalg.slogdet(normal)[1])
    return float(0.5 * np.sum(np.log(weights)) - 0.5 * log_det - 0.5 * np.sum(weights * rest**2))


def _fitted(shape: Array, x: Array, s: Array) -> tuple[float, float, float]:
    """Log likelihood at its best scatter, height of a shape (n,) and its standard error."""
    design = np.stack([np.ones(x.size), shape], axis=1)
    tau = _scatter(design, x, s)
    weights = 1.0 / (s**2 + tau**2)
    covariance = np.linalg.inv(design.T @ (weights[:, None] * design))
    values = covariance @ (design.T @ (weights * x))
    rest = x - design @ values
    likelihood = 0.5 * np.sum(np.log(weights)) - 0.5 * np.sum(weights * rest**2)
    return float(likelihood), float(values[1]), float(np.sqrt(covariance[1, 1]))


def _described(
    names: tuple[str, str], t: Array, x: Array, s: Array, designs: list[Array], p_value: float
) -> Trend:
    line, *jumps = (_fitted(d, x, s) for d in designs)
    price = np.log(max(len(jumps), 1))
    best = max(range(len(jumps)), key=lambda k: jumps[k][0], default=None)
    if best is not None and jumps[best][0] - price > line[0]:
        after = int(np.argmax(designs[1 + best] > 0))
        _, height, error = jumps[best]
        place = float(t[after - 1]), float(t[after])
        return Trend(*names, "step", height, error, place, p_value)
    extent = float(np.ptp(t))
    nowhere = (float("nan"), float("nan"))
    return Trend(*names, "drift", line[1] / extent, line[2] / extent, nowhere, p_value)
