"""The equation of motion in weak form: integrals over short stretches of a recording.

The equation is multiplied by a smooth bump phi that vanishes outside a short stretch, integrated
over it, and the derivatives are moved onto the bump by parts (modulating functions: Shinbrot 1957,
Trans. ASME 79:1579):

    int m phi'' y - c1 phi' y + k1 phi y + k2 phi w - c2 phi' w = int phi u,     w = max(y - g, 0)

for (y - g)' = w' in contact. So no reading is differentiated, and every stretch is one linear
equation for damping, stiffnesses and the sizes of any other force along the measured motion. A
velocity or an acceleration obeys the equation differentiated once or twice, of which the forces on
the right and of the stop take as many derivatives more of the bump.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.recording import Recording

Floats = NDArray[np.float64]

POWER = 6  # of the bump (1 - x^2)^POWER: smooth enough for sums over samples to be integrals
LEAST_HALF = 4  # samples


@dataclass(frozen=True, eq=False)
class Rows:
    """Stretches of one recording: weights on samples, and products that do not depend on the gap.

    phi, slope, bend, third : (w,) weights of int phi x, int -phi' x, int phi'' x and the next
    base : (n, 4) int phi y, -int phi' y, int phi u, int phi; zero where a sample is set aside; of a
        derivative of the displacement y is that, and u differentiated as often
    target : (n,) -int m phi'' y
    order : of that derivative
    hop : samples from one stretch to the next
    """

    phi: Floats
    slope: Floats
    bend: Floats
    third: Floats
    base: Floats
    target: Floats
    order: int
    hop: int

    @property
    def kept(self) -> NDArray[np.bool_]:
        """(n,) False where a sample of the stretch is set aside."""
        return np.asarray(self.base[:, 3] != 0.0)

    def of_force(self, x: Floats) -> Floats:
        """Int phi x and int phi x' of a force (samples,), differentiated with the readings: (n, 2).

        0 in what is set aside.
        """
        weights = (self.phi, self.slope, self.bend, self.third)[self.order : self.order + 2]
        return np.asarray(products(x, self.hop, *weights) * self.kept[:, None])

    def integrals(self, x: Floats) -> Floats:
        """Int phi x of forces (..., samples) along the motion, differentiated with the readings,
        (..., n); 0 in what is set aside.
        """
        weights = (self.phi, self.slope, self.bend)[self.order]
        found = np.stack([products(one, self.hop, weights)[:, 0] for one in np.atleast_2d(x)])
        return np.asarray(np.where(self.kept, found, 0.0).reshape(*x.shape[:-1], -1))


def bump(half: int) -> tuple[Floats, Floats, Floats, Floats]:
    """phi and its first three derivatives at 2 half + 1 samples, the sample as unit of time."""
    x = np.linspace(-1.0, 1.0, 2 * half + 1)
    inside = 1.0 - x * x
    phi = inside**POWER
    slope = -2.0 * POWER * x * inside ** (POWER - 1) / half
    bend = 4.0 * POWER * (POWER - 1) * x * x * inside ** (POWER - 2)
    bend = (bend - 2.0 * POWER * inside ** (POWER - 1)) / half**2
    third = 12.0 * POWER * (POWER - 1) * x * inside ** (POWER - 2)
    third -= 8.0 * POWER * (POWER - 1) * (POWER - 2) * x**3 * inside ** (POWER - 3)
    return phi, slope, bend, third / half**3


def rows_of(recording: Recording, mass: float, width: float) -> Rows:
    """Stretches of a recording, half a bump of half width `width`, s, apart."""
    dt, most = recording.interval, (recording.samples.size - 1) // 4
    half = max(min(round(width / dt), most), min(LEAST_HALF, most))
    phi, slope, bend, third = bump(half)
    weights = (phi * dt, -slope, bend / dt, -third / dt**2)
    phi, slope, bend, third = weights
    hop = max(1, half // 2)
    y = products(recording.samples, hop, phi, slope, bend)
    drive = np.zeros(y.shape[0])
    if recording.input is not None:
        held, force = weights[recording.order], recording.input.shown(mass, dt)
        if recording.order == 0:
            # of a line between samples, to second order: the triangle's variance is dt^2 / 6
            held, force = phi + dt * dt * bend / 12.0, recording.input.force(mass, dt)
        drive = products(force, hop, held)[:, 0]
    whole = np.full(drive.size, phi.sum())
    kept = np.ones(drive.size, dtype=bool)
    if recording.used is not None:
        kept = products(np.where(recording.used, 0.0, 1.0), hop, np.ones(phi.size))[:, 0] == 0.0
    weight = np.where(kept, 1.0, 0.0)
    base = np.column_stack([y[:, 0], y[:, 1], drive, whole]) * weight[:, None]
    return Rows(*weights, base, -mass * y[:, 2] * weight, recording.order, hop)


def products(x: Floats, hop: int, *weights: Floats) -> Floats:
    """Sums of weights (w,) times x over windows that start `hop` samples apart, (n, weights)."""
    windows = np.lib.stride_tricks.sliding_window_view(x, weights[0].size)[::hop]
    return np.asarray(windows @ np.column_stack(weights))


def least_squares(matrix: Floats, right: Floats) -> tuple[Floats, float]:
    """Solution, 0 where a column is, and the mean square of what is left."""
    size = np.sqrt(np.sum(matrix**2, axis=0))
    scaled = matrix / np.where(size > 0.0, size, 1.0)
    gram = scaled.T @ scaled
    solution = np.linalg.pinv(gram, rcond=1e-12, hermitian=True) @ (scaled.T @ right)
    left = right - scaled @ solution
    return np.where(size > 0.0, solution / np.where(size > 0.0, size, 1.0), 0.0), float(left @ left)
