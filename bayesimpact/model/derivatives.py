"""Exact derivatives of the base oscillator's recordings, through the impacts.

With respect to all eleven q of a recording (see `simulate`); arguments as in `simulate`. First the
event loop finds the events, then one pass carries the sensitivities from block to block (`sweep`).
Derivatives with respect to q that are constants (columns -1) are left 0.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import ArrayLike

from bayesimpact.errors import InputError
from bayesimpact.model import batch as compiled_batch
from bayesimpact.model.arguments import check_model, check_samples
from bayesimpact.model.basis import FORCED, PLAIN
from bayesimpact.model.batch import Floats, Ints, Span, gather, share
from bayesimpact.model.blocks import Sink
from bayesimpact.model.compiled import compiled
from bayesimpact.model.kernel import run
from bayesimpact.model.scaled import OK, OVERFLOW, begins_in_contact
from bayesimpact.model.sweep import Lanes, desk, sweep
from bayesimpact.model.tables import Shelf, shelf

#: Events for which there is room at first; a recording with more is run once more.
EVENTS = 256


@compiled()
def wanted(active: Lanes, columns: Ints, forced: bool) -> Lanes:
    """Return those q of one recording, columns (11,), whose derivatives are wanted, in `active`.

    The force's are only there with the basis for it.
    """
    count = 0
    for i in range(11):
        if columns[i] >= 0 and (forced or i < 7 or i == 10):
            active[count] = i
            count += 1
    return active[:count]


@compiled()
def find_events(
    q: Floats, mass: float, interval: float, n: int, events: Floats, mine: Shelf
) -> tuple[Floats, int]:
    """Return (events, code): all events of one recording, in `events` if there is room."""
    nothing = np.empty(0)
    _, count, code = run(q, mass, interval, n, Sink(nothing, nothing, nothing, events), mine)
    if count > events.shape[0] and code == OK:
        events = np.empty((count, 2))
        run(q, mass, interval, n, Sink(nothing, nothing, nothing, events), mine)
    return events[:count], code


@compiled()
def gram_share(
    theta: Floats, columns: Ints, constants: Floats, mass: float, samples: Floats, starts: Ints,
    counts: Ints, intervals: Floats, size: int, rows: Span, items: Span, out: Floats, codes: Ints,
) -> None:  # fmt: skip
    """Fill one share of `out` (B, R, 12, 12) and `codes` (B, R)."""
    q = np.empty(11)
    nothing, no_matrix = np.empty(0), np.empty((0, 0))
    active = np.empty(11, dtype=np.uint64)
    first_events = np.empty((EVENTS, 2))
    mine = shelf()
    room = desk(size, True)
    for b in range(rows[0], rows[1]):
        for r in range(items[0], items[1]):
            gather(q, theta[b], columns[r], constants[r])
            n = counts[r]
            gram = out[b, r]
            gram[:] = 0.0
            events, code = find_events(q, mass, intervals[r], n, first_events, mine)
            if code == OK:
                sweep(
                    q, mass, intervals[r], n, events, begins_in_contact(q),
                    wanted(active, columns[r], size > PLAIN), samples[starts[r] : starts[r] + n],
                    nothing, no_matrix, gram, room,
                )  # fmt: skip
                if not math.isfinite(gram.sum()):
                    code = OVERFLOW
            codes[b, r] = code
            if code != OK:
                gram[:] = np.nan


@compiled(parallel=True)
def gram_parts(
    theta: Floats, columns: Ints, constants: Floats, mass: float, samples: Floats, starts: Ints,
    counts: Ints, intervals: Floats, size: int, parts: int, out: Floats, codes: Ints,
) -> None:  # fmt: skip
    """Fill `out` (B, R, 12, 12) and `codes` (B, R), shares in parallel."""
    for part in numba.prange(parts):
        rows, items = share(part, parts, codes.shape[0], codes.shape[1])
        gram_share(
            theta, columns, constants, mass, samples, starts, counts, intervals, size, rows, items,
            out, codes,
        )  # fmt: skip


@compiled()
def derivative_rows(
    theta: Floats, columns: Ints, constants: Floats, mass: float, counts: Ints, intervals: Floats,
    size: int, values: Floats, jacobian: Floats, codes: Ints,
) -> None:  # fmt: skip
    """Fill `values` (N,), `jacobian` (N, 11) and `codes` (R,) for one theta (d,)."""
    q = np.empty(11)
    nothing, no_matrix = np.empty(0), np.empty((0, 0))
    active = np.empty(11, dtype=np.uint64)
    first_events = np.empty((EVENTS, 2))
    mine = shelf()
    room = desk(size, False)
    start = 0
    for r in range(columns.shape[0]):
        gather(q, theta, columns[r], constants[r])
        n = counts[r]
        own, rows = values[start : start + n], jacobian[start : start + n]
        rows[:] = 0.0
        events, code = find_events(q, mass, intervals[r], n, first_events, mine)
        if code == OK:
            sweep(
                q, mass, intervals[r], n, events, begins_in_contact(q),
                wanted(active, columns[r], size > PLAIN), nothing, own, rows, no_matrix, room,
            )  # fmt: skip
            if not (math.isfinite(own.sum()) and math.isfinite(rows.sum())):
                code = OVERFLOW
        codes[r] = code
        if code != OK:
            own[:] = np.nan
            rows[:] = np.nan
        start += n


def trajectories_and_derivatives(
    theta: ArrayLike,
    columns: ArrayLike,
    constants: ArrayLike,
    mass: float,
    counts: ArrayLike,
    intervals: ArrayLike,
    n_total: int,
) -> tuple[Floats, Floats, Ints]:
    """Predict all recordings, offset included, with the derivatives of every sample.

    theta (d,); the other parameters as in `simulate.predictions`.

    Returns
    -------
    (n_total,) values, m; (n_total, 11) derivatives with respect to the q of the recording, SI
    units, 0 for the q that are constants; (R,) codes. Failed recordings are nan.
    """
    model = check_model(np.atleast_2d(np.asarray(theta)), columns, constants, intervals, counts)
    if len(model.theta) != 1:
        raise InputError("theta", f"shape {model.theta.shape}", "one parameter vector")
    if int(model.counts.sum()) != n_total:
        raise InputError("n_total", str(n_total), f"the sum of counts, {model.counts.sum()}")
    values, jacobian = np.empty(n_total), np.empty((n_total, 11))
    codes = np.empty(len(model.columns), dtype=np.int64)
    derivative_rows(
        model.theta[0], model.columns, model.constants, float(mass), model.counts, model.intervals,
        _basis_size(model.columns, model.constants), values, jacobian, codes,
    )  # fmt: skip
    return values, jacobian, codes


def grams(
    theta: ArrayLike,
    columns: ArrayLike,
    constants: ArrayLike,
    mass: float,
    samples: ArrayLike,
    starts: ArrayLike,
    counts: ArrayLike,
    intervals: ArrayLike,
) -> tuple[Floats, Ints]:
    """Gram matrices of [J | residual] of every recording, without storing J.

    theta (B, d) or (d,); the other parameters as in `simulate.sums_of_squares`. residual = sample -
    prediction, and J its prediction's derivative with respect to the eleven q.

    Returns
    -------
    (B, R, 12, 12) Gram matrices (SI units; rows of constant q are 0, failed ones nan) and (B, R)
    codes; without the leading B for a theta (d,).
    """
    thetas = np.atleast_2d(np.asarray(theta, dtype=np.float64))
    model = check_model(thetas, columns, constants, intervals, counts)
    data, first = check_samples(samples, starts, model)
    batch, recordings = len(model.theta), len(model.columns)
    out = np.empty((batch, recordings, 12, 12))
    codes = np.empty((batch, recordings), dtype=np.int64)
    arguments = (
        model.theta, model.columns, model.constants, float(mass), data, first, model.counts,
        model.intervals, _basis_size(model.columns, model.constants),
    )  # fmt: skip
    parts = compiled_batch.parts(batch, int(model.counts.sum()))
    if parts == 1:
        gram_share(*arguments, (0, batch), (0, recordings), out, codes)
    else:
        gram_parts(*arguments, parts, out, codes)
    if np.ndim(theta) == 1:
        return out[0], codes[0]
    return out, codes


def _basis_size(columns: Ints, constants: Floats) -> int:
    """Derivatives with respect to the force are wanted also where it is 0."""
    forced = np.any(columns[:, 7] >= 0) or np.any(constants[:, 7] != 0.0)
    return FORCED if forced else PLAIN
