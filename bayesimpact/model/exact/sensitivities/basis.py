"""The functions of time of which a regime's motion and all its derivatives are made.

Within one regime the displacement is a fixed combination of S and D (see `flow`), and its
derivative with respect to any parameter one of

    1   S   D   G = S*S   H = S*D = G'

where * is convolution from 0 to t. For, with S the inverse Laplace transform of
1 / (s^2 + 2 b s + K), dS/dK = -G and dS/d(2b) = -H.

Their values at one time carry state and sensitivities from one time to another; a table of them at
every sample does so for a whole run at once.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.exact.flow import impulse_response, second_response
from bayesimpact.model.exact.tables import LENGTH, TERMS, fill_series, nearby, polynomial
from bayesimpact.model.jit.compiled import compiled, inner, typed

Floats = NDArray[np.float64]

SIZE = 5
ONE, S_, D_, G_, H_ = range(SIZE)


@compiled()
def fill_basis(value: Floats, b: float, K: float, t: float) -> None:
    """Fill `value` (SIZE,) with the functions at time t."""
    S, D = impulse_response(b, K, t)
    G, H = second_response(b, K, t, S, D)
    value[ONE], value[S_], value[D_], value[G_], value[H_] = 1.0, S, D, G, H


@inner()
def fill_basis_series(series: Floats, b: float, K: float) -> None:
    """Fill `series` (3, TERMS): Taylor coefficients of S / t, D and G / t^3."""
    fill_series(series, b, K)
    before, now = 0.0, 1.0 / 6.0  # coefficients n + 2 and n + 3 of G
    for n in range(TERMS):
        series[2, n] = now
        drag, both = 2.0 * b * (n + 3.0), (n + 3.0) * (n + 4.0)
        before, now = (
            now,
            (series[0, n + 1] - drag * now - K * before) / both if n + 1 < TERMS else 0.0,
        )


@inner(forceinline=True, fastmath={"contract"})
def basis_at(
    tables: Floats, series: Floats, side: int, b: float, K: float, slow: bool, t: float
) -> tuple[float, float, float, float]:
    """Return S, D, G, H at 0 <= t <= LENGTH: of slow regimes from the table and Taylor series."""
    if not slow:
        S, D = impulse_response(b, K, t)
        G, H = second_response(b, K, t, S, D)
        return S, D, G, H
    j = min(math.floor(t + 0.5), LENGTH - 1)
    t -= j
    s, d = nearby(series, side, t)
    g = t * t * t * polynomial(series, side, 2, t)
    h = 0.5 * t * s - b * g
    S, D, G, H = tables[side, S_, j], tables[side, D_, j], tables[side, G_, j], tables[side, H_, j]
    C = D + 2.0 * b * S
    return (
        S * d + C * s,
        D * d - K * S * s,
        G * d + (H + 2.0 * b * G) * s + C * g + S * h,
        H * d - K * G * s + D * h + S * (s - K * g),
    )


@compiled()
def fill_table(table: Floats, value: Floats, b: float, K: float) -> None:
    """Fill `table` (SIZE, LENGTH) with the functions at 0, 1, ..., LENGTH - 1 intervals.

    `value` (SIZE,) is left with those at LENGTH. As `tables.fill`: exact at powers of two, the
    addition theorem between them.
    """
    beta = 2.0 * b
    table[:, 0] = 0.0
    table[ONE] = 1.0
    table[D_, 0] = 1.0
    S, D, G, H = table[S_], table[D_], table[G_], table[H_]
    a = typed(1)
    while a <= LENGTH:
        fill_basis(value, b, K, float(a))
        v = value
        count = min(a, LENGTH - a)
        Ca = v[D_] + beta * v[S_]
        first_G = v[H_] + beta * v[G_]
        for j in range(count):
            k = a + j
            S[k] = v[S_] * D[j] + Ca * S[j]
            D[k] = v[D_] * D[j] - K * v[S_] * S[j]
            G[k] = v[G_] * D[j] + first_G * S[j] + Ca * G[j] + v[S_] * H[j]
            H[k] = v[H_] * D[j] - K * v[G_] * S[j] + v[D_] * H[j] + v[S_] * (S[j] - K * G[j])
        a *= 2
