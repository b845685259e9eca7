"""The functions of time of which a regime's motion and all its derivatives are made.

Within one regime the displacement is a fixed combination of S, D (and E, F with forcing, see
`flow`), and its derivative with respect to any parameter one of

    1   S   D   G = S*S   H = S*D = G'                                        (PLAIN of them)
    E   F   X = S*E   X'   P = S*F   P'   Us   Uc                    (FORCED, with these eight)

where * is convolution from 0 to t, and Us, Uc are the responses at rest to t sin(w t), t cos(w t).
For, with S the inverse Laplace transform of 1 / (s^2 + 2 b s + K),

    dS/dK = -G     dS/d(2b) = -H     dE/dK = -X     dE/d(2b) = -X'     dE/dw = -Us     dF/dw = Uc

A vector of these values at one time, and one of their rates of change, carry state and
sensitivities from one time to another; a table of them at every sample does so for a whole run at
once.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.compiled import compiled, inner, typed
from bayesimpact.model.flow import forced_response, impulse_response, second_response
from bayesimpact.model.tables import LENGTH, TERMS, fill_series, nearby, polynomial

Floats = NDArray[np.float64]

PLAIN = 5
FORCED = 13
ONE, S_, D_, G_, H_, E_, F_, X_, XR, P_, PR, US, UC = range(FORCED)

#: Terms of the power series in `late_responses`; |rate t| <= 1/2 there, so the rest is below 1e-20.
LATE_TERMS = 18


@compiled()
def late_responses(
    b: float, K: float, w: float, t: float
) -> tuple[float, float, float, float, float, float, float, float]:
    """Return X, X', P, P', Us, Us', Uc, Uc' at time t, accurately at any damping and detuning.

    Power series at t / 2^k, then k doublings by the addition theorem: the closed forms are divided
    differences of up to fourth order, which cancel near resonance and near critical damping.
    """
    beta = 2.0 * b
    halvings = 0
    h = t
    while (beta + math.sqrt(K) + w) * h > 0.5:
        h *= 0.5
        halvings += 1
    if h == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    bh, Kh, hh, wh = beta * h, K * h * h, h * h, w * h
    X = XR = P = PR = Us = UsR = Uc = UcR = 0.0
    cos, sin, cos_before, sin_before = 1.0, 0.0, 0.0, 0.0  # terms n and n - 1 of the series
    e0 = e1 = f0 = f1 = x0 = x1 = p0 = p1 = s0 = s1 = c0 = c1 = 0.0  # terms n and n + 1
    for n in range(LATE_TERMS):
        both = 1.0 / ((n + 1.0) * (n + 2.0))
        drag = bh * (n + 1.0)
        e2 = (hh * cos - drag * e1 - Kh * e0) * both
        f2 = (hh * sin - drag * f1 - Kh * f0) * both
        x2 = (hh * e0 - drag * x1 - Kh * x0) * both
        p2 = (hh * f0 - drag * p1 - Kh * p0) * both
        s2 = (hh * h * sin_before - drag * s1 - Kh * s0) * both
        c2 = (hh * h * cos_before - drag * c1 - Kh * c0) * both
        rate = (n + 2.0) / h
        X, XR, P, PR = X + x2, XR + rate * x2, P + p2, PR + rate * p2
        Us, UsR, Uc, UcR = Us + s2, UsR + rate * s2, Uc + c2, UcR + rate * c2
        e0, e1, f0, f1, x0, x1 = e1, e2, f1, f2, x1, x2
        p0, p1, s0, s1, c0, c1 = p1, p2, s1, s2, c1, c2
        cos_before, sin_before = cos, sin
        cos, sin = -wh * sin_before / (n + 1.0), wh * cos_before / (n + 1.0)
    for _ in range(halvings):
        S, D = impulse_response(b, K, h)
        G, H = second_response(b, K, h, S, D)
        E, F = forced_response(b, K, w, h, S, D)
        ER, FR = S - w * F, w * E
        cos, sin = math.cos(w * h), math.sin(w * h)
        rest = S - K * G
        X, XR, P, PR = (
            X * D + (XR + beta * X) * S + E * H + (ER + beta * E) * G + cos * X - sin * P,
            XR * D - K * X * S + E * rest + ER * H + cos * XR - sin * PR,
            P * D + (PR + beta * P) * S + F * H + (FR + beta * F) * G + sin * X + cos * P,
            PR * D - K * P * S + F * rest + FR * H + sin * XR + cos * PR,
        )
        Us, UsR, Uc, UcR = (
            Us * D + (UsR + beta * Us) * S + h * (sin * E + cos * F) + sin * Uc + cos * Us,
            UsR * D - K * Us * S + h * (sin * ER + cos * FR) + sin * UcR + cos * UsR,
            Uc * D + (UcR + beta * Uc) * S + h * (cos * E - sin * F) + cos * Uc - sin * Us,
            UcR * D - K * Uc * S + h * (cos * ER - sin * FR) + cos * UcR - sin * UsR,
        )
        h *= 2.0
    return X, XR, P, PR, Us, UsR, Uc, UcR


@compiled()
def fill_basis(
    value: Floats, rate: Floats, b: float, K: float, w: float, forced: bool, t: float
) -> None:
    """Fill `value` and `rate` (PLAIN or FORCED,) with the functions and their rates at time t."""
    beta = 2.0 * b
    S, D = impulse_response(b, K, t)
    G, H = second_response(b, K, t, S, D)
    value[ONE], value[S_], value[D_], value[G_], value[H_] = 1.0, S, D, G, H
    rate[ONE], rate[S_], rate[D_] = 0.0, D, -beta * D - K * S
    rate[G_], rate[H_] = H, S - beta * H - K * G
    if forced:
        E, F = forced_response(b, K, w, t, S, D)
        X, XR_, P, PR_, Us, UsR, Uc, UcR = late_responses(b, K, w, t)
        value[E_], value[F_], rate[E_], rate[F_] = E, F, S - w * F, w * E
        value[X_], value[XR], rate[X_], rate[XR] = X, XR_, XR_, E - beta * XR_ - K * X
        value[P_], value[PR], rate[P_], rate[PR] = P, PR_, PR_, F - beta * PR_ - K * P
        value[US], value[UC], rate[US], rate[UC] = Us, Uc, UsR, UcR


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
def plain_basis(
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
def fill_table(
    table: Floats, value: Floats, rate: Floats, b: float, K: float, w: float, forced: bool
) -> None:
    """Fill `table` (PLAIN or FORCED, LENGTH) with the functions at 0, 1, ..., LENGTH - 1 intervals.

    `value` and `rate` are left with those at LENGTH. As `tables.fill`: exact at powers of two, the
    addition theorem between them.
    """
    beta = 2.0 * b
    table[:, 0] = 0.0
    table[ONE] = 1.0
    table[D_, 0] = 1.0
    S, D, G, H = table[S_], table[D_], table[G_], table[H_]
    a = typed(1)
    while a <= LENGTH:
        fill_basis(value, rate, b, K, w, forced, float(a))
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
        if forced:
            _extend_forced(table, value, rate, beta, K, w, a, count)
        a *= 2


@inner()
def _extend_forced(
    table: Floats, v: Floats, r: Floats, beta: float, K: float, w: float, a: int, count: int
) -> None:
    S, D, G, H = table[S_], table[D_], table[G_], table[H_]
    E, F, X, Xr = table[E_], table[F_], table[X_], table[XR]
    P, Pr, Us, Uc = table[P_], table[PR], table[US], table[UC]
    cos, sin = math.cos(w * a), math.sin(w * a)
    first_E, first_F = r[E_] + beta * v[E_], r[F_] + beta * v[F_]
    first_X, first_P = r[X_] + beta * v[X_], r[P_] + beta * v[P_]
    first_s, first_c = r[US] + beta * v[US], r[UC] + beta * v[UC]
    for j in range(count):
        k = a + j
        sines = sin * E[j] + cos * F[j]
        cosines = cos * E[j] - sin * F[j]
        rest = S[j] - K * G[j]
        E[k] = v[E_] * D[j] + first_E * S[j] + cosines
        F[k] = v[F_] * D[j] + first_F * S[j] + sines
        X[k] = v[X_] * D[j] + first_X * S[j] + v[E_] * H[j] + first_E * G[j]
        X[k] += cos * X[j] - sin * P[j]
        P[k] = v[P_] * D[j] + first_P * S[j] + v[F_] * H[j] + first_F * G[j]
        P[k] += sin * X[j] + cos * P[j]
        Xr[k] = r[X_] * D[j] - K * v[X_] * S[j] + v[E_] * rest + r[E_] * H[j]
        Xr[k] += cos * Xr[j] - sin * Pr[j]
        Pr[k] = r[P_] * D[j] - K * v[P_] * S[j] + v[F_] * rest + r[F_] * H[j]
        Pr[k] += sin * Xr[j] + cos * Pr[j]
        Us[k] = v[US] * D[j] + first_s * S[j] + a * sines + sin * Uc[j] + cos * Us[j]
        Uc[k] = v[UC] * D[j] + first_c * S[j] + a * cosines + cos * Uc[j] - sin * Us[j]
