"""Derivatives with respect to every q, side by side: coefficients, their travel, their products.

The derivative with respect to q_i is a row of coefficients over the `basis`: stack[i, slot], one
slot per block. Blocks lie one behind the other, so that the Gram matrix of a whole recording is a
few long dot products. `active` lists the q that are wanted (unsigned: numba then leaves out the
check for negative indices); dy and dv (11,) are the derivatives of displacement and velocity at the
time.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.exact.normalized import C1, C2, K1, K2, OFFSET, G
from bayesimpact.model.exact.sensitivities.basis import D_, G_, H_, ONE, S_
from bayesimpact.model.jit.compiled import inner

Floats = NDArray[np.float64]
Columns = NDArray[np.uint64]

RESIDUAL = 11


@inner()
def fill_slopes(slopes: Floats, q: Floats, mass: float, interval: float) -> None:
    """Fill `slopes` (2, 3, 11): derivatives of 2 b, K and rest of flight and contact.

    An offset of the sensor is a shift of displacement, rest and gap alike.
    """
    per_mass = interval * interval / mass
    slopes[:] = 0.0
    slopes[:, 0, C1] = interval / mass
    slopes[1, 0, C2] = interval / mass
    slopes[:, 1, K1] = per_mass
    slopes[1, 1, K2] = per_mass
    slopes[:, 2, OFFSET] = 1.0
    stiffness = q[K1] + q[K2]
    if q[G] < math.inf:
        slopes[1, 2, K1] = -q[K2] * q[G] / stiffness / stiffness
        slopes[1, 2, K2] = q[K1] * q[G] / stiffness / stiffness
        slopes[1, 2, G] = q[K2] / stiffness


@inner(forceinline=True, fastmath={"contract"})
def fill_coefficients(
    stack: Floats, slot: int, active: Columns, slopes: Floats, side: int, beta: float, K: float,
    u: float, v: float, dy: Floats, dv: Floats,
) -> None:  # fmt: skip
    """Write the coefficients of the motion from (u, v), relative to the rest."""
    m = v + beta * u
    pull = K * u
    for i in active:
        beta_i, K_i, rest_i = slopes[side, 0, i], slopes[side, 1, i], slopes[side, 2, i]
        du = dy[i] - rest_i
        of_S = dv[i] + beta * du
        stack[i, slot, ONE] = rest_i
        stack[i, slot, S_] = of_S
        stack[i, slot, D_] = du
        stack[i, slot, G_] = beta_i * pull - K_i * m
        stack[i, slot, H_] = -beta_i * v - K_i * u


@inner()
def fill_reading(
    stack: Floats, here: int, slot: int, active: Columns, order: int, interval: float, beta: float,
    K: float,
) -> None:  # fmt: skip
    """Write into `slot` the coefficients of the order-th time derivative of those in `here`.

    The basis is closed under it: S' = D, D' = -2 b D - K S, G' = H, H' = S - 2 b H - K G.
    """
    rate = 1.0 / interval
    for i in active:
        c = stack[i, slot]
        c[:] = stack[i, here]
        for _ in range(order):
            S, D, G, H = c[S_], c[D_], c[G_], c[H_]
            c[ONE] = 0.0
            c[S_], c[D_] = rate * (H - K * D), rate * (S - beta * D)
            c[G_], c[H_] = -rate * K * H, rate * (G - beta * H)
        if i == OFFSET:  # a constant is added to the reading, whatever is read
            c[:] = 0.0
            c[ONE] = 1.0


@inner(forceinline=True, fastmath={"contract"})
def carry(
    stack: Floats, slot: int, active: Columns, beta: float, K: float, S: float, D: float, G: float,
    H: float, dy: Floats, dv: Floats,
) -> None:  # fmt: skip
    """Bring (dy, dv) to the time at which the basis is 1, S, D, G, H."""
    D_rate = -beta * D - K * S
    H_rate = S - beta * H - K * G
    for i in active:
        a, b, c = stack[i, slot, 0], stack[i, slot, 1], stack[i, slot, 2]
        d, e = stack[i, slot, 3], stack[i, slot, 4]
        dy[i] = a + b * S + c * D + d * G + e * H
        dv[i] = b * D + c * D_rate + d * H + e * H_rate


@inner(forceinline=True, fastmath={"contract"})
def multiply(
    stack: Floats,
    products: Floats,
    slot: int,
    active: Columns,
    prefixes: Floats,
    side: int,
    count: int,
) -> None:
    """Write into `products` the rows of a block times the sums over its `count` samples."""
    w = prefixes[side, count]
    w00, w01, w02, w03, w04 = w[0, 0], w[0, 1], w[0, 2], w[0, 3], w[0, 4]
    w11, w12, w13, w14 = w[1, 1], w[1, 2], w[1, 3], w[1, 4]
    w22, w23, w24, w33, w34, w44 = w[2, 2], w[2, 3], w[2, 4], w[3, 3], w[3, 4], w[4, 4]
    for i in active:
        a, b, c = stack[i, slot, 0], stack[i, slot, 1], stack[i, slot, 2]
        d, e = stack[i, slot, 3], stack[i, slot, 4]
        products[i, slot, 0] = w00 * a + w01 * b + w02 * c + w03 * d + w04 * e
        products[i, slot, 1] = w01 * a + w11 * b + w12 * c + w13 * d + w14 * e
        products[i, slot, 2] = w02 * a + w12 * b + w22 * c + w23 * d + w24 * e
        products[i, slot, 3] = w03 * a + w13 * b + w23 * c + w33 * d + w34 * e
        products[i, slot, 4] = w04 * a + w14 * b + w24 * c + w34 * d + w44 * e


@inner(fastmath={"reassoc", "contract", "nsz"})
def dot(a: Floats, b: Floats) -> float:
    """Return the scalar product of two vectors."""
    total = 0.0
    for j in range(a.size):
        total += a[j] * b[j]
    return total


@inner()
def add_products(
    gram: Floats, stack: Floats, products: Floats, moments: Floats, slots: int, active: Columns,
    samples: int,
) -> int:  # fmt: skip
    """Add the slots' products of J with J and with the residual to `gram` (12, 12).

    Only if there are samples. Returns how many slots are still filled: none.
    """
    if samples == 0:
        return 0
    width = stack.shape[1] * stack.shape[2]
    count = slots * stack.shape[2]
    rows, weighted, residuals = stack.reshape(-1), products.reshape(-1), moments.reshape(-1)
    for i in active:
        first = np.int64(i) * width
        mine = rows[first : first + count]
        for h in active:
            if h >= i:
                other = np.int64(h) * width
                total = dot(mine, weighted[other : other + count])
                gram[i, h] += total
                if h > i:
                    gram[h, i] += total
        total = dot(mine, residuals[:count])
        gram[i, RESIDUAL] += total
        gram[RESIDUAL, i] += total
    return 0
