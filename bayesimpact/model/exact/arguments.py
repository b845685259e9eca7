"""Arguments of the compiled entry points, checked and brought to one type each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bayesimpact.errors import InputError
from bayesimpact.model.exact.batch import Floats, Ints
from bayesimpact.model.jit.compiled import compiled

#: No recording is longer.
LONGEST = 2**62


@dataclass(frozen=True, slots=True)
class ModelArguments:
    """theta (B, d), columns, constants (R, 11), intervals, counts, orders (R,), all read-only."""

    theta: Floats
    columns: Ints
    constants: Floats
    intervals: Floats
    counts: Ints
    orders: Ints


@dataclass(frozen=True, eq=False)
class Inputs:
    """Measured inputs of recordings, for a gain of 1.

    Attributes
    ----------
    values : (3, M), recordings one after the other, see `driven.Wave`: forces at the samples, N,
        between which the force on the mass is a line; the forces that accelerations hold, N; what
        an input adds to the readings themselves. (M,): the first, which is then the second as well,
        and nothing is added
    starts : (R,) where a recording's input begins in `values`, -1 for a recording without one
    """

    values: Floats
    starts: Ints

    def __post_init__(self) -> None:
        if self.values.ndim == 1:
            plain = np.stack([self.values, self.values, np.zeros(self.values.size)])
            object.__setattr__(self, "values", plain)

    def of(self, recordings: Ints) -> Inputs:
        """The same for these recordings (K,), in this order."""
        return Inputs(self.values, self.starts[recordings])

    def of_motion(self) -> Inputs:
        """The same without what is added to readings: for motions, which are relative to a base."""
        if not self.values[2].any():
            return self
        return Inputs(self.values * [[1.0], [1.0], [0.0]], self.starts)


def check_inputs(inputs: Inputs | None, model: ModelArguments) -> tuple[Floats, Ints]:
    """Values and starts, checked; raises InputError."""
    if inputs is None:
        return floats("inputs", np.empty((3, 0)), 2), ints(
            "inputs", np.full(model.counts.size, -1), 1
        )
    values, starts = floats("inputs", inputs.values, 2), ints("inputs", inputs.starts, 1)
    if starts.size != model.counts.size:
        found = f"{starts.size} starts"
        raise InputError("inputs", found, f"{model.counts.size}, one per recording")
    ends = starts + model.counts
    if not within(starts, -1, LONGEST) or np.any(ends[starts >= 0] > values.shape[1]):
        raise InputError("inputs", "an input beyond the values", f"within 0..{values.shape[1]}")
    return values, starts


def check_model(
    theta: ArrayLike,
    columns: ArrayLike,
    constants: ArrayLike,
    intervals: ArrayLike,
    counts: ArrayLike,
    orders: ArrayLike | None = None,
) -> ModelArguments:
    """Check shapes and columns (see `simulate`); raises InputError."""
    model = ModelArguments(
        floats("theta", theta, 2),
        ints("columns", columns, 2),
        floats("constants", constants, 2),
        floats("intervals", intervals, 1),
        ints("counts", counts, 1),
        ints("orders", np.zeros(np.size(counts)) if orders is None else orders, 1),
    )
    recordings = model.columns.shape[0]
    shapes = (
        ("columns", model.columns.shape, (recordings, 11)),
        ("constants", model.constants.shape, (recordings, 11)),
        ("intervals", model.intervals.shape, (recordings,)),
        ("counts", model.counts.shape, (recordings,)),
        ("orders", model.orders.shape, (recordings,)),
    )
    for name, found, expected in shapes:
        if found != expected:
            raise InputError(name, f"shape {found}", f"shape {expected}")
    width = model.theta.shape[1]
    if not within(model.columns.reshape(-1), -1, width - 1):
        raise InputError("columns", "an index outside theta", f"-1 to {width - 1}")
    if not within(model.counts, 1, LONGEST):
        raise InputError("counts", "a recording without samples", "at least 1")
    if not within(model.orders, 0, 2):
        raise InputError("orders", "an unknown time derivative", "0, 1 or 2")
    return model


def check_samples(
    samples: ArrayLike, starts: ArrayLike, model: ModelArguments
) -> tuple[Floats, Ints]:
    """Check that every recording lies within the samples; raises InputError."""
    data, first = floats("samples", samples, 1), ints("starts", starts, 1)
    if first.size != model.counts.size:
        raise InputError(
            "starts", f"{first.size} values", f"{model.counts.size}, one per recording"
        )
    if not (within(first, 0, LONGEST) and within(first + model.counts, 0, data.size)):
        raise InputError("starts", "recordings beyond the samples", f"within 0..{data.size}")
    return data, first


def no_samples(model: ModelArguments) -> tuple[Floats, Ints]:
    """Stand in for samples and starts where recordings are written, one behind the other."""
    return floats("samples", (), 1), ints("starts", np.cumsum(model.counts) - model.counts, 1)


@compiled()
def within(values: Ints, low: int, high: int) -> bool:
    """Say whether all values (n,) lie in [low, high]; the reductions of numpy take microseconds."""
    for value in values:  # noqa: SIM110
        if value < low or value > high:
            return False
    return True


def floats(name: str, values: ArrayLike, ndim: int) -> Floats:
    """Return a read-only, contiguous (float64) view or copy of `values`."""
    view: Floats = _read_only(name, np.ascontiguousarray(values, dtype=np.float64), ndim)
    return view


def ints(name: str, values: ArrayLike, ndim: int) -> Ints:
    """Return a read-only, contiguous (int64) view or copy of `values`."""
    view: Ints = _read_only(name, np.ascontiguousarray(values, dtype=np.int64), ndim)
    return view


def _read_only(name: str, array: Any, ndim: int) -> Any:
    # read-only always, so that one compiled version serves writable and read-only arrays alike
    if array.ndim != ndim:
        raise InputError(name, f"{array.ndim} dimensions", str(ndim))
    view = array.view()
    view.setflags(write=False)
    return view
