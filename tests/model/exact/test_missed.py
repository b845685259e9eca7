"""No impact is missed: every stretch between two events is walked again on a fine grid.

In flight the motion must stay below the stop, in contact beyond it, peaks between grid points
included, and every event must lie where the stretch says. A missed impact deeper than 1e-11 of the
amplitude would break this (peaks are interpolated to that accuracy).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import naive
import numpy as np
import pytest
import systems

from bayesimpact.model.exact.sensitivities.derivatives import find_events
from bayesimpact.model.exact.tables import response_tables

TOLERANCE = 1e-11


def worst_excess(system: systems.System) -> tuple[float, int]:
    """Largest breach of a regime, relative to the amplitude; and the number of events."""
    q, mass = system.q, system.mass
    events, code = find_events(
        q,
        mass,
        system.interval,
        system.n,
        np.empty(0),
        np.empty((64, 2)),
        response_tables(),
        np.empty((3, 0)),
        -1,
    )
    assert code == 0, system
    w1 = math.sqrt(q[1] / mass)
    end = (system.n - 1) * system.interval
    contact = naive.begins_in_contact(q)
    t, y, v = 0.0, q[5], q[6]
    scale = max(abs(y), abs(v) / w1, abs(q[7]) / q[1], 1e-300)
    worst = 0.0
    for time, speed in [*(events * (system.interval, 1 / system.interval)), (end, None)]:
        sign = -1 if contact else 1
        times, ys, vs = naive.dense(q, mass, contact, t, y, v, time - t)
        if q[3] < math.inf and (q[2] > 0 or q[4] > 0):
            inside = sign * (ys[1:-1] - q[3])
            worst = max(worst, inside.max(initial=0.0) / scale)
            tops = naive.vertex(times[1] - times[0], sign * (ys - q[3]), sign * vs)
            peaks = (sign * vs[:-1] > 0) & (sign * vs[1:] < 0) & (tops > -1e-6 * scale)
            for i in np.nonzero(peaks)[0]:
                fine = naive.dense(
                    q, mass, contact, times[i], ys[i], vs[i], times[1] - times[0], 64
                )
                worst = max(worst, (sign * (fine[1] - q[3])).max() / scale)
        if speed is not None:
            assert sign * speed > 0.0, system
            worst = max(worst, abs(ys[-1] - q[3]) / scale, abs(vs[-1] - speed) / (w1 * scale))
        t, y, v, contact = time, q[3], speed, not contact
    return worst, len(events)


def check(draw: Callable[[np.random.Generator], systems.System], count: int, seed: int) -> int:
    rng = np.random.default_rng(seed)
    found = [(*worst_excess(system), system) for system in (draw(rng) for _ in range(count))]
    worst = max(found, key=lambda row: row[0])
    assert worst[0] < TOLERANCE, worst
    return sum(row[1] for row in found)


@pytest.mark.long
def test_no_impact_missed_sample() -> None:
    assert check(systems.draw, 700, 20) > 3_000
    assert check(systems.draw_fine, 300, 22) > 2_000


@pytest.mark.slow
def test_no_impact_missed() -> None:
    assert check(systems.draw, 70_000, 21) > 300_000
    assert check(systems.draw_fine, 30_000, 23) > 200_000
