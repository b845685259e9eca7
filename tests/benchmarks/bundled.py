"""What the benchmarks on data/paper share: its fit, and one recording as the solvers see it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.read import load_campaign
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import identify
from bayesimpact.model.exact.simulate import trajectory
from bayesimpact.model.parameters import BASE_SLOTS

PAPER = Path(__file__).resolve().parents[2] / "data" / "paper"

Array = NDArray[np.float64]


@cache
def fit() -> Fit:
    """The mode of the bundled campaign."""
    return identify(load_campaign(PAPER), rng=np.random.default_rng(0), search=False).fit


@dataclass(frozen=True, eq=False)
class Problem:
    """One recording to simulate: y'' = push - damping y' - stiffness y, by regime.

    Attributes
    ----------
    q : (11,) parameters in the order of `bayesimpact.model.exact.simulate.Q`, SI units, not forced
    mass : kg
    interval : s
    n : samples
    """

    q: Array
    mass: float
    interval: float
    n: int

    def regime(self, contact: bool) -> tuple[float, float, float]:
        """Damping, 1/s, stiffness, 1/s2, and push, m/s2."""
        c1, k1, c2, g, k2 = (float(value) / self.mass for value in self.q[:5])
        if contact:
            return c1 + c2, k1 + k2, k2 * g * self.mass
        return c1, k1, 0.0

    @property
    def gap(self) -> float:
        """Where the stop is, m."""
        return float(self.q[3])

    @property
    def start(self) -> tuple[float, float]:
        """Displacement, m, and velocity, m/s, of the first sample."""
        return float(self.q[5]), float(self.q[6])

    @property
    def times(self) -> Array:
        """Of the samples, (n,), s."""
        return np.arange(self.n) * self.interval

    @property
    def scale(self) -> Array:
        """Sizes of displacement and velocity, (2,), m, m/s: what absolute tolerances refer to."""
        size = abs(self.start[0])
        return np.array([size, size * np.sqrt(self.q[1] / self.mass)])

    def exact(self) -> Array:
        """Displacement, (n,), m, by our simulator."""
        out = np.empty(self.n)
        assert trajectory(self.q, self.mass, self.interval, out) == 0
        return out


def problem(recording: int = 0) -> Problem:
    """One recording of the bundled campaign at the mode."""
    found = fit()
    oscillator = found.density.oscillator
    q = oscillator.layout.slots(found.mode[None])[0, recording, : len(BASE_SLOTS)]
    interval, n = oscillator.intervals[recording], oscillator.counts[recording]
    return Problem(np.ascontiguousarray(q), oscillator.campaign.mass, float(interval), int(n))
