"""Derivatives of a driven recording whose events are known, carried from sample to sample.

The derivatives of displacement and velocity obey the motion's own equation, driven by what a
parameter changes of the forces; their responses are the integrals in `driven.Responses`. All of
c1 ... A (the first eight of q) are carried side by side; through an event they follow the saltation
rule of `free_pass`. The input is continuous, so nothing is added there. Those of an
acceleration follow from the equation of motion.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.exact.driven import (
    Responses,
    Wave,
    advance_driven,
    reading_driven,
    responses,
)
from bayesimpact.model.exact.normalized import (
    C1,
    C2,
    K1,
    K2,
    OFFSET,
    V0,
    Y0,
    A,
    G,
    begins_in_contact,
    scale,
)
from bayesimpact.model.exact.sensitivities.coefficients import dot
from bayesimpact.model.jit.compiled import inner, typed

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

COLUMNS = 8
RESIDUAL = 11
#: Samples whose products are added up at once.
ROWS = 120


@inner()
def fill_sensitivities(
    slopes: Floats, wanted: Floats, q: Floats, mass: float, interval: float
) -> None:
    """Fill `slopes` (2, 3, COLUMNS): derivatives of beta, K and p of flight and contact.

    wanted : (COLUMNS,) 1.0 or 0.0
    """
    per_mass = interval * interval / mass
    slopes[:] = 0.0
    slopes[:, 0, C1] = interval / mass
    slopes[1, 0, C2] = interval / mass
    slopes[:, 1, K1] = per_mass
    slopes[1, 1, K2] = per_mass
    if q[G] < math.inf:
        slopes[1, 2, K2] = per_mass * q[G]
        slopes[1, 2, G] = per_mass * q[K2]
    for i in range(COLUMNS):
        slopes[:, :, i] *= wanted[i]


@inner(forceinline=True, fastmath={"contract"})
def carry_driven(
    after: Responses, slopes: Floats, side: int, y: float, v: float, p: float, r: float,
    now: float, rise: float, dy: Floats, dv: Floats,
) -> None:  # fmt: skip
    """Bring (dy, dv) through the motion from (y, v) under p + r s; now, rise: p and r per gain."""
    beta, K, S, D = after.beta, after.K, after.S, after.D
    B, R, G_, H = after.B, after.R, after.G, after.H
    m = v + beta * y
    turned = S - beta * H - K * G_  # H'
    by_beta = K * G_ * y - H * v - p * G_ - r * after.P
    rate_by_beta = K * H * y - turned * v - p * H - r * G_
    by_K = -H * y - G_ * m - p * after.P - r * after.Q
    rate_by_K = -turned * y - H * m - p * G_ - r * after.P
    C, KS = D + beta * S, K * S
    for i in range(COLUMNS):
        a, b, c = slopes[side, 0, i], slopes[side, 1, i], slopes[side, 2, i]
        y_i, v_i = dy[i], dv[i]
        dy[i] = C * y_i + S * v_i + (a * by_beta + b * by_K + c * B)
        dv[i] = D * v_i - KS * y_i + (a * rate_by_beta + b * rate_by_K + c * S)
    dy[A] += now * B + rise * R
    dv[A] += now * S + rise * B


@inner(forceinline=True, fastmath={"contract"})
def fill_row(
    row: Floats, order: int, rate: float, beta: float, K: float, slopes: Floats, side: int,
    y: float, v: float, dy: Floats, dv: Floats, gain: Floats, at_once: float,
) -> None:  # fmt: skip
    """Fill `row` (12,) with the derivatives of y, y' or y''.

    at_once : what the input adds to the reading itself, per unit of its gain; `gain` (COLUMNS,) is
        1.0 in its place. (One number stored alone would halt the products of the row after it.)
    """
    if order == 0:
        for k in range(COLUMNS):
            row[k] = dy[k] + at_once * gain[k]
    elif order == 1:
        for k in range(COLUMNS):
            row[k] = rate * dv[k] + at_once * gain[k]
    else:
        square = rate * rate
        for k in range(COLUMNS):
            changed = slopes[side, 2, k] - slopes[side, 0, k] * v - slopes[side, 1, k] * y
            row[k] = square * (changed - beta * dv[k] - K * dy[k]) + at_once * gain[k]


@inner()
def add_rows(gram: Floats, rows: Floats, count: int) -> None:
    """Add to `gram` (12, 12) the products of the first `count` columns of `rows` (12, n)."""
    for k in range(RESIDUAL + 1):
        for h in range(k, RESIDUAL + 1):
            total = dot(rows[k, :count], rows[h, :count])
            gram[k, h] += total
            if h > k:
                gram[h, k] += total


@inner()
def driven_sensitivity_pass(
    q: Floats, mass: float, interval: float, order: int, wave: Wave, events: Floats, columns: Ints,
    data: Floats, values: Floats, jacobian: Floats, gram: Floats,
) -> None:  # fmt: skip
    """Pass over one recording; add to `gram` (12, 12) if `data` has samples, else fill the others.

    order : which time derivative of the displacement the samples are
    events : (k, 2) times and velocities of all events, in sampling intervals
    columns : (11,) -1 where a derivative is not wanted; it is left 0
    values, jacobian : (n,), (n, 11)
    """
    motion = scale(q, mass, interval)
    contact = begins_in_contact(q)
    per_mass = interval * interval / mass
    contact_constant = per_mass * q[K2] * q[G] if q[G] < math.inf else 0.0
    wanted, row = np.zeros(COLUMNS), np.zeros(RESIDUAL + 1)
    dy, dv, slopes = np.zeros(COLUMNS), np.zeros(COLUMNS), np.empty((2, 3, COLUMNS))
    for k in range(COLUMNS):
        wanted[k] = 1.0 if columns[k] >= 0 else 0.0
    gain = np.zeros(COLUMNS)
    gain[A] = wanted[A]
    row[OFFSET] = 1.0 if columns[OFFSET] >= 0 else 0.0
    fill_sensitivities(slopes, wanted, q, mass, interval)
    dy[Y0], dv[V0] = wanted[Y0], interval * wanted[V0]
    free = responses(2.0 * motion.b_flight, motion.K_flight, 1.0)
    touching = responses(2.0 * motion.b_contact, motion.K_contact, 1.0)
    y, v, e = q[Y0], q[V0] * interval, typed(0)
    held, rate = wave.held, 1.0 / interval
    rows, kept = np.empty((RESIDUAL + 1, ROWS)), 0  # what was not yet added to gram
    for i in range(held.size):
        side, level, beta, K = 0, 0.0, free.beta, free.K
        if contact:
            side, level, beta, K = 1, contact_constant, touching.beta, touching.K
        # of an acceleration the input is a part, and a probe may see the base move
        forced = per_mass * wave.shown[i]
        at_once = wave.carried[i] + (rate * rate * forced if order == 2 else 0.0)
        fill_row(row, order, rate, beta, K, slopes, side, y, v, dy, dv, gain, at_once)
        read = reading_driven(order, rate, beta, K, y, v, q[A] * forced + level)
        read += q[OFFSET] + q[A] * wave.carried[i]
        # here, not in a function of its own: that would take three times as long
        if data.size == 0:
            values[i] = read
            jacobian[i] = row[:RESIDUAL]
        else:
            row[RESIDUAL] = data[i] - read
            for k in range(RESIDUAL + 1):
                rows[k, kept] = row[k]
            kept += 1
            if kept == ROWS:
                add_rows(gram, rows, kept)
                kept = 0
        if i == held.size - 1:
            break
        now = per_mass * held[i]
        rise = per_mass * held[i + 1] - now
        r = q[A] * rise
        now_A, rise_A = now * wanted[A], rise * wanted[A]
        t = 0.0
        while e < events.shape[0] and events[e, 0] <= i + 1.0:
            flow, side, level = (touching, 1, contact_constant) if contact else (free, 0, 0.0)
            wait = events[e, 0] - i - t
            after = responses(flow.beta, flow.K, wait)
            p = q[A] * (now + rise * t) + level
            carry_driven(after, slopes, side, y, v, p, r, now_A + rise_A * t, rise_A, dy, dv)
            jump = (q[C2] if contact else -q[C2]) * interval / mass
            for k in range(COLUMNS):
                dv[k] += jump * dy[k]
            dv[G] -= jump * wanted[G]
            t, y, v = events[e, 0] - i, motion.gap, events[e, 1]
            contact = not contact
            e += 1
        flow, side, level = (touching, 1, contact_constant) if contact else (free, 0, 0.0)
        after = flow if t == 0.0 else responses(flow.beta, flow.K, 1.0 - t)
        p = q[A] * (now + rise * t) + level
        carry_driven(after, slopes, side, y, v, p, r, now_A + rise_A * t, rise_A, dy, dv)
        y, v = advance_driven(after, y, v, p, r)
    add_rows(gram, rows, kept)
