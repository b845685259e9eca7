"""What becomes of the samples of one regime: products of the table and one state.

u and v are the position relative to the rest, and the velocity, at the first sample; fs and fc the
force there (see `flow`); `shift` is added to the position.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.exact.flow import advance, advance_forced, forced_response, impulse_response
from bayesimpact.model.exact.normalized import NormalizedParameters
from bayesimpact.model.exact.tables import LENGTH
from bayesimpact.model.jit.compiled import inner

Floats = NDArray[np.float64]


class Sink(NamedTuple):
    """Where a simulated recording goes; every array may be empty.

    data (n,) : measured displacement, m, to be compared with
    out (n,), speeds (n,) : receive y + offset, m, and y', per interval, when `data` is empty
    events (capacity, 2) : receives times and velocities of the first events, in intervals
    order : data and out are this time derivative of y (0, 1 or 2), in m/s^order; speeds need 0
    rate : sampling intervals per second
    """

    data: Floats
    out: Floats
    speeds: Floats
    events: Floats
    order: int
    rate: float


@inner(forceinline=True, fastmath={"contract"})
def reading_of(
    order: int, rate: float, b: float, K: float, w: float, rest: float, offset: float,
    u: float, v: float, fs: float, fc: float,
) -> tuple[float, float, float, float, float]:  # fmt: skip
    """Return the shift and the motion (u, v, fs, fc) that the probe reads of this motion.

    The time derivative of a motion u'' + 2 b u' + K u = fs cos + fc sin is one again, and is
    written or compared like a displacement.
    """
    if order == 0:
        return rest + offset, u, v, fs, fc
    for _ in range(order):
        u, v = rate * v, rate * (fs - 2.0 * b * v - K * u)
        fs, fc = rate * w * fc, -rate * w * fs
    return offset, u, v, fs, fc


@inner(forceinline=True, fastmath={"contract"})
def write(
    out: Floats, first: int, end: int, shift: float, tables: Floats, side: int, b: float, u: float,
    v: float,
) -> None:  # fmt: skip
    """Write positions of samples first..end-1 of one block, without forcing."""
    m = v + 2.0 * b * u
    # unsigned: numba then leaves out the check for negative indices, and the loop vectorises
    i, j, count = np.uint64(first), np.uint64(0), np.uint64(end - first)
    S, D, one = np.uint64(0), np.uint64(1), np.uint64(1)
    while j < count:
        out[i + j] = shift + (tables[side, D, j] * u + tables[side, S, j] * m)
        j += one


@inner()
def add_force(
    out: Floats, first: int, end: int, tables: Floats, side: int, fs: float, fc: float
) -> None:
    """Add to positions of one block what the force does."""
    for j in range(end - first):
        out[first + j] += fs * tables[side, 2, j] + fc * tables[side, 3, j]


@inner()
def write_speeds(
    speeds: Floats, first: int, end: int, tables: Floats, side: int, K: float, w: float,
    u: float, v: float, fs: float, fc: float,
) -> None:  # fmt: skip
    """Write velocities of one block, per interval."""
    S, D, E, F = tables[side, 0], tables[side, 1], tables[side, 2], tables[side, 3]
    for j in range(end - first):
        speeds[first + j] = D[j] * v - S[j] * K * u
    if fs != 0.0 or fc != 0.0:
        for j in range(end - first):
            speeds[first + j] += fs * (S[j] - w * F[j]) + fc * w * E[j]


@inner(forceinline=True, fastmath={"reassoc", "contract", "nsz"})
def squares(
    data: Floats, first: int, end: int, shift: float, tables: Floats, side: int,
    b: float, u: float, v: float,
) -> float:  # fmt: skip
    """Return the sum of squared residuals of one block, samples first..end-1, without forcing."""
    m = v + 2.0 * b * u
    total = 0.0
    i, j, count = np.uint64(first), np.uint64(0), np.uint64(end - first)
    S, D, one = np.uint64(0), np.uint64(1), np.uint64(1)
    while j < count:
        r = data[i + j] - shift - (tables[side, D, j] * u + tables[side, S, j] * m)
        total += r * r
        j += one
    return total


@inner(fastmath={"reassoc", "contract", "nsz"})
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


@inner(forceinline=True, fastmath={"contract"})
def pass_plain(
    data: Floats, out: Floats, speeds: Floats, tables: Floats, side: int, b: float, K: float,
    shift: float, u: float, v: float, i: int, end: int,
) -> float:  # fmt: skip
    """Write or compare samples i..end-1 of an unforced stretch with state (u, v) at sample i.

    Returns their sum of squared residuals, if they were compared.
    """
    compared, written = data.size > 0, out.size > 0
    total = 0.0
    while i < end:
        block = min(i + LENGTH, end)
        if compared:
            total += squares(data, i, block, shift, tables, side, b, u, v)
        elif written:
            write(out, i, block, shift, tables, side, b, u, v)
            if speeds.size > 0:
                write_speeds(speeds, i, block, tables, side, K, 0.0, u, v, 0.0, 0.0)
        u, v = advance(b, K, u, v, tables[side, 0, LENGTH], tables[side, 1, LENGTH])
        i = block
    return total


@inner()
def pass_samples(
    sink: Sink, tables: Floats, side: int, motion: NormalizedParameters, b: float, K: float,
    rest: float, t: float, u: float, v: float, i: int, end: int,
) -> float:  # fmt: skip
    """Write or compare samples i..end-1 of any stretch with state (u, v) at time t <= i.

    Returns their sum of squared residuals, if they were compared.
    """
    data, out, speeds = sink.data, sink.out, sink.speeds
    if i >= end or data.size + out.size == 0:
        return 0.0
    w, phase, force = motion.w, motion.phase, motion.force
    order, rate, offset = sink.order, sink.rate, motion.offset
    S, D = impulse_response(b, K, i - t)
    if force == 0.0:
        u, v = advance(b, K, u, v, S, D)
        shift, u, v, fs, fc = reading_of(order, rate, b, K, w, rest, offset, u, v, 0.0, 0.0)
        total: float = pass_plain(data, out, speeds, tables, side, b, K, shift, u, v, i, end)
        return total
    fs, fc = force * math.sin(w * t + phase), force * math.cos(w * t + phase)
    E, F = forced_response(b, K, w, i - t, S, D)
    total = 0.0
    while True:
        u, v = advance_forced(b, K, w, u, v, fs, fc, S, D, E, F)
        fs, fc = force * math.sin(w * i + phase), force * math.cos(w * i + phase)
        block = min(i + LENGTH, end)
        shift, ur, vr, fsr, fcr = reading_of(order, rate, b, K, w, rest, offset, u, v, fs, fc)
        if data.size > 0:
            total += squares_forced(data, i, block, shift, tables, side, b, ur, vr, fsr, fcr)
        else:
            write(out, i, block, shift, tables, side, b, ur, vr)
            add_force(out, i, block, tables, side, fsr, fcr)
            if speeds.size > 0:
                write_speeds(speeds, i, block, tables, side, K, w, u, v, fs, fc)
        if block == end:
            return total
        i = block
        S, D = tables[side, 0, LENGTH], tables[side, 1, LENGTH]
        E, F = tables[side, 2, LENGTH], tables[side, 3, LENGTH]
