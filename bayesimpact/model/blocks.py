"""What becomes of the samples of one regime: products of the table and one state.

u and v are the position relative to the rest, and the velocity, at the first sample; fs and fc the
force there (see `flow`); `shift` is added to the position.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.compiled import compiled
from bayesimpact.model.flow import advance_forced, forced_response, impulse_response
from bayesimpact.model.scaled import Scaled
from bayesimpact.model.tables import LENGTH

Floats = NDArray[np.float64]


class Sink(NamedTuple):
    """Where a simulated recording goes; every array may be empty.

    data (n,) : measured displacement, m, to be compared with
    out (n,), speeds (n,) : receive y + offset, m, and y', per interval, when `data` is empty
    events (capacity, 2) : receives times and velocities of the first events, in intervals
    """

    data: Floats
    out: Floats
    speeds: Floats
    events: Floats


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


@compiled()
def pass_samples(
    sink: Sink, tables: Floats, side: int, motion: Scaled, b: float, K: float, rest: float,
    t: float, u: float, v: float, i: int, end: int,
) -> float:  # fmt: skip
    """Write or compare samples i..end-1 of a stretch that starts at (u, v) at time t <= i.

    Returns their sum of squared residuals, if they were compared.
    """
    compared = sink.data.size > 0
    if i >= end or not (compared or sink.out.size > 0):
        return 0.0
    w, force = motion.w, motion.force
    shift = rest + motion.offset
    total = E = F = fs = fc = 0.0
    S, D = impulse_response(b, K, i - t)
    if force != 0.0:
        fs, fc = force * math.sin(w * t + motion.phase), force * math.cos(w * t + motion.phase)
        E, F = forced_response(b, K, w, i - t, S, D)
    while True:
        u, v = advance_forced(b, K, w, u, v, fs, fc, S, D, E, F)
        if force != 0.0:
            fs, fc = force * math.sin(w * i + motion.phase), force * math.cos(w * i + motion.phase)
        block = min(i + LENGTH, end)
        if not compared:
            write(sink.out, sink.speeds, i, block, shift, tables, side, b, K, w, u, v, fs, fc)
        elif force != 0.0:
            total += squares_forced(sink.data, i, block, shift, tables, side, b, u, v, fs, fc)
        else:
            total += squares(sink.data, i, block, shift, tables, side, b, u, v)
        if block == end:
            return total
        i = block
        S, D = tables[side, 0, LENGTH], tables[side, 1, LENGTH]
        if force != 0.0:
            E, F = tables[side, 2, LENGTH], tables[side, 3, LENGTH]
