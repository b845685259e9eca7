"""A banana-shaped density in place of an oscillator's likelihood."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

from bayesimpact.inference.fit import PosteriorDensity
from bayesimpact.inference.likelihood import Linearisation
from bayesimpact.inference.prior import LogUniform, Uniform
from bayesimpact.inference.priors import Priors
from bayesimpact.model.parameters import Parameter


@dataclass
class Banana:
    """Rosenbrock's residuals 10 (y - x^2), 1 - x (and zeros) in place of an oscillator's.

    Derivatives may have the wrong `sign`, or be off by the relative error `rough` (or, where rough
    ones are asked for, `rougher`).
    """

    sign: float = 1.0
    steep: float = 10.0
    rough: float = 0.0
    rougher: float = 0.0
    sizes = np.array([4.0])
    log_volume = np.array([0.0])
    sigma_columns = np.array([2])
    steps = (0.0,)

    @property
    def oscillator(self):
        parameters = (
            Parameter("x", "", "physical"),
            Parameter("y", "", "physical"),
            Parameter("sigma", "", "noise", 0.0),
        )
        roles = lambda *r: np.array([i for i, p in enumerate(parameters) if p.role in r])  # noqa: E731
        layout = SimpleNamespace(parameters=parameters, roles=roles)
        return SimpleNamespace(layout=layout, campaign=SimpleNamespace(stop=False))

    def __post_init__(self) -> None:
        self.rng = np.random.default_rng(0)
        self.asked: list[bool] = []

    def residuals(self, theta: np.ndarray) -> tuple[np.ndarray, ...]:
        x, y = theta[:, 0], theta[:, 1]
        rest = np.full_like(x, 1e-2)
        return (np.stack([self.steep * (y - x**2), 1 - x, rest, rest], axis=1),)

    def residuals_and_sums(self, theta: np.ndarray) -> tuple[tuple[np.ndarray, ...], np.ndarray]:
        return self.residuals(theta), self.misfit(theta)

    def misfit(self, theta: np.ndarray) -> np.ndarray:
        return np.sum(self.residuals(np.atleast_2d(theta))[0] ** 2, axis=1)[:, None]

    def linearise(
        self, theta: np.ndarray, steps: object = None, *, roughly: bool = False
    ) -> tuple[Linearisation, ...]:
        a = self.steep
        jacobian = np.array([[2 * a * theta[0], -a], [1, 0], [0, 0], [0, 0]], dtype=float)
        error = self.rougher if roughly else self.rough
        jacobian *= self.sign * (1 + error * self.rng.standard_normal((4, 2)))
        self.asked.append(roughly)
        return (Linearisation(self.residuals(theta[None])[0][0], jacobian, np.array([0, 1])),)


def banana(**kind: float) -> PosteriorDensity:
    priors = Priors((Uniform(-9, 9), Uniform(-9, 9), LogUniform(1e-6, 1e6)))
    return PosteriorDensity(Banana(**kind), priors)
