"""Many trajectories in one compiled call: one row per slot vector, whatever its recording.

`orders` (K,) says which time derivative of the displacement a row is to hold: 0, 1 or 2.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.exact.arguments import Inputs
from bayesimpact.model.exact.simulate import predictions
from bayesimpact.model.general.loop import integrate_many
from bayesimpact.model.jit.workload import count
from bayesimpact.model.parameters import BASE_SLOTS

Array = NDArray[np.float64]
Counts = NDArray[np.int64]

_OFFSET = BASE_SLOTS.index("offset")


def motions(
    q: Array, mass: float, counts: Counts, intervals: Array, orders: Counts,
    inputs: Inputs | None = None,
) -> Array:  # fmt: skip
    """True displacements (K, max counts), m (or derivatives), of base oscillators, slots (K, 11).

    `inputs` are the rows' measured forces, where they have any. Rows are NaN where the parameters
    are inadmissible, and beyond their own count.
    """
    base = q.copy()
    base[:, _OFFSET] = 0.0
    columns = np.arange(base.size, dtype=np.int64).reshape(base.shape)
    total = int(counts.sum())
    flat, codes = predictions(
        base.reshape(1, -1),
        columns,
        np.zeros(base.shape),
        mass,
        counts,
        intervals,
        total,
        orders,
        inputs,
    )
    shape = (q.shape[0], int(counts.max()))
    if total == shape[0] * shape[1]:
        out = flat.reshape(shape)
    else:
        out = np.full(shape, np.nan)
        out[np.arange(shape[1]) < counts[:, None]] = flat[0]
    out[codes[0] != 0] = np.nan
    return out


def general_motions(
    q: Array,
    mass: float,
    counts: Counts,
    intervals: Array,
    laws: NDArray[np.int64],
    orders: Counts,
    inputs: Inputs | None = None,
    restarts: Sequence[Array] = (),
) -> Array:
    """The same for oscillators with added effects: slots (K, Q), table of laws (L, LAW_COLUMNS).

    Every row may begin anew, see `integrate_many`.
    """
    out = np.empty((q.shape[0], int(counts.max())))
    count(int(counts.sum()), "general")
    codes = integrate_many(
        q, mass, intervals, counts, laws, out, inputs, orders=orders, restarts=restarts
    )
    out[np.arange(out.shape[1]) >= counts[:, None]] = np.nan
    out[codes != 0] = np.nan
    return out
