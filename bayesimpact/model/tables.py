"""The motion of one regime at every multiple of the sampling interval, computed once and used for
all.

Row 0 to 3 of a table hold S, D, E and F of `flow` at t = 0, 1, ..., LENGTH sampling intervals (E
and F only with forcing). Every sample between two events is then a product of the table and the
state at the first of them: no sample waits for the one before it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.compiled import compiled
from bayesimpact.model.flow import forced_response, impulse_response

#: Samples that one table serves; a longer stretch is cut into blocks of this length.
LENGTH = 128
ROWS = 4


@compiled(error_model="numpy")
def fill(table: NDArray[np.float64], b: float, K: float, w: float, forced: bool) -> None:
    """Fill `table` (ROWS, LENGTH + 1) for one regime; b, K and w per sampling interval.

    Exact values at 1, 2, 4, ..., then every stretch [a, 2 a) from [0, a) by the addition theorem,
    so that rounding grows with the logarithm of the index only.
    """
    S, D, E, F = table[0], table[1], table[2], table[3]
    S[0], D[0], E[0], F[0] = 0.0, 1.0, 0.0, 0.0
    a = 1
    while a <= LENGTH:
        Sa, Da = impulse_response(b, K, float(a))
        Ca = Da + 2.0 * b * Sa
        KSa = K * Sa
        count = min(a, LENGTH + 1 - a)
        if forced:
            Ea, Fa = forced_response(b, K, w, float(a), Sa, Da)
            cos = math.cos(w * a)
            sin = math.sin(w * a)
            from_E = Sa - w * Fa + 2.0 * b * Ea
            from_F = w * Ea + 2.0 * b * Fa
            for j in range(count):
                E[a + j] = Ea * D[j] + from_E * S[j] + cos * E[j] - sin * F[j]
                F[a + j] = Fa * D[j] + from_F * S[j] + sin * E[j] + cos * F[j]
        for j in range(count):
            S[a + j] = Sa * D[j] + Ca * S[j]
            D[a + j] = Da * D[j] - KSa * S[j]
        a *= 2
