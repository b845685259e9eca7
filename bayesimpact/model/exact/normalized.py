"""The parameters of one recording: named, checked, and counted in sampling intervals.

q = (c1, k1, c2, g, k2, y0, v0, A, w, phase, offset) in SI units, t = 0 at the first sample.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.jit.compiled import compiled

Floats = NDArray[np.float64]

#: The unknowns of one recording, in this order everywhere.
Q = ("c1", "k1", "c2", "g", "k2", "y0", "v0", "A", "w", "phase", "offset")
C1, K1, C2, G, K2, Y0, V0, A, W, PHASE, OFFSET = range(11)

# Codes of a simulation: what they mean is said in `simulate.CODES`.
OK = 0
NOT_FINITE = 1
BAD_MASS = 2
BAD_STIFFNESS = 3
BAD_DAMPING = 4
BAD_CONTACT = 5
BAD_GAP = 6
BAD_FREQUENCY = 7
BAD_SAMPLING = 8
TOO_MANY_EVENTS = 9
SEARCH_FAILED = 10
OVERFLOW = 11


class NormalizedParameters(NamedTuple):
    """Rates per sampling interval: b = c / (2 m) and K = k / m of both regimes, the rest of
    contact, m, the gap and the offset, m, and the force per mass: force sin(w t + phase).
    """

    b_flight: float
    K_flight: float
    b_contact: float
    K_contact: float
    rest: float
    gap: float
    offset: float
    w: float
    force: float
    phase: float


@compiled()
def check(q: Floats, mass: float, interval: float, n: int) -> int:
    """Return OK or the code of the first thing wrong with a recording of n samples."""
    for i in range(11):
        if i != G and not math.isfinite(q[i]):
            return NOT_FINITE
    if not (math.isfinite(mass) and mass > 0.0):
        return BAD_MASS
    if not q[K1] > 0.0:
        return BAD_STIFFNESS
    if q[C1] < 0.0:
        return BAD_DAMPING
    if q[C2] < 0.0 or q[K2] < 0.0:
        return BAD_CONTACT
    if math.isnan(q[G]) or q[G] == -math.inf:
        return BAD_GAP
    if q[W] < 0.0:
        return BAD_FREQUENCY
    if not (math.isfinite(interval) and interval > 0.0 and n > 0):
        return BAD_SAMPLING
    return OK


@compiled()
def scale(q: Floats, mass: float, interval: float) -> NormalizedParameters:
    """Count time in sampling intervals."""
    per_mass = interval * interval / mass
    half = 0.5 * interval / mass
    stiffness = q[K1] + q[K2]
    return NormalizedParameters(
        half * q[C1],
        per_mass * q[K1],
        half * (q[C1] + q[C2]),
        per_mass * stiffness,
        q[K2] * q[G] / stiffness if q[G] < math.inf else 0.0,
        q[G],
        q[OFFSET],
        q[W] * interval,
        q[A] * per_mass,
        q[PHASE],
    )


@compiled()
def has_stop(q: Floats) -> bool:
    """Say whether there is anything to hit."""
    gap: float = q[G]
    return gap < math.inf and (q[C2] > 0.0 or q[K2] > 0.0)


@compiled()
def begins_in_contact(q: Floats) -> bool:
    """Say whether motion begins in contact: beyond the stop, or at it and heading into it."""
    if not has_stop(q):
        return False
    above: float = q[Y0] - q[G]
    if above == 0.0:
        above = q[V0]
    if above == 0.0:
        above = q[A] * math.sin(q[PHASE]) - q[K1] * q[G]
    return above > 0.0
