"""How a recording starts: displacement and velocity at its first sample."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesimpact.errors import SimulationError
from bayesimpact.model.exact.simulate import simulate
from bayesimpact.response.squares import least

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class RoughOscillator:
    """Rough parameters of the impact oscillator, SI; `g` infinite without a stop."""

    mass: float
    c1: float
    k1: float
    c2: float
    g: float
    k2: float


def release(
    signal: Floats, interval: float, oscillator: RoughOscillator, noise: float
) -> tuple[float, float, float, float]:
    """Displacement and velocity at the first sample.

    Up to the first contact, or the first release from the stop, the motion is linear in y0 and v0;
    both follow from a linear least-squares fit over these samples. Where the first event comes too
    soon for that, the first free period is simulated through its impacts and fitted.

    Parameters
    ----------
    signal : (n,) samples less the rest reading, m
    interval : s
    oscillator : rough parameters
    noise : standard deviation of the noise, m, positive

    Returns
    -------
    y0 in m, v0 in m/s and their standard errors.
    """
    o = oscillator
    period = 2 * np.pi * float(np.sqrt(o.mass / o.k1)) / interval
    inside = bool(signal[:3].mean() > o.g)
    c, k, centre = o.c1, o.k1, 0.0
    if inside:
        c, k, centre = o.c1 + o.c2, o.k1 + o.k2, o.k2 * o.g / (o.k1 + o.k2)
    run = signal[: max(int(np.pi * np.sqrt(o.mass / k) / interval), 6)]
    left = np.flatnonzero((run < o.g + 2 * noise) if inside else (run > o.g - 2 * noise))
    count = int(left[0]) if left.size else run.size
    t = np.arange(max(count, 4)) * interval
    b = c / (2 * o.mass)
    root = np.sqrt(complex(k / o.mass - b**2)) + 1e-12
    one, other = np.exp((1j * root - b) * t), np.exp((-1j * root - b) * t)  # both decay
    cosine, sine = ((one + other) / 2).real, ((one - other) / (2j * root)).real
    basis = np.stack([cosine + b * sine, sine], axis=1)
    start = _linear(basis, signal[: t.size] - centre, noise, centre)
    if count >= max(6, period / 4):
        return start
    return _simulated(signal[: int(period) + 2], interval, o, noise, start)


def _linear(
    basis: Floats, values: Floats, noise: float, centre: float
) -> tuple[float, float, float, float]:
    scale = np.sqrt((basis**2).sum(axis=0))
    inverse = np.linalg.pinv(basis / scale)
    x = inverse @ values / scale
    sd = noise * np.sqrt((inverse**2).sum(axis=1)) / scale
    return float(x[0] + centre), float(x[1]), float(sd[0]), float(sd[1])


def _simulated(
    signal: Floats,
    interval: float,
    o: RoughOscillator,
    noise: float,
    start: tuple[float, float, float, float],
) -> tuple[float, float, float, float]:
    """Fit y0 and v0 to the first period by simulation, from several velocities."""
    size, rate = float(np.abs(signal).max()), float(np.sqrt(o.k1 / o.mass))

    def misfit(x: Floats) -> Floats:
        y0, v0 = float(x[0]) * size, float(x[1]) * size * rate
        try:
            motion = simulate(
                mass=o.mass, c1=o.c1, k1=o.k1, c2=o.c2, g=o.g, k2=o.k2,
                y0=y0, v0=v0, interval=interval, n=signal.size,
            )  # fmt: skip
        except SimulationError:
            return np.full(signal.size, 1e3)
        return np.asarray((motion.displacement - signal) / size)

    speeds = (start[1] / rate, 0.0, 0.7 * size, -0.7 * size)
    best = least(
        misfit,
        [[signal[0] / size, speed / size] for speed in speeds],
        scale=1.0,
        favour=0.5,
        evaluations=25,
    )
    level = max(noise / size, float(np.sqrt(2 * best.cost / signal.size)))
    y0, v0 = best.x * size
    sd_y0, sd_v0 = best.standard_errors(level**2) * size
    return float(y0), float(v0) * rate, float(sd_y0), float(sd_v0) * rate
