"""Simulated recordings for the tests of the response: the paper's rig, and random ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.recording import Recording
from bayesimpact.model.exact.simulate import simulate

PAPER = {"mass": 0.503, "c1": 0.148, "k1": 808.556, "c2": 2.085, "g": 1.1e-3, "k2": 5350.156}


def paper_motion(n: int = 6000, interval: float = 1e-3, **changed: float) -> NDArray[np.float64]:
    """Displacement (n,) of the paper's rig, case 1, released 6.5 mm away from the beam."""
    values = {**PAPER, "y0": -6.5e-3, "v0": 0.0, **changed}
    return simulate(**values, interval=interval, n=n).displacement


@dataclass(frozen=True)
class Rig:
    """A random campaign, its true parameters by name, its size and its noise."""

    campaign: Campaign
    truth: dict[str, float]
    amplitude: float
    noise: float
    stop: bool


def random_rig(seed: int, *, gap: float | None = None, stop: bool = True) -> Rig:
    """A rig unlike the paper's in everything; `gap` is relative to the largest release."""
    rng = np.random.default_rng(seed)

    def between(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    mass, rate, size = between(0.05, 50), between(1.5, 25), between(2e-4, 3e-2)
    k1 = mass * (2 * np.pi * rate) ** 2
    g = size * (rng.uniform(0.02, 0.75) if gap is None else gap)
    c1 = 2 * between(5e-4, 0.03) * np.sqrt(k1 * mass)
    k2 = [k1 * between(0.3, 30) for _ in range(rng.integers(1, 3))]
    c2 = 2 * between(2e-3, 0.2) * np.sqrt((k1 + k2[0]) * mass)
    sampling = float(np.clip(between(24, 200) * rate, 200, 20_000))
    n = int(rng.uniform(8, 40) / rate * sampling)
    noise = size / between(200, 5000)
    releases = [((-1.0, 0.0), (g / size + 0.4, 0.0), (0.1, 0.9), (-0.3, -0.9))[rng.integers(4)]]
    releases = releases[:1] * int(rng.integers(1, 3))
    truth = {"k1": k1, "c1": c1} | ({"c2": c2, "g": g} if stop else {})
    recordings = []
    for case, stiffness in enumerate(k2 if stop else k2[:1]):
        if stop:
            truth[f"k2[{case}]"] = stiffness
        for j, (place, speed) in enumerate(releases):
            name, share = f"r{case}{j}", (1.0, 0.7)[j]
            y0, v0 = place * size * share, speed * size * share * 2 * np.pi * rate
            offset = 0.02 * size * rng.standard_normal()
            contact = {"c2": c2, "g": g, "k2": stiffness} if stop else {}
            motion = simulate(
                mass=mass, c1=c1, k1=k1, y0=y0, v0=v0, interval=1 / sampling, n=n, **contact
            )
            samples = motion.displacement + offset + noise * rng.standard_normal(n)
            recordings.append(Recording(name, str(case), samples, 1 / sampling))
            truth |= {f"y0[{name}]": y0, f"v0[{name}]": v0, f"offset[{name}]": offset}
    return Rig(Campaign("random", mass, tuple(recordings), stop), truth, size, noise, stop)
