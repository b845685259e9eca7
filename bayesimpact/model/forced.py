"""Small harmonic forces on a known motion: the responses at many frequencies from one transition.

The change x of displacement and velocity under a small force f(t) on the mass obeys a linear
equation along the motion, whatever laws act on it: x(t) = W(t) Integral W(s)^-1 (0, f(s) / m) ds,
where the columns of W are two independent solutions without the force (variation of parameters:
Coddington and Levinson 1955, chapter 3). They are differences of simulated motions, so they carry
contacts, too, jumps at the touch included. As they decay they drown in rounding: others take over,
stretch by stretch.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.compiled import compiled
from bayesimpact.model.threads import in_shares

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

POINTS = 6  # samples between which a response to pushes is interpolated
QUADRATURE = 14  # nodes for a wave times a polynomial over one interval: exact to rounding


@dataclass(frozen=True, eq=False)
class Stretch:
    """Two independent free changes of a motion over a part of a recording.

    Attributes
    ----------
    begin : its first sample; the last one is the next stretch's first
    states : (n, 2, 2) displacement and velocity (middle axis) of both changes
    readings : (n, 2) what the recording reads of both
    """

    begin: int
    states: Array
    readings: Array


def wave_responses(
    stretches: Sequence[Stretch], mass: float, interval: float, order: int, frequencies: Array
) -> Array:
    """Responses (2 F, n) to a sine and a cosine of one newton at every frequency (F,), Hz.

    Parameters
    ----------
    stretches : of the whole recording, each of `POINTS` samples or more
    mass, interval : kg, s
    order : which time derivative of the displacement is read
    """
    angles = 2 * np.pi * interval * frequencies
    weights = _weights(angles) * interval
    direct = 1 / mass if order == 2 else 0.0  # an acceleration holds the force itself
    size = stretches[-1].begin + stretches[-1].readings.shape[0]
    out = np.empty((2 * frequencies.size, size))
    changes = np.zeros((frequencies.size, 2), dtype=np.complex128)
    for last, stretch in zip([None, *stretches[:-1]], stretches, strict=True):
        if last is not None:
            changes = changes @ np.linalg.solve(stretch.states[0], last.states[-1]).T
        pushes = np.linalg.solve(stretch.states, np.array([[0.0], [1 / mass]]))[..., 0]
        _superpose(stretch, pushes, direct, angles, weights, changes, out)
    return out


def _superpose(
    stretch: Stretch, pushes: Array, direct: float, angles: Array, weights: Complex,
    changes: Complex, out: Array,
) -> None:  # fmt: skip
    """Fill in the stretch's part of `out` (2 F, n); `changes` (F, 2) go on to its end."""
    first = stretch.begin
    part = out[:, first : first + stretch.readings.shape[0]]

    def run(low: int, high: int) -> None:
        _accumulate(
            stretch.readings, pushes, direct, angles[low:high], weights[:, low:high], first,
            changes[low:high], part[2 * low : 2 * high],
        )  # fmt: skip

    in_shares(run, angles.size)


def _weights(angles: Array) -> Complex:
    """Integrals (P - 1, F, P) of exp(i angle x) over 0 < x < 1 times Lagrange polynomials.

    Those on P neighbouring whole numbers that begin at 0, -1, ... and hold 0 and 1.
    """
    x, w = np.polynomial.legendre.leggauss(QUADRATURE)
    x, w = 0.5 * (x + 1), 0.5 * w
    waves = np.exp(1j * angles[:, None] * x) * w
    points = np.arange(float(POINTS))
    own = np.eye(POINTS, dtype=bool)
    found = []
    for first in range(POINTS - 1):
        factors = (x[:, None, None] + first - points) / np.where(own, 1.0, points[:, None] - points)
        found.append(waves @ np.where(own, 1.0, factors).prod(axis=-1))
    return np.array(found)


@compiled(nogil=True)
def _accumulate(
    readings: Any, pushes: Any, direct: Any, angles: Any, weights: Any, begin: Any, changes: Any,
    out: Any,
) -> None:  # fmt: skip
    """One stretch: `changes` (F, 2), what the waves have made of both so far, go on."""
    n, points = readings.shape[0], weights.shape[2]
    for f in range(angles.size):
        step = complex(np.cos(angles[f]), np.sin(angles[f]))
        wave = complex(np.cos(begin * angles[f]), np.sin(begin * angles[f]))
        one, other = changes[f, 0], changes[f, 1]
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
        changes[f, 0], changes[f, 1] = one, other
