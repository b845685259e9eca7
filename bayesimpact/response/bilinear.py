"""The undamped oscillator with a one-sided linear stop: its backbone in closed form.

Free motion is an arc in the phase plane (velocity scaled by the free frequency), contact an arc of
another circle, about the equilibrium with the stop. The times on both follow from their angles; no
approximation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from bayesimpact.errors import InputError

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
    amplitude : (n,) amplitudes on the free side, m, positive

    Raises
    ------
    InputError : a value outside these ranges. A preloaded stop (g < 0) has no backbone about y = 0.
    """
    free = np.atleast_1d(np.asarray(amplitude, dtype=np.float64))
    for name, value, good in (
        ("mass", mass, mass > 0),
        ("k1", k1, k1 > 0),
        ("k2", k2, k2 >= 0),
        ("g", g, g >= 0),
        ("amplitude", amplitude, bool((free > 0).all())),
    ):
        if not good:
            raise InputError(name, repr(value), "zero or positive (mass, k1, amplitude: positive)")
    w1, w2 = np.sqrt(k1 / mass), np.sqrt((k1 + k2) / mass)
    reach = np.minimum(g / free, 1.0)
    speed = w1 * np.sqrt(free**2 - (reach * free) ** 2)
    # About the equilibrium with the stop the contact starts at distance d, with the speed of touch.
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


def contact_stiffness(mass: float, k1: float, g: float, amplitude: float, above: float) -> float:
    """Stiffness of the stop from one upper half cycle: inverts `upper_frequency`.

    Parameters
    ----------
    mass : kg
    k1 : N/m
    g : gap, m, zero or positive
    amplitude : free-side amplitude, m
    above : time above rest, s

    Returns
    -------
    k2 in N/m; 0 when the half cycle is not shorter than a free one, infinity when it is shorter
    than the flight to the stop and back.
    """
    w1 = np.sqrt(k1 / mass)
    if amplitude <= g or above >= np.pi / w1:
        return 0.0
    if above <= 2 * np.arcsin(g / amplitude) / w1:
        return float("inf")

    def miss(log_ratio: float) -> float:
        k2 = k1 * float(np.exp(log_ratio))
        half = 0.5 / bilinear_backbone(mass, k1, g, k2, amplitude).upper_frequency[0]
        return float(half - above)

    low, high = -25.0, 35.0
    if miss(low) < 0:
        return 0.0
    if miss(high) > 0:
        return float("inf")
    return float(k1 * np.exp(brentq(miss, low, high, xtol=1e-12)))
