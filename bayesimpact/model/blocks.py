"""What becomes of a block: samples of one regime, a product of the table and one state.

u and v are the position relative to the rest, and the velocity, at the block's first sample; fs and
fc the force there (see `flow`); `shift` is added to the position.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.compiled import compiled

Floats = NDArray[np.float64]


@compiled()
def write(
    out: Floats, speeds: Floats, first: int, end: int, shift: float, tables: Floats, side: int,
    b: float, K: float, w: float, u: float, v: float, fs: float, fc: float,
) -> None:  # fmt: skip
    """Write positions (and velocities, if `speeds` has room) of samples first..end-1."""
    S, D, E, F = tables[side, 0], tables[side, 1], tables[side, 2], tables[side, 3]
    m = v + 2.0 * b * u
    if fs == 0.0 and fc == 0.0:
        for j in range(end - first):
            out[first + j] = shift + D[j] * u + S[j] * m
    else:
        for j in range(end - first):
            out[first + j] = shift + D[j] * u + S[j] * m + fs * E[j] + fc * F[j]
    if speeds.size:
        for j in range(end - first):
            speeds[first + j] = D[j] * v - S[j] * K * u
        if fs != 0.0 or fc != 0.0:
            for j in range(end - first):
                speeds[first + j] += fs * (S[j] - w * F[j]) + fc * w * E[j]


@compiled(forceinline=True, fastmath={"reassoc", "contract", "nsz"})
def squares(
    data: Floats, first: int, end: int, shift: float, tables: Floats, side: int,
    b: float, u: float, v: float,
) -> float:  # fmt: skip
    """Return the sum of squared residuals of one block, samples first..end-1, without forcing."""
    m = v + 2.0 * b * u
    total = 0.0
    # unsigned: numba then leaves out the check for negative indices, and the loop vectorises
    i, j, count = np.uint64(first), np.uint64(0), np.uint64(end - first)
    S, D, one = np.uint64(0), np.uint64(1), np.uint64(1)
    while j < count:
        r = data[i + j] - shift - (tables[side, D, j] * u + tables[side, S, j] * m)
        total += r * r
        j += one
    return total


@compiled(fastmath={"reassoc", "contract", "nsz"})
def squares_forced(
    data: Floats, first: int, end: int, shift: float, tables: Floats, side: int,
    b: float, u: float, v: float, fs: float, fc: float,
) -> float:  # fmt: skip
    """Return the sum of squared residuals of one block, samples first..end-1, with forcing."""
    S, D, E, F = tables[side, 0], tables[side, 1], tables[side, 2], tables[side, 3]
    m = v + 2.0 * b * u
    total = 0.0
    for j in range(end - first):
        r = data[first + j] - shift - (D[j] * u + S[j] * m + fs * E[j] + fc * F[j])
        total += r * r
    return total
