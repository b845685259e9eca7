"""Batches of parameter vectors over all recordings of a campaign, compiled, on one or more cores.

Arguments as in the doors of `simulate`. `rows` and `items` bound the parameter vectors and the
recordings of one share of the work; every number is computed within one share, in one order, so
that results do not depend on how the work is shared out.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.blocks import Sink
from bayesimpact.model.compiled import compiled
from bayesimpact.model.kernel import run
from bayesimpact.model.tables import shelf
from bayesimpact.model.threads import SHARES_PER_THREAD, available, in_shares

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Span = tuple[int, int]

#: Fewer samples than this are not worth waking other threads for.
SAMPLES_WORTH_THREADS = 100_000


def share_out(work: Callable[[Span, Span], None], batch: int, recordings: int, n: int) -> None:
    """Call work(rows, items) until all of `batch` x `recordings` is done; n samples in all.

    A large batch is shared out by its rows, a small one by recordings.
    """
    everything = (0, batch), (0, recordings)
    if available() == 1 or batch * n < SAMPLES_WORTH_THREADS:
        work(*everything)
    elif batch >= SHARES_PER_THREAD * available():
        in_shares(lambda first, end: work((first, end), everything[1]), batch)
    else:
        in_shares(lambda first, end: work(everything[0], (first, end)), recordings)


@compiled()
def gather(q: Floats, theta: Floats, columns: Ints, constants: Floats) -> None:
    """Fill q (11,) of one recording from theta and the constants."""
    for i in range(11):
        column = columns[i]
        q[i] = theta[column] if column >= 0 else constants[i]


@compiled(nogil=True)
def work(
    theta: Floats, columns: Ints, constants: Floats, mass: float, samples: Floats, starts: Ints,
    counts: Ints, intervals: Floats, rows: Span, items: Span, sse: Floats, values: Floats,
    codes: Ints,
) -> None:  # fmt: skip
    """Fill one share of `codes` (B, R), and of `sse` (B, R) or, without samples, `values` (B, N).

    starts : where a recording begins in `samples` or `values`
    """
    q = np.empty(11)
    nothing = np.empty(0)
    no_events = np.empty((0, 2))
    mine = shelf()
    for b in range(rows[0], rows[1]):
        for r in range(items[0], items[1]):
            gather(q, theta[b], columns[r], constants[r])
            first, end = starts[r], starts[r] + counts[r]
            if samples.size:
                sink = Sink(samples[first:end], nothing, nothing, no_events)
                sse[b, r], _, codes[b, r] = run(q, mass, intervals[r], counts[r], sink, mine)
            else:
                out = values[b, first:end]
                sink = Sink(samples, out, nothing, no_events)
                _, _, codes[b, r] = run(q, mass, intervals[r], counts[r], sink, mine)
                if codes[b, r] != 0:
                    out[:] = np.nan


@compiled()
def single(
    q: Floats, mass: float, interval: float, no_data: Floats, out: Floats, speeds: Floats,
    events: Floats,
) -> tuple[float, int, int]:  # fmt: skip
    """Simulate one recording into `out`, `speeds` and `events` (see `Sink`); as `kernel.run`."""
    sink = Sink(no_data, out, speeds, events)
    done: tuple[float, int, int] = run(q, mass, interval, out.size, sink, shelf())
    return done
