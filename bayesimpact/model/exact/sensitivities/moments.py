"""What the samples of a block contribute: residuals times the basis, or rows of J.

The residuals' products with the basis are all that the samples are needed for; the basis's products
with itself are summed once per regime (`prefix_grams`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.exact.sensitivities.basis import D_, G_, H_, ONE, S_
from bayesimpact.model.jit.compiled import inner

Floats = NDArray[np.float64]
Columns = NDArray[np.uint64]


@inner()
def prefix_grams(prefixes: Floats, tables: Floats, side: int) -> None:
    """Fill prefixes[side] (LENGTH + 1, basis, basis): sums over j < n of products of table rows."""
    size = tables.shape[1]
    for k in range(size):
        for m in range(k, size):
            total = 0.0
            prefixes[side, 0, k, m] = prefixes[side, 0, m, k] = 0.0
            for n in range(tables.shape[2]):
                total += tables[side, k, n] * tables[side, m, n]
                prefixes[side, n + 1, k, m] = prefixes[side, n + 1, m, k] = total


@inner(fastmath={"reassoc", "contract", "nsz"})
def sum_moments(
    moments: Floats, slot: int, tables: Floats, side: int, data: Floats, first: int, end: int,
    shift: float, u: float, m: float,
) -> float:  # fmt: skip
    """Write into moments[slot] the residuals of samples first..end-1 times the basis.

    Returns the sum of their squares. u, m : coefficients of D and S in the motion.
    """
    one = g = h = s = d = total = 0.0
    # unsigned: numba then leaves out the check for negative indices, and the loop vectorises
    i, j, count, step = np.uint64(first), np.uint64(0), np.uint64(end - first), np.uint64(1)
    row_S, row_D, row_G, row_H = np.uint64(S_), np.uint64(D_), np.uint64(G_), np.uint64(H_)
    while j < count:
        S, D = tables[side, row_S, j], tables[side, row_D, j]
        r = data[i + j] - shift - (D * u + S * m)
        one += r
        s += r * S
        d += r * D
        g += r * tables[side, row_G, j]
        h += r * tables[side, row_H, j]
        total += r * r
        j += step
    moments[slot, ONE], moments[slot, S_], moments[slot, D_] = one, s, d
    moments[slot, G_], moments[slot, H_] = g, h
    return total


@inner(fastmath={"contract"})
def write_rows(
    stack: Floats, slot: int, active: Columns, tables: Floats, side: int, shift: float, u: float,
    m: float, values: Floats, jacobian: Floats,
) -> None:  # fmt: skip
    """Write the values (n,) and the rows of J (n, 11) of one block."""
    table = tables[side]
    for j in range(values.size):
        values[j] = shift + table[D_, j] * u + table[S_, j] * m
    for i in active:
        for j in range(values.size):
            total = (
                stack[i, slot, ONE]
                + stack[i, slot, S_] * table[S_, j]
                + stack[i, slot, D_] * table[D_, j]
            )
            jacobian[j, i] = (
                total + stack[i, slot, G_] * table[G_, j] + stack[i, slot, H_] * table[H_, j]
            )
