"""Batches of parameter vectors over all recordings of a campaign, compiled, on one or more cores.

Arguments as in the doors of `simulate`. `rows` and `items` bound the parameter vectors and the
recordings of one share of the work; every number is computed within one share, in one order, so
that results do not depend on how the work is shared out.
"""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.exact.blocks import Sink
from bayesimpact.model.exact.driven import run_driven, wave_of
from bayesimpact.model.exact.loop import run
from bayesimpact.model.exact.tables import ResponseTables, response_tables
from bayesimpact.model.jit.compiled import compiled, inner
from bayesimpact.model.jit.threads import SHARES_PER_THREAD, available

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Span = tuple[int, int]

#: Fewer samples than this are done before other threads are awake.
THREADED_SAMPLES = 100_000


def parts(batch: int, samples: int) -> int:
    """Return into how many shares a job of `batch` x `samples` samples is cut."""
    threads = available()
    if threads == 1 or batch * samples < THREADED_SAMPLES:
        return 1
    return min(SHARES_PER_THREAD * threads, max(batch, threads))


@compiled()
def share(part: int, parts: int, batch: int, recordings: int) -> tuple[Span, Span]:
    """Return the rows and the recordings of one of `parts` equal shares of the work."""
    if batch >= parts:
        return (part * batch // parts, (part + 1) * batch // parts), (0, recordings)
    return (0, batch), (part * recordings // parts, (part + 1) * recordings // parts)


@inner()
def gather(q: Floats, theta: Floats, columns: Ints, constants: Floats) -> None:
    """Fill q (11,) of one recording from theta and the constants."""
    for i in range(11):
        column = columns[i]
        q[i] = theta[column] if column >= 0 else constants[i]


@inner()
def run_any(
    q: Floats, mass: float, interval: float, n: int, sink: Sink, mine: ResponseTables,
    waves: Floats, wave: int,
) -> tuple[float, int, int]:  # fmt: skip
    """Simulate a recording of n samples, whose input begins at waves[wave]; -1: it has none."""
    if wave >= 0:
        done: tuple[float, int, int] = run_driven(q, mass, interval, wave_of(waves, wave, n), sink)
    else:
        done = run(q, mass, interval, n, sink, mine)
    return done


@compiled()
def work(
    theta: Floats, columns: Ints, constants: Floats, mass: float, samples: Floats, starts: Ints,
    counts: Ints, intervals: Floats, orders: Ints, waves: Floats, first_wave: Ints, rows: Span,
    items: Span, sse: Floats, values: Floats, codes: Ints,
) -> None:  # fmt: skip
    """Fill one share of `codes` (B, R), and of `sse` (B, R) or, without samples, `values` (B, N).

    starts : where a recording begins in `samples` or `values`
    waves, first_wave : inputs (3, M), see `driven.Wave`, and where a recording's begins in them,
        see `run_any`
    """
    q = np.empty(11)
    nothing = np.empty(0)
    no_events = np.empty((0, 2))
    mine = response_tables()
    for b in range(rows[0], rows[1]):
        for r in range(items[0], items[1]):
            gather(q, theta[b], columns[r], constants[r])
            first, end = starts[r], starts[r] + counts[r]
            if samples.size:
                sink = Sink(
                    samples[first:end], nothing, nothing, no_events, orders[r], 1.0 / intervals[r]
                )
                sse[b, r], _, codes[b, r] = run_any(
                    q, mass, intervals[r], counts[r], sink, mine, waves, first_wave[r]
                )
            else:
                out = values[b, first:end]
                sink = Sink(samples, out, nothing, no_events, orders[r], 1.0 / intervals[r])
                _, _, codes[b, r] = run_any(
                    q, mass, intervals[r], counts[r], sink, mine, waves, first_wave[r]
                )
                if codes[b, r] != 0:
                    out[:] = np.nan


@compiled(parallel=True)
def work_in_parts(
    theta: Floats, columns: Ints, constants: Floats, mass: float, samples: Floats, starts: Ints,
    counts: Ints, intervals: Floats, orders: Ints, waves: Floats, first_wave: Ints, parts: int,
    sse: Floats,
    values: Floats, codes: Ints,
) -> None:  # fmt: skip
    """As `work`, all shares, in parallel; numba's threads wake up sooner than Python's."""
    for part in numba.prange(parts):
        rows, items = share(part, parts, codes.shape[0], codes.shape[1])
        work(
            theta, columns, constants, mass, samples, starts, counts, intervals, orders, waves,
            first_wave, rows, items, sse, values, codes,
        )  # fmt: skip


@compiled()
def single(
    q: Floats, mass: float, interval: float, no_data: Floats, out: Floats, speeds: Floats,
    events: Floats,
) -> tuple[float, int, int]:  # fmt: skip
    """Simulate one recording into `out`, `speeds` and `events` (see `Sink`); as `kernel.run`."""
    sink = Sink(no_data, out, speeds, events, 0, 1.0)
    done: tuple[float, int, int] = run(q, mass, interval, out.size, sink, response_tables())
    return done
