"""The undamped oscillator with a one-sided linear stop: its backbone in closed form.

Free motion is an arc in the phase plane (velocity scaled by the free frequency), contact an arc of
another circle, about the equilibrium with the stop. The times on both follow from their angles; no
approximation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BilinearBackbone:
    """Exact backbone of m y'' + k1 y + k2 (y - g) H(y - g) = 0.

    Attributes
    ----------
    amplitude : (n,) largest distance from rest on the free side, m
    upper_amplitude : (n,) largest distance on the side of the stop, m
    frequency : (n,) of the whole cycle, Hz
    upper_frequency : (n,) 1 / (2 x time above rest), Hz; what "half" extracts for the upper side
    lower_frequency : free frequency, Hz; what "half" extracts for the lower side
    """

    amplitude: Floats
    upper_amplitude: Floats
    frequency: Floats
    upper_frequency: Floats
    lower_frequency: float


def bilinear_backbone(
    mass: float, k1: float, g: float, k2: float, amplitude: ArrayLike
) -> BilinearBackbone:
    """Exact backbone of the undamped impact oscillator (Shaw and Holmes 1983, piecewise arcs).

    Parameters
    ----------
    mass : kg
    k1, k2 : N/m, k1 > 0, k2 >= 0
    g : gap, m, zero or positive
    amplitude : (n,) amplitudes on the free side, m, positive. A preloaded stop (g < 0) has no
        backbone about y = 0
    """
    free = np.atleast_1d(np.asarray(amplitude, dtype=np.float64))
    w1, w2 = np.sqrt(k1 / mass), np.sqrt((k1 + k2) / mass)
    reach = np.minimum(g / free, 1.0)
    speed = w1 * np.sqrt(free**2 - (reach * free) ** 2)
    # About the equilibrium with the stop contact begins at distance d, with the speed of its onset.
    d = g * k1 / (k1 + k2)
    radius = np.hypot(d, speed / w2)
    touching = free > g
    contact = np.where(touching, 2 / w2 * np.arctan2(speed / w2, d), 0.0)
    above = np.where(touching, 2 * np.arcsin(reach) / w1 + contact, np.pi / w1)
    upper = np.where(touching, g - d + radius, free)
    return BilinearBackbone(
        amplitude=free,
        upper_amplitude=upper,
        frequency=1 / (np.pi / w1 + above),
        upper_frequency=1 / (2 * above),
        lower_frequency=float(w1 / (2 * np.pi)),
    )
