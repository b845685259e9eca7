"""Published test functions of global optimisation: (n, d) -> (n,)."""

from __future__ import annotations

import numpy as np

Array = np.ndarray


def sphere(x: Array) -> Array:
    return np.sum(x**2, axis=1)


def rosenbrock(x: Array) -> Array:
    """Rosenbrock (1960), a bent valley: 0 at (1, ..., 1)."""
    return np.sum(100 * (x[:, 1:] - x[:, :-1] ** 2) ** 2 + (1 - x[:, :-1]) ** 2, axis=1)


def rastrigin(x: Array) -> Array:
    """Rastrigin (1974), about 10^d side minima: 0 at 0."""
    return np.sum(x**2 - 10 * np.cos(2 * np.pi * x) + 10, axis=1)


def ackley(x: Array) -> Array:
    """Ackley (1987), a funnel with ripples: 0 at 0."""
    ripples = np.exp(np.mean(np.cos(2 * np.pi * x), axis=1))
    return 20 - 20 * np.exp(-0.2 * np.sqrt(np.mean(x**2, axis=1))) + np.e - ripples


def ellipsoid(x: Array) -> Array:
    """A rotated ellipsoid with axes of 1 to 1000 (condition 1e6), off-centre: 0 at 0.3."""
    d = x.shape[1]
    rotation, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(d, d)))
    return np.sum(10 ** (6 * np.arange(d) / (d - 1)) * ((x - 0.3) @ rotation) ** 2, axis=1)


def double_funnel(x: Array) -> Array:
    """Lunacek, Whitley & Sutton (2008): Rastrigin's ripples on two funnels, 0 in the narrower."""
    d = x.shape[1]
    steepness = 1 - 1 / (2 * np.sqrt(d + 20) - 8.2)
    other = -np.sqrt((2.5**2 - 1) / steepness)
    right = np.sum((x - 2.5) ** 2, axis=1)
    wrong = d + steepness * np.sum((x - other) ** 2, axis=1)
    return np.minimum(right, wrong) + 10 * np.sum(1 - np.cos(2 * np.pi * (x - 2.5)), axis=1)
