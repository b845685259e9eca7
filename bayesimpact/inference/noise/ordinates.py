"""Level and colour of AR(1) noise from a periodogram (Whittle 1953)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

Array = NDArray[np.float64]

BEND = 0.01  # step in the correlation for the curvature of the likelihood


@dataclass(frozen=True, eq=False)
class Ordinates:
    """Periodograms where they are noise.

    Attributes
    ----------
    angle : (n,) angular frequencies per sample
    power : (n,) ordinates, m2
    passed : (n,) power that the filter let pass
    rounding : its variance over that of the noise; white, whatever the noise is
    """

    angle: Array
    power: Array
    passed: Array
    rounding: float

    def _shape(self, rho: float) -> Array:
        raw = (1 - rho**2) / (1 - 2 * rho * np.cos(self.angle) + rho**2)
        return np.asarray(self.passed * raw + self.rounding)

    def variance(self, rho: float) -> float:
        """Of the raw noise, m2, at a given correlation."""
        return float(np.mean(self.power / self._shape(rho)))

    def cost(self, rho: float) -> float:
        """Minus the log likelihood of a correlation at its best variance, nats."""
        log_variances = self.power.size * np.log(self.variance(rho))
        return float(np.sum(np.log(self._shape(rho))) + log_variances)

    def correlation(self) -> float:
        """The likeliest one."""
        return float(minimize_scalar(self.cost, bounds=(-0.6, 0.99), method="bounded").x)

    def errors(self, rho: float) -> tuple[float, float]:
        """Standard error of the correlation and, relative, of the level that goes with it."""
        step = min(BEND, 0.5 * (1.0 - abs(rho)))
        low, high = rho - step, rho + step
        bend = self.cost(low) + self.cost(high) - 2 * self.cost(rho)
        error = float(step / np.sqrt(max(bend, step**2)))
        lean = 0.25 * np.log(self.variance(high) / self.variance(low)) / step
        return error, float(np.hypot(np.sqrt(0.5 / self.power.size), error * lean))
