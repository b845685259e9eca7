"""One pass over a recording whose events are known: its motion and all derivatives.

In every block (samples of one regime, at most LENGTH of them) the measured displacement and its
derivatives are coefficients times the table of `basis`. Row Q_COUNT holds the motion itself, row i
its derivative with respect to q_i. Sensitivities (du, dv) of displacement and velocity travel from
block to block by the same coefficients at one time, and through an event by the saltation rule

    dy+ = dy-      dv+ = dv- + (a+ - a-)/v (dy- - dg)      a+ - a- = -+ c2 v / m  at entry, exit

so that v cancels: no singularity at grazing. (Rule for transversal events: Kong, Payne, Zhu and
Johnson, 2024, "Saltation matrices", Proc. IEEE 112:585.) Time is counted in sampling intervals; the
derivatives are with respect to q in SI units.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.basis import (
    D_,
    E_,
    F_,
    G_,
    H_,
    ONE,
    P_,
    PR,
    S_,
    UC,
    US,
    X_,
    XR,
    fill_basis,
    fill_table,
)  # fmt: skip
from bayesimpact.model.compiled import compiled
from bayesimpact.model.tables import LENGTH

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Row of the motion itself in the arrays of coefficients, after those of the eleven q.
MOTION = 11
ROWS = 12
C1, K1, C2, G, K2, Y0, V0, A, W, PHASE, OFFSET = range(11)


@compiled()
def coefficients(
    out: Floats, active: Ints, q: Floats, mass: float, interval: float, contact: bool, forced: bool,
    t: float, y: float, v: float, dy: Floats, dv: Floats,
) -> None:  # fmt: skip
    """Fill `out` (ROWS, basis) for the motion that starts at time t, in one regime.

    active : the q whose rows are wanted
    y, v : state at t; dy, dv (11,) its derivatives
    """
    per_mass = interval * interval / mass
    stiffness = q[K1] + q[K2] if contact else q[K1]
    beta = (q[C1] + q[C2] if contact else q[C1]) * interval / mass
    K = stiffness * per_mass
    rest = q[K2] * q[G] / stiffness if contact else 0.0
    u = y - rest
    m = v + beta * u
    fs = fc = sin = cos = 0.0
    if forced:
        angle = q[W] * interval * t + q[PHASE]
        sin, cos = math.sin(angle) * per_mass, math.cos(angle) * per_mass
        fs, fc = q[A] * sin, q[A] * cos
    for i in active:
        K_i = beta_i = rest_i = w_i = fs_i = fc_i = 0.0
        if i == C1 or (i == C2 and contact):
            beta_i = interval / mass
        elif i == K1:
            K_i = per_mass
            rest_i = -rest / stiffness
        elif contact and i == K2:
            K_i = per_mass
            rest_i = (q[G] - rest) / stiffness
        elif contact and i == G:
            rest_i = q[K2] / stiffness
        elif forced and i == A:
            fs_i, fc_i = sin, cos
        elif forced and i == W:
            w_i = interval
            fs_i, fc_i = fc * interval * t, -fs * interval * t
        elif forced and i == PHASE:
            fs_i, fc_i = fc, -fs
        row = out[i]
        du = dy[i] - rest_i
        row[ONE] = rest_i
        row[S_] = dv[i] + beta * du
        row[D_] = du
        row[G_] = beta_i * (K * u) - K_i * m
        row[H_] = -beta_i * v - K_i * u
        if forced:
            row[E_], row[F_] = fs_i, fc_i
            row[X_], row[XR], row[P_], row[PR] = -K_i * fs, -beta_i * fs, -K_i * fc, -beta_i * fc
            row[US], row[UC] = -w_i * fs, w_i * fc
    row = out[MOTION]
    row[:] = 0.0
    row[ONE], row[S_], row[D_] = rest, m, u
    if forced:
        row[E_], row[F_] = fs, fc


@compiled()
def carry(
    coef: Floats, value: Floats, rate: Floats, active: Ints, dy: Floats, dv: Floats
) -> tuple[float, float]:
    """Return (y, v) and leave (dy, dv) at the time at which the basis is `value`, `rate`."""
    y = v = 0.0
    for k in range(value.size):
        y += coef[MOTION, k] * value[k]
        v += coef[MOTION, k] * rate[k]
    for i in active:
        a = b = 0.0
        for k in range(value.size):
            a += coef[i, k] * value[k]
            b += coef[i, k] * rate[k]
        dy[i], dv[i] = a, b
    return y, v


@compiled()
def write_block(
    coef: Floats, table: Floats, first: int, end: int, offset: float, active: Ints,
    values: Floats, jacobian: Floats,
) -> None:  # fmt: skip
    """Write values (n,) and jacobian (n, 11) of samples first..end-1."""
    for j in range(end - first):
        y = offset
        for k in range(table.shape[0]):
            y += coef[MOTION, k] * table[k, j]
        values[first + j] = y
        for i in active:
            a = 0.0
            for k in range(table.shape[0]):
                a += coef[i, k] * table[k, j]
            jacobian[first + j, i] = a


@compiled()
def prefix_grams(prefix: Floats, table: Floats) -> None:
    """Fill `prefix` (LENGTH + 1, basis, basis): sums over j < n of products of table rows."""
    size = table.shape[0]
    prefix[0] = 0.0
    for n in range(table.shape[1]):
        for k in range(size):
            for m in range(size):
                prefix[n + 1, k, m] = prefix[n, k, m] + table[k, n] * table[m, n]


@compiled(fastmath={"reassoc", "contract"})
def add_block(
    coef: Floats, table: Floats, prefix: Floats, data: Floats, offset: float, active: Ints,
    moments: Floats, gram: Floats,
) -> None:  # fmt: skip
    """Add to `gram` (12, 12) the products of [J | residual] over the samples `data` of one block.

    J's own products follow from the prefix sums of the basis; the samples are read only for the
    residuals and their products with the basis (`moments`).
    """
    size = table.shape[0]
    moments[:] = 0.0
    total = 0.0
    for j in range(data.size):
        r = data[j] - offset
        for k in range(size):
            r -= coef[MOTION, k] * table[k, j]
        total += r * r
        for k in range(size):
            moments[k] += r * table[k, j]
    gram[MOTION, MOTION] += total
    products = prefix[data.size]
    for i in active:
        a = 0.0
        for k in range(size):
            a += coef[i, k] * moments[k]
        gram[i, MOTION] += a
        for k in range(size):
            a = 0.0
            for m in range(size):
                a += products[k, m] * coef[i, m]
            for h in active:
                gram[i, h] += a * coef[h, k]


@compiled()
def sweep(
    q: Floats, mass: float, interval: float, n: int, events: Floats, begins_in_contact: bool,
    active: Ints, data: Floats, values: Floats, jacobian: Floats, gram: Floats,
    tables: Floats, ends: Floats, prefixes: Floats, keys: Floats,
) -> None:  # fmt: skip
    """Pass over one recording; fill `gram` (12, 12) if `data` has samples, else values and
    jacobian.

    events : (k, 2) times and velocities of all events, in sampling intervals
    active : the q wanted, without the offset
    tables, ends, prefixes, keys : of both regimes, kept from call to call
    """
    size = tables.shape[1]
    forced = size > H_ + 1
    coef = np.zeros((ROWS, size))
    coef[OFFSET, ONE] = 1.0
    value, rate, moments = np.empty(size), np.empty(size), np.empty(size)
    dy, dv = np.zeros(11), np.zeros(11)
    dy[Y0], dv[V0] = 1.0, interval
    with_offset = np.append(active, OFFSET)
    contact = begins_in_contact
    w = q[W] * interval
    t, y, v = 0.0, q[Y0], q[V0] * interval
    i = 0
    for e in range(events.shape[0] + 1):
        side = 1 if contact else 0
        b = 0.5 * (q[C1] + q[C2] if contact else q[C1]) * interval / mass
        K = (q[K1] + q[K2] if contact else q[K1]) * interval * interval / mass
        table, prefix, key = tables[side], prefixes[side], keys[side]
        end = math.ceil(events[e, 0]) if e < events.shape[0] else n
        coefficients(coef, active, q, mass, interval, contact, forced, t, y, v, dy, dv)
        if i < end:
            if key[0] != b or key[1] != K or key[2] != w:
                fill_table(table, ends[side, 0], ends[side, 1], b, K, w, forced)
                if data.size:
                    prefix_grams(prefix, table)
                key[0], key[1], key[2] = b, K, w
            fill_basis(value, rate, b, K, w, forced, i - t)
            while True:
                y, v = carry(coef, value, rate, active, dy, dv)
                t = float(i)
                coefficients(coef, active, q, mass, interval, contact, forced, t, y, v, dy, dv)
                block = min(i + LENGTH, end)
                if data.size:
                    add_block(
                        coef, table, prefix, data[i:block], q[OFFSET], with_offset, moments, gram
                    )
                else:
                    write_block(coef, table, i, block, q[OFFSET], with_offset, values, jacobian)
                i = block
                if i == end:
                    break
                value[:], rate[:] = ends[side, 0], ends[side, 1]
        if e == events.shape[0]:
            break
        fill_basis(value, rate, b, K, w, forced, events[e, 0] - t)
        carry(coef, value, rate, active, dy, dv)
        t, y, v = events[e, 0], q[G], events[e, 1]
        jump = (q[C2] if contact else -q[C2]) * interval / mass
        for p in active:
            dv[p] += jump * (dy[p] - (1.0 if p == G else 0.0))
        contact = not contact
