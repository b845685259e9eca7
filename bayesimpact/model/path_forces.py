"""Forces of laws along a motion that is given, without simulating it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.added.context import (
    CONTACT_ONLY,
    JUMP_AT_SURFACE,
    JUMP_AT_TURN,
    LAW_FIRST,
    LAW_FLAGS,
    LAW_FORCE,
    LAW_RATE,
    LAW_SURFACE,
    LAW_TRAVEL,
)
from bayesimpact.model.callback import call_law
from bayesimpact.model.compiled import compiled

Array = NDArray[np.float64]
Index = NDArray[np.int64]


def has_memory(law: Index) -> bool:
    """Whether the force of a law (a row of `Oscillator.laws`) depends on more than the moment."""
    return bool(law[LAW_RATE] or law[LAW_TRAVEL])


@compiled(nogil=True)
def add_forces(
    law: Any, y: Any, v: Any, d: Any, t: Any, q: Any, rows: Any, out: Any
) -> None:  # fmt: skip
    """Add to the `rows` of out (K, n) a law's force for these rows of the slots q (K, Q).

    y, v, d, t (n,) are displacements, velocities, indentations and times. The law has no memory.
    """
    base, size, place = q.ctypes.data, 8 * q.shape[1], 8 * law[LAW_FIRST]
    for i in range(y.size):
        if d[i] <= 0.0 and law[LAW_FLAGS] & CONTACT_ONLY:
            continue
        for row in rows:
            own = base + row * size
            out[row, i] += _force(law, y[i], v[i], d[i], t[i], own + place, own)


@compiled(nogil=True)
def _force(law: Any, y: Any, v: Any, d: Any, t: Any, p: Any, q: Any) -> Any:
    touching = 1.0 if d > 0.0 else 0.0
    z = 0.0  # which branch of a force that jumps
    if law[LAW_FLAGS] & JUMP_AT_TURN:
        z = np.sign(v)
    if law[LAW_FLAGS] & JUMP_AT_SURFACE:
        z = np.sign(call_law(law[LAW_SURFACE], y, v, d, t, 0.0, touching, p, q))
    return call_law(law[LAW_FORCE], y, v, d, t, z, touching, p, q)
