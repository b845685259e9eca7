"""Random oscillators for the tests: every regime, every start, with and without forcing."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class System:
    """One recording to simulate; q as in the package, SI units."""

    q: np.ndarray
    mass: float
    interval: float
    n: int

    @property
    def arguments(self):
        """Keyword arguments of `simulate`."""
        names = ("c1", "k1", "c2", "g", "k2", "y0", "v0", "A", "w", "phase")
        named = dict(zip(names, (float(x) for x in self.q), strict=False))
        return {**named, "mass": self.mass, "interval": self.interval, "n": self.n}


def draw(rng: np.random.Generator, n: int = 60) -> System:
    """Draw a system: about a dozen periods at most, from 3 to 200 samples per period."""
    mass = 10 ** rng.uniform(-1, 1)
    w1 = 2 * math.pi * 10 ** rng.uniform(0, 1.3)
    k1 = mass * w1 * w1
    critical = 2 * math.sqrt(k1 * mass)
    kind = rng.random()
    if kind < 0.12:
        c1 = 0.0
    elif kind < 0.24:
        c1 = critical * 10 ** rng.uniform(-1, 0.5)
    elif kind < 0.3:
        c1 = critical * (1 + rng.choice([0, 1e-15, -1e-12, 1e-7, -1e-4]))
    else:
        c1 = critical * 10 ** rng.uniform(-4, -1)
    k2 = k1 * 10 ** rng.uniform(-1, 3) if rng.random() < 0.92 else 0.0
    c2 = 2 * math.sqrt((k1 + k2) * mass) * 10 ** rng.uniform(-3, 0.7)
    if rng.random() < 0.1 and k2 > 0:
        c2 = 0.0
    scale = 10 ** rng.uniform(-4, -1)
    kind = rng.random()
    if kind < 0.06:
        g = math.inf
    elif kind < 0.12:
        g = 0.0
    else:
        g = scale * rng.uniform(0, 0.9) * (1 if kind < 0.85 else -1)
    angle = rng.uniform(0, 2 * math.pi)
    y0, v0 = scale * math.cos(angle), scale * w1 * math.sin(angle)
    if rng.random() < 0.1:
        v0 = 0.0
    if rng.random() < 0.04 and g < math.inf:
        y0 = g
    A = w = phase = 0.0
    if rng.random() < 0.4:
        A = k1 * scale * 10 ** rng.uniform(-2, 0.3)
        w = w1 * 10 ** rng.uniform(-1, 0.7)
        if rng.random() < 0.2:
            w = w1 * (1 + rng.choice([0.0, 1e-12, -1e-8, 1e-5]))
        phase = rng.uniform(0, 2 * math.pi)
    interval = 2 * math.pi / w1 / 10 ** rng.uniform(0.5, 2.3)
    return System(np.array([c1, k1, c2, g, k2, y0, v0, A, w, phase, 0.0]), mass, interval, n)


def draw_fine(rng: np.random.Generator) -> System:
    """Draw an unforced system, so finely sampled that return times are predicted; 12 periods."""
    coarse = draw(rng)
    q, mass = coarse.q, coarse.mass
    q[7:10] = 0.0
    K_flight, K_contact = q[1] / mass, (q[1] + q[4]) / mass
    fastest = max(math.sqrt(K_flight) + q[0] / mass, math.sqrt(K_contact) + (q[0] + q[2]) / mass)
    interval = rng.uniform(0.02, 0.24) / fastest
    periods = 12 * 2 * math.pi / math.sqrt(K_flight) / interval
    return System(q, mass, interval, 1 + EVERY * min(max(1, int(periods / EVERY)), 100))


#: The recordings of `draw_fine` have a multiple of this many intervals.
EVERY = 30
