"""The base oscillator's compiled entry points, and its one Python door.

    m y'' + c1 y' + k1 y + [c2 y' + k2 (y - g)] H(y - g) = A sin(w t + phase)   (Eq. 6)

or, for a recording with a measured input u (`Inputs`, linear between samples), = A u(t). Per
recording the simulator takes q = (c1, k1, c2, g, k2, y0, v0, A, w, phase, offset), SI units, t = 0
at the first sample; measured = the displacement y, or y' or y'' (the recording's `order`), plus
offset. y'' jumps where a contact with damping begins or ends; a sample at that very instant reads
what follows. A campaign's parameter vector theta feeds the q of
every recording: q_i = theta[columns[r, i]], or constants[r, i] where columns[r, i] is -1. Without a
stop g = inf and c2 = k2 = 0.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from bayesimpact.data.short_repr import short_repr
from bayesimpact.errors import InputError, SimulationError
from bayesimpact.model.exact import batch as compiled_batch
from bayesimpact.model.exact import normalized
from bayesimpact.model.exact.arguments import (
    Inputs,
    ModelArguments,
    check_inputs,
    check_model,
    check_samples,
    floats,
    no_samples,
)
from bayesimpact.model.exact.batch import Floats, Ints
from bayesimpact.model.exact.normalized import Q
from bayesimpact.model.jit.workload import count

#: What a failure code means.
CODES: Mapping[int, str] = MappingProxyType(
    {
        normalized.OK: "ok",
        normalized.NOT_FINITE: "a parameter is not finite",
        normalized.BAD_MASS: "the mass is not positive",
        normalized.BAD_STIFFNESS: "k1 is not positive",
        normalized.BAD_DAMPING: "c1 is negative",
        normalized.BAD_CONTACT: "c2 or k2 is negative",
        normalized.BAD_GAP: "the gap is not a number, or minus infinity",
        normalized.BAD_FREQUENCY: "the forcing frequency is negative",
        normalized.BAD_SAMPLING: "the interval is not positive, or there are no samples",
        normalized.TOO_MANY_EVENTS: "too many impacts for the number of samples",
        normalized.SEARCH_FAILED: "the search for the next event did not converge",
        normalized.OVERFLOW: "the motion overflows",
    }
)


def sums_of_squares(
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
    """Compare a batch of parameter vectors with all recordings, in one compiled call.

    Parameters
    ----------
    theta : (B, d) parameter vectors, SI units
    columns : (R, 11) where each q of a recording stands in theta; -1: take `constants`
    constants : (R, 11) values of the q that are not in theta
    mass : kg
    samples : (N,) measured displacement, m (or its time derivative), of all recordings
    starts, counts : (R,) first sample and number of samples of every recording
    intervals : (R,) sampling intervals, s
    orders : (R,) which time derivative of the displacement is measured; None: 0 throughout
    inputs : measured forces, where recordings have any

    Returns
    -------
    (B, R) sums of (sample - offset - y)^2, m^2, inf where a simulation failed; (B, R) codes, see
    `CODES`. The numbers do not depend on the number of threads.
    """
    model = check_model(theta, columns, constants, intervals, counts, orders)
    data, first = check_samples(samples, starts, model)
    sse = np.empty((len(model.theta), len(model.columns)))
    codes = _work(model, mass, data, first, inputs, sse, np.empty((0, 0)))
    return sse, codes


def predictions(
    theta: ArrayLike,
    columns: ArrayLike,
    constants: ArrayLike,
    mass: float,
    counts: ArrayLike,
    intervals: ArrayLike,
    n_total: int,
    orders: ArrayLike | None = None,
    inputs: Inputs | None = None,
) -> tuple[Floats, Ints]:
    """Predict what every recording would measure, offset included.

    Parameters as in `sums_of_squares`; n_total is the sum of `counts`. Returns (B, n_total) values,
    m, recordings one after the other, nan where a simulation failed, and (B, R) codes.
    """
    model = check_model(theta, columns, constants, intervals, counts, orders)
    if int(model.counts.sum()) != n_total:
        raise InputError("n_total", str(n_total), f"the sum of counts, {model.counts.sum()}")
    values = np.empty((len(model.theta), n_total))
    codes = _work(model, mass, *no_samples(model), inputs, np.empty((0, 0)), values)
    return values, codes


def trajectory(q: ArrayLike, mass: float, interval: float, out: Floats) -> int:
    """Write the displacement (without the offset) of one recording into `out` (n,); return the
    code.

    q : (11,) parameters in the order of `normalized.Q`, SI units; interval in s; out in m.
    """
    values = np.array(q, dtype=np.float64)
    if values.shape != (11,):
        raise InputError("q", f"shape {values.shape}", "(11,)")
    values[10] = 0.0
    nothing, no_events = np.empty(0), np.empty((0, 2))
    no_data = floats("data", (), 1)
    _, _, code = compiled_batch.single(
        values, float(mass), float(interval), no_data, out, nothing, no_events
    )
    return int(code)


@dataclass(frozen=True, slots=True)
class Trajectory:
    """A simulated motion, SI units, read-only arrays.

    times, displacement, velocity : (n,) at the samples
    impacts : (k, 3) entry time (s), entry speed (m/s) and exit time (s) of every contact that
    begins after
        t = 0 and within the recording; nan as exit time of a contact that outlasts it
    """

    times: Floats
    displacement: Floats
    velocity: Floats
    impacts: Floats

    __repr__ = short_repr


def simulate(
    *,
    mass: float,
    c1: float,
    k1: float,
    c2: float = 0.0,
    g: float = np.inf,
    k2: float = 0.0,
    y0: float,
    v0: float,
    A: float = 0.0,
    w: float = 0.0,
    phase: float = 0.0,
    interval: float,
    n: int,
) -> Trajectory:
    """Simulate one recording exactly.

    Parameters
    ----------
    mass : kg
    c1, k1 : damping (N s/m) and stiffness (N/m) of the oscillator
    c2, g, k2 : damping (N s/m), gap (m, inf: no stop) and stiffness (N/m) of the stop
    y0, v0 : displacement (m) and velocity (m/s) at the first sample
    A, w, phase : the force A sin(w t + phase), N, rad/s, rad
    interval : s between samples
    n : number of samples

    Raises
    ------
    InputError : an argument is not a number, or not one that the model accepts
    SimulationError : the motion overflows or has too many impacts
    """
    named = {
        "c1": c1, "k1": k1, "c2": c2, "g": g, "k2": k2, "y0": y0, "v0": v0, "A": A, "w": w,
        "phase": phase,
    }  # fmt: skip
    q = np.array([_number(name, value) for name, value in named.items()] + [0.0])
    if isinstance(n, bool) or int(n) != n or n < 1:
        raise InputError("n", repr(n), "a whole number of samples, at least 1")
    mass, interval = _number("mass", mass), _number("interval", interval)
    displacement, velocity = np.empty(int(n)), np.empty(int(n))
    code = int(normalized.check(q, mass, interval, int(n)))
    if code != normalized.OK:
        raise InputError("simulate", CODES[code], "see the docstring of `simulate`")
    events = np.empty((1024, 2))
    _, count, code = compiled_batch.single(
        q, mass, interval, floats("data", (), 1), displacement, velocity, events
    )
    if count > len(events) and code == normalized.OK:
        events = np.empty((count, 2))
        _, count, code = compiled_batch.single(
            q, mass, interval, floats("data", (), 1), displacement, velocity, events
        )
    if code != normalized.OK:
        raise SimulationError(CODES[code])
    velocity /= interval
    events = events[:count] * (interval, 1.0 / interval)
    if len(events) and events[0, 1] < 0.0:  # the first event leaves the contact of the start
        events = events[1:]
    entries, exits = events[0::2], events[1::2]
    impacts = np.full((len(entries), 3), np.nan)
    impacts[:, :2] = entries
    impacts[: len(exits), 2] = exits[:, 0]
    times: Floats = np.arange(int(n), dtype=np.float64) * interval
    for array in (times, displacement, velocity, impacts):
        array.flags.writeable = False
    return Trajectory(times, displacement, velocity, impacts)


def _work(
    model: ModelArguments, mass: float, data: Floats, first: Ints, inputs: Inputs | None,
    sse: Floats, values: Floats,
) -> Ints:  # fmt: skip
    batch, recordings = len(model.theta), len(model.columns)
    count(batch * int(model.counts.sum()), "closed form")
    codes = np.empty((batch, recordings), dtype=np.int64)
    arguments = (
        model.theta, model.columns, model.constants, float(mass), data, first, model.counts,
        model.intervals, model.orders, *check_inputs(inputs, model),
    )  # fmt: skip
    parts = compiled_batch.parts(batch, int(model.counts.sum()))
    if parts == 1:
        compiled_batch.work(*arguments, (0, batch), (0, recordings), sse, values, codes)
    else:
        compiled_batch.work_in_parts(*arguments, parts, sse, values, codes)
    return codes


def _number(name: str, value: object) -> float:
    if isinstance(value, bool | complex | str) or not np.isscalar(value):
        raise InputError(name, repr(value), "a number")
    return float(value)  # type: ignore[arg-type]


__all__ = [
    "CODES", "Q", "Trajectory", "predictions", "simulate", "sums_of_squares", "trajectory",
]  # fmt: skip
