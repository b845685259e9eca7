"""A light impact on a heavy obstacle, whose reaction is positive for less than a step, if at all.

The contact is linear, so that its end follows from matrix exponentials: the reaction's summit and
its way through zero, or the way back through the gap.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from effect_rigs import BY_ID, TestRig, moved
from scipy.linalg import expm
from scipy.optimize import brentq, minimize_scalar

OBSTACLE, K2, UNTIL = 0.025, 3000.0, 0.02
EFFECTS = [BY_ID["obstacle_mass"], BY_ID["contact_second_stage"]]
# a stage that is out of reach: the steps are then those of an oscillator with a law
VALUES = {
    "obstacle_mass.mass": OBSTACLE,
    "contact_second_stage.depth": 1e-3,
    "contact_second_stage.stiffness": 100.0,
}


def flow(mass: float, c: float, k: float, rest: float) -> Callable[[np.ndarray, float], np.ndarray]:
    """State (y, v) after a time, of mass y'' + c y' + k (y - rest) = 0."""
    matrix, middle = np.array([[0.0, 1.0], [-k / mass, -c / mass]]), np.array([rest, 0.0])
    return lambda state, t: middle + expm(t * matrix) @ (state - middle)


def first_root(f: Callable[[float], float], *bracket: float) -> float:
    return float(brentq(f, *bracket, xtol=1e-16, rtol=1e-14))


def exact(rig: TestRig) -> tuple[float, float]:
    """Displacement, m, at the last sample, and the summit of the obstacle's reaction, N."""
    m, both = rig.mass, rig.mass + OBSTACLE
    free = flow(m, rig.c1, rig.k1, 0.0)
    touching = flow(both, rig.c1 + rig.c2, rig.k1 + K2, K2 * rig.g / (rig.k1 + K2))

    def reaction(state: np.ndarray) -> float:
        y, v = state
        push, other = rig.c2 * v + K2 * (y - rig.g), rig.c1 * v + rig.k1 * y
        return float(m * push - OBSTACLE * other) / both

    start = np.array([rig.y0[0], rig.v0[0]])
    touch = first_root(lambda t: free(start, t)[0] - rig.g, 0.0, 2e-3)
    begun = free(start, touch) * [1.0, m / both]
    summit = minimize_scalar(
        lambda t: -reaction(touching(begun, t)), bounds=(1e-6, 8e-3), options={"xatol": 1e-9}
    )
    if summit.fun < 0.0:
        over = first_root(lambda t: reaction(touching(begun, t)), summit.x, 12e-3)
    else:
        over = first_root(lambda t: touching(begun, t)[0] - rig.g, summit.x, 20e-3)
    last = (rig.count - 1) / rig.rate
    return float(free(touching(begun, over), last - touch - over)[0]), -summit.fun


@pytest.mark.parametrize("before", [1e-7, 1e-6, 2e-6, 3e-6])
def test_brief_push(before: float) -> None:
    summits = []
    for speed in np.linspace(0.0074, 0.0084, 21):
        rig = TestRig(k2=(K2,), y0=(1.1e-3 - before,), v0=(speed,), duration=UNTIL)
        last, summit = exact(rig)
        assert moved(EFFECTS, VALUES, rig)[-1] == pytest.approx(last, rel=0, abs=1e-12)
        summits.append(summit)
    assert min(summits) < 0.0 < max(summits)  # both kinds of contact
