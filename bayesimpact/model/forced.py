"""Responses of a known motion to small harmonic forces on the mass, by superposition.

The change x of displacement and velocity under a small force f(t) obeys a linear equation along the
motion, whatever laws act on it: x(t) = W(t) Integral W(s)^-1 (0, f(s) / m) ds, where the columns of
W are two independent solutions without the force (variation of parameters: Coddington and Levinson
1955, chapter 3). A law with a state of its own needs more than two, and a mass that sticks has
none: a simulation or two must say whether the answers serve.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.compiled import compiled
from bayesimpact.model.free_changes import POINTS, FreeChanges, Stretch
from bayesimpact.model.threads import in_shares

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

QUADRATURE = 14  # nodes for a wave times a polynomial over one interval: exact to rounding


def wave_responses(changes: FreeChanges, frequencies: Array) -> Array:
    """Responses (2 F, n) to a sine and a cosine of one newton at every frequency (F,), Hz.

    Raises
    ------
    LinAlgError : the mass sticks
    """
    angles = 2 * np.pi * changes.interval * frequencies
    weights = _wave_weights(angles) * changes.interval
    out = np.empty((2 * frequencies.size, changes.samples))
    sizes = np.zeros((frequencies.size, 2), dtype=np.complex128)
    for stretch in changes.stretches:
        sizes = sizes @ changes.carried(stretch).T
        _superpose(stretch, changes, angles, weights, sizes, out)
    return out


def _superpose(
    stretch: Stretch, changes: FreeChanges, angles: Array, weights: Complex, sizes: Complex,
    out: Array,
) -> None:  # fmt: skip
    """Fill in the stretch's part of `out` (2 F, n); `sizes` (F, 2) go on to its end."""
    first, pushes = stretch.begin, changes.pushes(stretch)
    part = out[:, first : first + stretch.readings.shape[0]]

    def run(low: int, high: int) -> None:
        _accumulate(
            stretch.readings, pushes, changes.direct, angles[low:high], weights[:, low:high], first,
            sizes[low:high], part[2 * low : 2 * high],
        )  # fmt: skip

    in_shares(run, angles.size)


def _wave_weights(angles: Array) -> Complex:
    """Integrals (POINTS - 1, F, POINTS) over 0 < x < 1 of exp(i angle x) times polynomials.

    Those of Lagrange on neighbouring whole numbers that begin at 0, -1, ... and hold 0 and 1.
    """
    x, w = np.polynomial.legendre.leggauss(QUADRATURE)
    x, w = 0.5 * (x + 1), 0.5 * w
    waves = np.exp(1j * angles[:, None] * x) * w
    return np.array([waves @ _lagrange(x + first) for first in range(POINTS - 1)])


def _lagrange(x: Array) -> Array:
    """Lagrange polynomials (n, POINTS) on 0, 1, ... at x (n,)."""
    points = np.arange(float(POINTS))
    own = np.eye(POINTS, dtype=bool)
    factors = (x[:, None, None] - points) / np.where(own, 1.0, points[:, None] - points)
    return np.asarray(np.where(own, 1.0, factors).prod(axis=-1))


@compiled(nogil=True)
def _accumulate(
    readings: Any, pushes: Any, direct: Any, angles: Any, weights: Any, begin: Any, sizes: Any,
    out: Any,
) -> None:  # fmt: skip
    """One stretch: `sizes` (F, 2), what the waves have made of both changes so far, go on."""
    n, points = readings.shape[0], weights.shape[2]
    for f in range(angles.size):
        step = complex(np.cos(angles[f]), np.sin(angles[f]))
        wave = complex(np.cos(begin * angles[f]), np.sin(begin * angles[f]))
        one, other = sizes[f, 0], sizes[f, 1]
        for i in range(n):
            response = readings[i, 0] * one + readings[i, 1] * other + direct * wave
            out[2 * f, i] = response.imag
            out[2 * f + 1, i] = response.real
            if i + 1 < n:
                first = min(max(i + 1 - points // 2, 0), n - points)
                for j in range(points):
                    part = wave * weights[i - first, f, j]
                    one += part * pushes[first + j, 0]
                    other += part * pushes[first + j, 1]
            wave *= step
        sizes[f, 0], sizes[f, 1] = one, other
