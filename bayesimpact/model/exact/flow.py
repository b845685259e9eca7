"""Linear damped motion in closed form: what happens between two events.

One regime (flight, or contact) is the linear oscillator

    u'' + 2 b u' + K u = fs cos(w s) + fc sin(w s),      u = y - rest,   s = time since the start,

with b = c / (2 m), K = k / m. Everything follows from its impulse response S (S(0) = 0, S'(0) = 1)
and D = S', and from E and F, the responses at rest to cos(w s) and sin(w s):

    u(s)  = D u0 + S (v0 + 2 b u0) + fs E + fc F
    u'(s) = D v0 - S K u0 + fs (S - w F) + fc w E

because E' = S - w F and F' = w E. The functions take any consistent units; the simulator counts
time in sampling intervals. Nothing here divides by a quantity that may vanish: critical damping and
undamped resonance are evaluated as limits. (Textbook closed forms; E and F are Duhamel integrals.)
"""

from __future__ import annotations

import math

from bayesimpact.model.jit.compiled import compiled

#: Below this share of K + w^2 the forcing counts as near resonance.
NEAR_RESONANCE = 0.05
#: Before this much of a radian has passed, forced motion is a power series.
EARLY = 0.5


@compiled()
def impulse_response(b: float, K: float, t: float) -> tuple[float, float]:
    """Return S(t) and D(t) = S'(t) of u'' + 2 b u' + K u = 0 from u = 0, u' = 1.

    Parameters
    ----------
    b : half the damping rate c / (2 m), >= 0, 1/time
    K : squared natural frequency k / m, > 0, 1/time^2
    t : time, >= 0
    """
    square = K - b * b
    z = square * t * t
    if -0.01 < z < 0.01:  # early, or near critical damping: series in z
        sinc = 1.0 + z * (
            -1.0 / 6.0
            + z * (1.0 / 120.0 + z * (-1.0 / 5040.0 + z * (1.0 / 362880.0 - z / 39916800.0)))
        )
        cos = 1.0 + z * (
            -1.0 / 2.0 + z * (1.0 / 24.0 + z * (-1.0 / 720.0 + z * (1.0 / 40320.0 - z / 3628800.0)))
        )
        decay = math.exp(-b * t)
        S = decay * t * sinc
        return S, decay * cos - b * S
    if square > 0.0:
        wd = math.sqrt(square)
        decay = math.exp(-b * t)
        S = decay * math.sin(wd * t) / wd
        return S, decay * math.cos(wd * t) - b * S
    beta = math.sqrt(-square)
    slow = K / (b + beta)
    decay = math.exp(-slow * t)
    lost = -math.expm1(-2.0 * beta * t)
    S = decay * lost / (2.0 * beta)
    return S, decay * (1.0 - lost) - slow * S


@compiled()
def second_response(b: float, K: float, t: float, S: float, D: float) -> tuple[float, float]:
    """Return G = S*S and H = S*D = G' (convolutions from 0 to t), given S(t) and D(t).

    -G and -H are the derivatives of S with respect to K and 2 b. G = exp(-b t)(sin x - x cos x) /
    (2 wd^3) with x = wd t, as a power series in x^2 where the difference would cancel.
    """
    z = (K - b * b) * t * t
    if -1.0 < z < 1.0:
        term = 1.0 / 6.0  # (-z)^(n - 1) / (2 n + 1)!
        total = 0.0
        for n in range(1, 11):
            total += n * term
            term *= -z / ((2.0 * n + 2.0) * (2.0 * n + 3.0))
        G = math.exp(-b * t) * t * t * t * total
    else:
        G = (S - t * (D + b * S)) / (2.0 * (K - b * b))
    return G, 0.5 * t * S - b * G


@compiled()
def _forced_series(beta: float, K: float, w: float, square: float) -> tuple[float, float]:
    """Return E and F at time 1, beta, K and w per unit of time, times `square`."""
    E = F = e0 = e1 = f0 = f1 = 0.0  # e, f: terms n and n + 1
    cos, sin = square, 0.0  # term n of the force
    for n in range(16):
        both = 1.0 / ((n + 1.0) * (n + 2.0))
        drag = beta * (n + 1.0)
        e0, e1 = e1, (cos - drag * e1 - K * e0) * both
        f0, f1 = f1, (sin - drag * f1 - K * f0) * both
        E, F = E + e1, F + f1
        cos, sin = -w * sin / (n + 1.0), w * cos / (n + 1.0)
    return E, F


@compiled()
def forced_response(
    b: float, K: float, w: float, t: float, S: float, D: float
) -> tuple[float, float]:
    """Return E(t) and F(t): responses, from rest, to cos(w t) and sin(w t), given S(t) and D(t).

    Real and imaginary part of z(t), z'' + 2 b z' + K z = exp(i w t). Away from resonance
    z = (exp(i w t) - C - i w S) / (K - w^2 + 2 i b w) with C = D + 2 b S. Near resonance both sides
    of that fraction vanish, and the divided difference (exp(i w t) - exp(l t)) / (i w - l) over the
    characteristic root l is evaluated by expm1 instead; early on, the power series is.
    """
    if (math.sqrt(K) + 2.0 * b + w) * t < EARLY:
        E, F = _forced_series(2.0 * b * t, K * t * t, w * t, t * t)
        return E, F
    below = K - w * w
    across = 2.0 * b * w
    cos = math.cos(w * t)
    sin = math.sin(w * t)
    size = below * below + across * across
    limit = NEAR_RESONANCE * (K + w * w)
    if size >= limit * limit:
        real = cos - D - 2.0 * b * S
        imag = sin - w * S
        return (real * below + imag * across) / size, (imag * below - real * across) / size
    wd = math.sqrt(K - b * b)
    decay = math.exp(-b * t)
    cos_d = math.cos(wd * t)
    sin_d = math.sin(wd * t)
    # near root l = -b + i wd:  (exp(i w t) - exp(l t)) / (i w - l), as expm1 while that is small
    start = complex(decay * cos_d, decay * sin_d)
    root = complex(b, w - wd)
    turned = (w - wd) * t
    if b * t + abs(turned) > 1.0:
        near = (complex(cos, sin) - start) / root
    elif root != 0.0:
        half = math.sin(0.5 * turned)
        change = complex(
            math.expm1(b * t) * math.cos(turned) - 2.0 * half * half,
            math.exp(b * t) * math.sin(turned),
        )
        near = start * (change / root)
    else:
        near = start * t
    far = complex(cos - decay * cos_d, sin + decay * sin_d) / complex(b, w + wd)
    z = (near - far) / complex(0.0, 2.0 * wd)
    return z.real, z.imag


@compiled(forceinline=True, fastmath={"contract"})
def advance(b: float, K: float, u: float, v: float, S: float, D: float) -> tuple[float, float]:
    """Return (u, u') after the unforced motion with impulse response S, D from (u, v)."""
    return D * u + S * (v + 2.0 * b * u), D * v - S * (K * u)


@compiled(forceinline=True, fastmath={"contract"})
def advance_forced(
    b: float, K: float, w: float, u: float, v: float, fs: float, fc: float,
    S: float, D: float, E: float, F: float,
) -> tuple[float, float]:  # fmt: skip
    """Return (u, u') after the forced motion from (u, v); the force starts as fs cos + fc sin."""
    return (
        D * u + S * (v + 2.0 * b * u) + fs * E + fc * F,
        D * v - S * (K * u) + fs * (S - w * F) + fc * (w * E),
    )
