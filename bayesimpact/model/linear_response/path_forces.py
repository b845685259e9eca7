"""Forces of laws along a motion that is given, without simulating it."""

from __future__ import annotations

from typing import Any

import numpy as np

from bayesimpact.model.jit.callback import call_law
from bayesimpact.model.jit.compiled import compiled
from bayesimpact.model.law_table import (
    CONTACT_ONLY,
    JUMP_AT_SURFACE,
    JUMP_AT_TURN,
    LAW_FIRST,
    LAW_FLAGS,
    LAW_FORCE,
    LAW_INITIAL,
    LAW_SURFACE,
)
from bayesimpact.model.linear_response.path_states import follow


@compiled(nogil=True)
def add_forces(
    law: Any, y: Any, v: Any, d: Any, t: Any, q: Any, rows: Any, out: Any
) -> None:  # fmt: skip
    """Add to the `rows` of out (K, n) a law's force for these rows of the slots q (K, Q).

    y, v, d, t (n,) are displacements, velocities, indentations and times; of a law with a memory
    they have to follow one another from a recording's first sample on.
    """
    base, size, place = q.ctypes.data, 8 * q.shape[1], 8 * law[LAW_FIRST]
    z = np.zeros(y.size)
    for row in rows:
        own = base + row * size
        z[0] = q[row, law[LAW_INITIAL]] if law[LAW_INITIAL] >= 0 else 0.0
        follow(law, y, v, d, t, own + place, own, z)
        for i in range(y.size):
            if d[i] > 0.0 or not law[LAW_FLAGS] & CONTACT_ONLY:
                out[row, i] += _force(law, y[i], v[i], d[i], t[i], z[i], own + place, own)


@compiled(nogil=True)
def _force(law: Any, y: Any, v: Any, d: Any, t: Any, z: Any, p: Any, q: Any) -> Any:
    touching = 1.0 if d > 0.0 else 0.0
    if law[LAW_FLAGS] & JUMP_AT_TURN:  # z tells the branch
        z = np.sign(v)
    if law[LAW_FLAGS] & JUMP_AT_SURFACE:
        side = np.sign(call_law(law[LAW_SURFACE], y, v, d, t, 0.0, touching, p, q))
        z = (z if side > 0.0 else 0.0) if law[LAW_FLAGS] & JUMP_AT_TURN else side
    return call_law(law[LAW_FORCE], y, v, d, t, z, touching, p, q)
