"""Rest under dry friction."""

from __future__ import annotations

from typing import Any

import numpy as np

from bayesimpact.model.general.contact_state import (
    SLIDING,
    holding_force,
    may_step,
    static_force,
)
from bayesimpact.model.general.context import AHEAD, FORCE, NOW
from bayesimpact.model.general.dense import input_reading
from bayesimpact.model.general.flows import flow_from
from bayesimpact.model.general.memory import keep_memory, relax_one
from bayesimpact.model.general.resonator import fastest_body, relax_bodies
from bayesimpact.model.general.second_mode import added_reading, listens, respond_at_rest
from bayesimpact.model.jit.compiled import inner


@inner()
def stick(y: Any, t: Any, j: Any, w: Any) -> Any:
    """Rest under dry friction until the other forces exceed it: (t, next sample)."""
    second, shown = listens(w), y if w.order == 0 else 0.0
    if w.size == 0 and w.q[FORCE] == 0.0 and fastest_body(True, w) == 0.0:
        for i in range(j, w.n):
            if second:
                respond_at_rest(y, t, i * w.interval - t, NOW, w)
                t = i * w.interval
            w.out[i] = shown + added_reading(y, 0.0, t, w)
        return t, w.n
    flow, longest = flow_from(y, 0.0, t, w)
    most = holding_force(y, t, w)
    while j < w.n:
        h = j * w.interval - t
        cuts = max(int(np.ceil(h / longest)), 1)
        h /= cuts
        if not may_step(w):
            w.out[j] = np.nan
            return t, w.n
        force = pull_at(y, t, h, flow, w)
        if abs(force) > most:
            low, high = 0.0, h
            for _ in range(60):
                middle = 0.5 * (low + high)
                force = pull_at(y, t, middle, flow, w)
                if abs(force) > most:
                    high = middle
                else:
                    low = middle
            w.s[SLIDING] = np.sign(pull_at(y, t, high, flow, w))
            if second:
                respond_at_rest(y, t, high, AHEAD, w)
            keep_memory(w)
            return t + high, j
        if second:
            respond_at_rest(y, t, h, AHEAD, w)
        keep_memory(w)
        t += h
        if cuts == 1:
            t = j * w.interval
            w.out[j] = shown + added_reading(y, 0.0, t, w) + input_reading(j, 0.0, w)
            j += 1
    return t, j


@inner()
def pull_at(y: Any, t: Any, dt: Any, flow: Any, w: Any) -> Any:
    """Force on the mass after a rest of dt, N, dry friction apart."""
    for law in range(w.size):
        relax_one(law, AHEAD, y, 0.0, t, dt, flow, w)
    relax_bodies(AHEAD, y, dt, flow.touching == 1.0, flow.gap, w)
    return static_force(y, t + dt, AHEAD, w)
