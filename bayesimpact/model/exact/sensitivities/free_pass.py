"""One pass over a recording whose events are known: its motion and all derivatives.

In every block (samples of one regime, at most LENGTH of them) the displacement and its derivatives
are coefficients times the table of `basis`. The derivatives of displacement and velocity, dy and
dv, travel from block to block by the same coefficients at one time, and through an event by the
saltation rule

    dy+ = dy-      dv+ = dv- + (a+ - a-)/v (dy- - dg)      a+ - a- = -+ c2 v / m  at entry, exit

so that v cancels: no singularity at grazing. (Rule for transversal events: Kong, Payne, Zhu and
Johnson, 2024, "Saltation matrices", Proc. IEEE 112:585.) Time is counted in sampling intervals; the
derivatives are with respect to q in SI units.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.exact.blocks import reading_of
from bayesimpact.model.exact.normalized import C2, OFFSET, V0, Y0, G, begins_in_contact, scale
from bayesimpact.model.exact.sensitivities.basis import (
    SIZE,
    basis_at,
    fill_basis_series,
    fill_table,
)
from bayesimpact.model.exact.sensitivities.coefficients import (
    RESIDUAL,
    add_products,
    carry,
    fill_coefficients,
    fill_reading,
    fill_slopes,
    multiply,
)  # fmt: skip
from bayesimpact.model.exact.sensitivities.moments import prefix_grams, sum_moments, write_rows
from bayesimpact.model.exact.tables import LENGTH, SLOW, TERMS
from bayesimpact.model.jit.compiled import inner, typed

Floats = NDArray[np.float64]
Columns = NDArray[np.uint64]

#: Blocks whose coefficients are kept before their products are added up.
BLOCKS = 64


class Workspace(NamedTuple):
    """Room for `free_pass`, kept from recording to recording.

    tables (2, SIZE, LENGTH), series (2, 3, TERMS), prefixes (2, LENGTH + 1, SIZE, SIZE),
    keys (2, 2) : of both regimes, with their b and K
    slopes (2, 3, 11) : derivatives of their 2 b, K and rest
    stack, products (11, BLOCKS + 1, SIZE), moments (BLOCKS, SIZE) : of the blocks; the last row
        holds the motion's own coefficients where the probe reads a derivative of it
    point (SIZE,), dy (11,), dv (11,) : at one time
    """

    tables: Floats
    series: Floats
    prefixes: Floats
    keys: Floats
    slopes: Floats
    stack: Floats
    products: Floats
    moments: Floats
    point: Floats
    dy: Floats
    dv: Floats


@inner()
def workspace(with_grams: bool) -> Workspace:
    """Return an empty workspace."""
    lengths = LENGTH + 1 if with_grams else 0
    return Workspace(
        np.empty((2, SIZE, LENGTH)),
        np.empty((2, 3, TERMS)),
        np.empty((2, lengths, SIZE, SIZE)),
        np.full((2, 2), np.nan),
        np.empty((2, 3, 11)),
        np.empty((11, BLOCKS + 1, SIZE)),
        np.empty((11, BLOCKS + 1, SIZE)),
        np.empty((BLOCKS, SIZE)),
        np.empty(SIZE),
        np.empty(11),
        np.empty(11),
    )


@inner()
def refill(room: Workspace, side: int, b: float, K: float) -> None:
    """Fill tables, series and prefix sums of one regime."""
    fill_table(room.tables[side], room.point, b, K)
    fill_basis_series(room.series[side], b, K)
    if room.prefixes.shape[1] > 0:
        prefix_grams(room.prefixes, room.tables, side)
    room.keys[side, 0], room.keys[side, 1] = b, K


@inner(fastmath={"contract"})
def sensitivity_pass(
    q: Floats, mass: float, interval: float, n: int, order: int, events: Floats, active: Columns,
    data: Floats, values: Floats, jacobian: Floats, gram: Floats, room: Workspace,
) -> None:  # fmt: skip
    """Pass over one recording; add to `gram` (12, 12) if `data` has samples, else fill the others.

    order : which time derivative of the displacement the samples are
    events : (k, 2) times and velocities of all events, in sampling intervals
    active : the q whose derivatives are wanted
    values, jacobian : (n,), (n, 11)
    """
    tables, series, prefixes, keys, slopes, stack, products, moments, _, dy, dv = room
    motion = scale(q, mass, interval)
    contact = begins_in_contact(q)
    fill_slopes(slopes, q, mass, interval)
    dy[:], dv[:] = 0.0, 0.0
    dy[Y0], dv[V0], dy[OFFSET] = 1.0, interval, 1.0
    t, y, v = 0.0, q[Y0], q[V0] * interval
    squares = 0.0
    i = slot = typed(0)
    for e in range(events.shape[0] + 1):
        if contact:
            side, b, K, rest = 1, motion.b_contact, motion.K_contact, motion.rest
        else:
            side, b, K, rest = 0, motion.b_flight, motion.K_flight, 0.0
        if keys[side, 0] != b or keys[side, 1] != K:
            refill(room, side, b, K)
        beta = 2.0 * b
        slow = beta + math.sqrt(K) < SLOW
        last = e == events.shape[0]
        end = n if last else math.ceil(events[e, 0])
        while True:
            # the motion from t on: the samples of a block, if t is one, then to `target`
            u = y - rest
            m = v + beta * u
            here = slot if order == 0 else BLOCKS
            fill_coefficients(stack, here, active, slopes, side, beta, K, u, v, dy, dv)
            if t == i and i < end:
                block = min(i + LENGTH, end)
                shift, ur, vr, _, _ = reading_of(
                    order, 1.0 / interval, b, K, motion.w, rest, motion.offset, u, v, 0.0, 0.0
                )
                mr = vr + beta * ur
                if order > 0:
                    fill_reading(stack, here, slot, active, order, interval, beta, K)
                if data.size == 0:
                    write_rows(
                        stack, slot, active, tables, side, shift, ur, mr, values[i:block],
                        jacobian[i:block],
                    )  # fmt: skip
                else:
                    squares += sum_moments(
                        moments, slot, tables, side, data, i, block, shift, ur, mr
                    )
                    multiply(stack, products, slot, active, prefixes, side, block - i)
                slot += 1
                i = block
            if last and i == end:
                break
            to_event = i == end
            target = events[e, 0] if to_event else float(i)
            S, D, second, third = basis_at(tables, series, side, b, K, slow, target - t)
            carry(stack, here, active, beta, K, S, D, second, third, dy, dv)
            y, v = rest + D * u + S * m, D * v - S * (K * u)
            if slot == BLOCKS:
                slot = add_products(gram, stack, products, moments, slot, active, data.size)
            if to_event:
                break
            t = target
        if last:
            break
        t, y, v = events[e, 0], motion.gap, events[e, 1]
        jump = (q[C2] if contact else -q[C2]) * interval / mass
        for p in active:
            dv[p] += jump * dy[p]
        dv[G] -= jump
        dv[OFFSET] -= jump
        contact = not contact
    add_products(gram, stack, products, moments, slot, active, data.size)
    gram[RESIDUAL, RESIDUAL] += squares
