"""What is computed once per regime: its motion at every sample, and close to any time.

Time is counted in sampling intervals. Row 0 to 3 of a table hold S, D, E and F of `flow` at 0, 1,
..., LENGTH (E and F only with forcing): every sample between two events is then a product of the
table and the state at the first of them, and no sample waits for the one before it. The series hold
the Taylor coefficients of S and D at 0: with them and the table, motion of slow regimes is known at
any time without exp, sin or cos.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.exact.flow import forced_response, impulse_response
from bayesimpact.model.jit.compiled import compiled, inner

Floats = NDArray[np.float64]

#: Samples that one table serves; a longer stretch is cut into blocks of this length.
LENGTH = 128
ROWS = 4
#: Coefficients of S / t and D; at |t| <= 1 and rates sqrt(K) + 2 b below SLOW the rest is < 1e-17.
TERMS = 13
#: Key, in place of a frequency, of a table without E and F.
UNFORCED = -1.0
SLOW = 0.25


class ResponseTables(NamedTuple):
    """What is kept from recording to recording, for flight and contact.

    tables (2, ROWS, LENGTH + 1), series (2, 2, TERMS) : of the regimes last met
    keys (2, 3) : their b, K and w
    history (2, 5) : how long the regimes lasted (`return_time_prediction`)
    """

    tables: Floats
    series: Floats
    keys: Floats
    history: Floats


@compiled()
def response_tables() -> ResponseTables:
    """Return empty tables."""
    return ResponseTables(
        np.empty((2, ROWS, LENGTH + 1)),
        np.empty((2, 2, TERMS)),
        np.full((2, 3), np.nan),
        np.empty((2, 5)),
    )


@compiled()
def prepare(
    response_tables: ResponseTables, side: int, b: float, K: float, w: float, forced: bool
) -> None:
    """Fill the tables and series of one regime, unless they hold it already."""
    keys = response_tables.keys
    force = w if forced else UNFORCED
    if keys[side, 0] != b or keys[side, 1] != K or keys[side, 2] != force:
        fill(response_tables.tables[side], b, K, w, forced)
        fill_series(response_tables.series[side], b, K)
        keys[side, 0], keys[side, 1], keys[side, 2] = b, K, force


@compiled()
def fill(table: Floats, b: float, K: float, w: float, forced: bool) -> None:
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


@inner()
def fill_series(series: Floats, b: float, K: float) -> None:
    """Fill `series` (2, TERMS): S = t sum(series[0, n] t^n), D = sum(series[1, n] t^n)."""
    S, D = series[0], series[1]
    before, now = 0.0, 1.0  # Taylor coefficients n and n + 1 of S
    for n in range(TERMS):
        S[n] = now
        D[n] = (n + 1.0) * now
        before, now = now, -(2.0 * b * (n + 1.0) * now + K * before) / ((n + 1.0) * (n + 2.0))


@inner(forceinline=True, fastmath={"contract"})
def polynomial(series: Floats, side: int, row: int, t: float) -> float:
    """Return sum(series[side, row, n] t^n), grouped in pairs so that terms do not wait."""
    t2 = t * t
    t4 = t2 * t2
    low = series[side, row, 0] + series[side, row, 1] * t
    low += (series[side, row, 2] + series[side, row, 3] * t) * t2
    middle = series[side, row, 4] + series[side, row, 5] * t
    middle += (series[side, row, 6] + series[side, row, 7] * t) * t2
    high = series[side, row, 8] + series[side, row, 9] * t
    high += (series[side, row, 10] + series[side, row, 11] * t) * t2
    total: float = low + t4 * (middle + t4 * (high + t4 * series[side, row, 12]))
    return total


@inner(forceinline=True, fastmath={"contract"})
def nearby(series: Floats, side: int, t: float) -> tuple[float, float]:
    """Return S(t) and D(t) for |t| <= 1 from series[side]."""
    return t * polynomial(series, side, 0, t), polynomial(series, side, 1, t)
