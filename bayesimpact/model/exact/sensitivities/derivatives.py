"""Exact derivatives of the base oscillator's recordings, through the impacts.

With respect to all eleven q of a recording (see `simulate`); arguments as in `simulate`. First the
event loop finds the events, then `free_pass` carries the derivatives from block to block.
Derivatives with respect to q that are constants (columns -1) are left 0.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from bayesimpact.errors import InputError
from bayesimpact.model.exact import batch as compiled_batch
from bayesimpact.model.exact.arguments import (
    Inputs,
    ModelArguments,
    check_inputs,
    check_model,
    check_samples,
    no_samples,
)
from bayesimpact.model.exact.batch import Floats, Ints, Span, gather, run_any
from bayesimpact.model.exact.blocks import Sink
from bayesimpact.model.exact.driven import wave_of
from bayesimpact.model.exact.normalized import OK, OVERFLOW, PHASE, A
from bayesimpact.model.exact.sensitivities.driven_pass import driven_sensitivity_pass
from bayesimpact.model.exact.sensitivities.free_pass import Columns, sensitivity_pass, workspace
from bayesimpact.model.exact.tables import ResponseTables, response_tables
from bayesimpact.model.jit.compiled import compiled, inner
from bayesimpact.model.jit.threads import in_shares
from bayesimpact.model.jit.workload import count

#: Events for which there is room at first, at least, and samples for one more; a recording with
#: more of them is run once more.
EVENTS = 256
SAMPLES_PER_EVENT = 8


@inner()
def wanted(active: Columns, columns: Ints) -> Columns:
    """Return those q of one recording, columns (11,), whose derivatives are wanted, in `active`."""
    count = 0
    for i in range(11):
        if columns[i] >= 0 and not A <= i <= PHASE:
            active[count] = i
            count += 1
    return active[:count]


@compiled()
def find_events(
    q: Floats, mass: float, interval: float, n: int, no_data: Floats, events: Floats,
    mine: ResponseTables, waves: Floats, wave: int,
) -> tuple[Floats, int]:  # fmt: skip
    """Return (events, code): all events of one recording, in `events` if there is room."""
    nothing = np.empty(0)
    sink = Sink(no_data, nothing, nothing, events, 0, 1.0)
    _, count, code = run_any(q, mass, interval, n, sink, mine, waves, wave)
    if count > events.shape[0] and code == OK:
        events = np.empty((count, 2))
        sink = Sink(no_data, nothing, nothing, events, 0, 1.0)
        run_any(q, mass, interval, n, sink, mine, waves, wave)
    return events[:count], code


@compiled(nogil=True)
def work(
    theta: Floats, columns: Ints, constants: Floats, mass: float, samples: Floats, starts: Ints,
    counts: Ints, intervals: Floats, orders: Ints, waves: Floats, first_wave: Ints,
    rows: Span, items: Span, out: Floats, values: Floats, jacobian: Floats, codes: Ints,
) -> None:  # fmt: skip
    """Fill one share of `codes` (B, R), and of the Gram matrices `out` (B, R, 12, 12).

    Without samples, and for one theta, fill `values` (N,) and `jacobian` (N, 11) instead. What
    belongs to a failed simulation becomes nan.
    """
    q = np.empty(11)
    unused = np.empty((12, 12))
    active = np.empty(11, dtype=np.uint64)
    longest = counts[items[0] : items[1]].max() if items[1] > items[0] else 0
    first_events = np.empty((EVENTS + longest // SAMPLES_PER_EVENT, 2))
    mine, room = response_tables(), workspace(samples.size > 0)
    for b in range(rows[0], rows[1]):
        for r in range(items[0], items[1]):
            gather(q, theta[b], columns[r], constants[r])
            n = counts[r]
            first, end = starts[r], starts[r] + n
            if samples.size:
                data, gram, own, slopes = samples[first:end], out[b, r], values, jacobian
            else:
                data, gram = samples, unused
                own, slopes = values[first:end], jacobian[first:end]
            gram[:] = 0.0
            slopes[:] = 0.0
            wave = first_wave[r]
            events, code = find_events(
                q, mass, intervals[r], n, samples[:0], first_events, mine, waves, wave
            )
            if code == OK:
                if wave >= 0:
                    driven_sensitivity_pass(
                        q, mass, intervals[r], orders[r], wave_of(waves, wave, n), events,
                        columns[r], data, own, slopes, gram,
                    )  # fmt: skip
                else:
                    sensitivity_pass(
                        q, mass, intervals[r], n, orders[r], events,
                        wanted(active, columns[r]), data, own, slopes, gram, room,
                    )  # fmt: skip
                if not math.isfinite(gram.sum() + own.sum() + slopes.sum()):
                    code = OVERFLOW
            if code != OK:
                gram[:] = np.nan
                own[:] = np.nan
                slopes[:] = np.nan
            codes[b, r] = code


def trajectories_and_derivatives(
    theta: ArrayLike,
    columns: ArrayLike,
    constants: ArrayLike,
    mass: float,
    counts: ArrayLike,
    intervals: ArrayLike,
    n_total: int,
    orders: ArrayLike | None = None,
    inputs: Inputs | None = None,
) -> tuple[Floats, Floats, Ints]:
    """Predict all recordings, offset included, with the derivatives of every sample.

    theta (d,); the other parameters as in `simulate.predictions`.

    Returns
    -------
    (n_total,) values, m; (n_total, 11) derivatives with respect to the q of the recording, SI
    units, 0 for the q that are constants; (R,) codes. Failed recordings are nan.
    """
    thetas = np.atleast_2d(np.asarray(theta))
    model = check_model(thetas, columns, constants, intervals, counts, orders)
    if len(model.theta) != 1:
        raise InputError("theta", f"shape {model.theta.shape}", "one parameter vector")
    if int(model.counts.sum()) != n_total:
        raise InputError("n_total", str(n_total), f"the sum of counts, {model.counts.sum()}")
    values, jacobian = np.empty(n_total), np.empty((n_total, 11))
    codes = _work(
        model, mass, *no_samples(model), inputs, np.empty((0, 0, 12, 12)), values, jacobian
    )
    return values, jacobian, codes[0]


def grams(
    theta: ArrayLike,
    columns: ArrayLike,
    constants: ArrayLike,
    mass: float,
    samples: ArrayLike,
    starts: ArrayLike,
    counts: ArrayLike,
    intervals: ArrayLike,
    orders: ArrayLike | None = None,
    inputs: Inputs | None = None,
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
    model = check_model(thetas, columns, constants, intervals, counts, orders)
    data, first = check_samples(samples, starts, model)
    out = np.empty((len(model.theta), len(model.columns), 12, 12))
    codes = _work(model, mass, data, first, inputs, out, np.empty(0), np.empty((0, 11)))
    if np.ndim(theta) == 1:
        return out[0], codes[0]
    return out, codes


def _work(
    model: ModelArguments, mass: float, data: Floats, first: Ints, inputs: Inputs | None,
    out: Floats, values: Floats, jacobian: Floats,
) -> Ints:  # fmt: skip
    batch, recordings = len(model.theta), len(model.columns)
    count(batch * int(model.counts.sum()), "derivatives")
    codes = np.empty((batch, recordings), dtype=np.int64)
    waves, first_wave = check_inputs(inputs, model)
    harmonic = (model.columns[:, A] >= 0) | (model.constants[:, A] != 0.0)
    if np.any(harmonic & (first_wave < 0)):
        raise InputError("derivatives", "a harmonic force", "no force, or a measured input")
    before = (
        model.theta, model.columns, model.constants, float(mass), data, first, model.counts,
        model.intervals, model.orders, waves, first_wave,
    )  # fmt: skip

    by_rows = batch >= recordings

    def run(start: int, stop: int) -> None:
        rows, items = (start, stop), (0, recordings)
        if not by_rows:
            rows, items = (0, batch), (start, stop)
        work(*before, rows, items, out, values, jacobian, codes)

    size = batch if by_rows else recordings
    if compiled_batch.parts(batch, int(model.counts.sum())) == 1:
        run(0, size)
    else:
        in_shares(run, size)
    return codes
