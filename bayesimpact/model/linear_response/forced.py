"""Responses of a known motion to small harmonic forces on the mass, by superposition.

The change x of displacement and velocity under a small force f(t) obeys a linear equation along the
motion, whatever laws act on it: x(t) = W(t) Integral W(s)^-1 (0, f(s) / m) ds, where the columns of
W are two independent solutions without the force (variation of parameters: Coddington and Levinson
1955, chapter 3). A law with a state of its own needs more than two: a simulation or two must say
whether the answers serve.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.jit.compiled import compiled
from bayesimpact.model.jit.threads import in_shares
from bayesimpact.model.linear_response.free_changes import POINTS, FreeChanges

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

QUADRATURE = 14  # nodes for a wave times a polynomial over one interval: exact to rounding


def wave_responses(changes: FreeChanges, frequencies: Array) -> Array:
    """Responses (2 F, n) to a sine and a cosine of one newton at every frequency (F,), Hz."""
    angles = 2 * np.pi * changes.interval * frequencies
    weights = _wave_weights(angles) * changes.interval
    parts = changes.stretches
    begins = np.array([part.begin for part in parts])
    ends = np.cumsum([part.readings.shape[0] for part in parts])
    readings = np.concatenate([part.readings for part in parts])
    impulses, carried = np.concatenate(changes.impulses), changes.carried
    out = np.empty((2 * frequencies.size, changes.points))

    def run(low: int, high: int) -> None:
        _superpose(
            readings, impulses, begins, ends, carried, changes.direct, angles[low:high],
            weights[:, low:high], out[2 * low : 2 * high],
        )  # fmt: skip

    in_shares(run, frequencies.size)
    return out


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
def _superpose(
    readings: Any, impulses: Any, begins: Any, ends: Any, carried: Any, direct: Any, angles: Any,
    weights: Any, out: Any,
) -> None:  # fmt: skip
    """Fill in `out` (2 F, n), stretch by stretch: rows begin..end of `readings` and `impulses`."""
    points = weights.shape[2]
    for f in range(angles.size):
        step = complex(np.cos(angles[f]), np.sin(angles[f]))
        one = other = complex(0.0, 0.0)  # what the wave has made of both changes so far
        for part in range(begins.size):
            first, begin = (0 if part == 0 else ends[part - 1]), begins[part]
            c = carried[part]
            one, other = c[0, 0] * one + c[0, 1] * other, c[1, 0] * one + c[1, 1] * other
            wave = complex(np.cos(begin * angles[f]), np.sin(begin * angles[f]))
            n = ends[part] - first
            for i in range(n):
                row = first + i
                response = readings[row, 0] * one + readings[row, 1] * other + direct * wave
                out[2 * f, begin + i] = response.imag
                out[2 * f + 1, begin + i] = response.real
                if i + 1 < n:
                    left = min(max(i + 1 - points // 2, 0), n - points)
                    for j in range(points):
                        impulse = wave * weights[i - left, f, j]
                        one += impulse * impulses[first + left + j, 0]
                        other += impulse * impulses[first + left + j, 1]
                wave *= step
