"""What effects do to energy.

Conservative ones have the period that their potential says, the others lose from swing to swing.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from effect_rigs import BY_ID, MOVING, TestRig, moved, typical
from scipy.integrate import quad
from scipy.optimize import brentq

UNDAMPED = TestRig(c1=0.0, c2=0.0, k2=(5350.0,), y0=(-6.5e-3,), v0=(0.0,), duration=2.0)
POTENTIALS: dict[str, Callable[[float, dict[str, float]], float]] = {
    "contact_hardening": lambda y, p: p["stiffness"] * beyond(y) ** 4 / 4,
    "contact_power_law": lambda y, p: (
        UNDAMPED.k2[0]
        * (
            1e-6 * (beyond(y) / 1e-3) ** (p["exponent"] + 1) / (p["exponent"] + 1)
            - beyond(y) ** 2 / 2
        )
    ),
    "contact_second_stage": lambda y, p: p["stiffness"] * max(beyond(y) - p["depth"], 0.0) ** 2 / 2,
    "spring_quadratic": lambda y, p: p["stiffness"] * y**3 / 3,
    "spring_cubic": lambda y, p: p["stiffness"] * y**4 / 4,
    "spring_quintic": lambda y, p: p["stiffness"] * y**6 / 6,
    "pendulum_with_spring": lambda y, p: p["stiffness"] * (y**6 / 720 - y**4 / 24),
    "opposite_stop": lambda y, p: p["stiffness"] * max(-y - p["gap"], 0.0) ** 2 / 2,
}


def beyond(y: float) -> float:
    return max(y - UNDAMPED.g, 0.0)


def period(potential: Callable[[float], float], kinks: list[float]) -> float:
    """Period of the undamped motion released at rest from y0, by quadrature over the energy."""
    y0 = UNDAMPED.y0[0]
    energy = potential(y0)
    y1 = brentq(lambda y: potential(y) - energy, 0.0, 0.02, xtol=1e-18, rtol=1e-15)
    middle, half = 0.5 * (y0 + y1), 0.5 * (y1 - y0)

    def slowness(angle: float) -> float:
        y = middle + half * np.sin(angle)
        left = 2 * (energy - potential(y)) / UNDAMPED.mass
        return half * np.cos(angle) / np.sqrt(left)

    angles = [float(np.arcsin((k - middle) / half)) for k in kinks]
    edges = [-np.pi / 2 + 1e-7, *sorted(angles), np.pi / 2 - 1e-7]
    pieces = pairwise(edges)
    total = sum(quad(slowness, a, b, epsabs=0, epsrel=1e-12, limit=200)[0] for a, b in pieces)
    ends = 2e-7 * slowness(edges[0])  # the integrand is flat where the motion turns
    return 2 * total + ends + 2e-7 * slowness(edges[-1])


def test_every_conservative_force_has_its_potential_here():
    forces = {e.id for e in MOVING if e.energy == "conserves" and not e.id.startswith("gap_")}
    forces -= {"pendulum_sine"}  # pendulum_with_spring without a parameter
    assert forces == set(POTENTIALS)


@pytest.mark.parametrize("name", POTENTIALS)
def test_period(name):
    """After whole periods the motion is back where it began: nothing lost, never late."""
    effect = BY_ID[name]
    values = typical(effect, UNDAMPED)
    numbers = {p.name: values[f"{name}.{p.name}"] for p in effect.parameters}

    def potential(y: float) -> float:
        base = UNDAMPED.k1 * y * y / 2 + UNDAMPED.k2[0] * beyond(y) ** 2 / 2
        return base + POTENTIALS[name](y, numbers)

    kinks = [UNDAMPED.g]
    if name == "contact_second_stage":
        kinks.append(UNDAMPED.g + numbers["depth"])
    if name == "opposite_stop":
        kinks.append(-numbers["gap"])
    T = period(potential, kinks)
    rig = TestRig(
        c1=0.0, c2=0.0, k2=(5350.0,), y0=(-6.5e-3,), v0=(0.0,), rate=100 / T, duration=12 * T
    )
    y = moved([effect], values, rig)
    assert y.max() > rig.g + 1e-3
    # near the turning point the displacement is stationary: compare half-way as well
    np.testing.assert_allclose(y[::100], rig.y0[0], rtol=0, atol=1e-9)
    np.testing.assert_allclose(y[25::100], y[25], rtol=0, atol=2e-8)


# one obstacle alone does not differ from others; modes give back what they took from a swing
GIVE_BACK = {"contact_damping_per_case", "obstacle_mode", "base_motion"}


def lower_turns(y: np.ndarray) -> np.ndarray:
    """Displacements at the turning points far from the stop, by parabolas through samples."""
    i = np.flatnonzero((y[1:-1] < y[:-2]) & (y[1:-1] <= y[2:]) & (y[1:-1] < 0)) + 1
    left, here, right = y[i - 1], y[i], y[i + 1]
    return here - (right - left) ** 2 / (8 * (left - 2 * here + right))


@pytest.mark.parametrize(
    "effect",
    [e for e in MOVING if e.energy == "dissipates" and e.id not in GIVE_BACK],
    ids=lambda e: e.id,
)
def test_amplitudes_decrease(effect):
    """Without other damping (but c2 for an obstacle that cannot pull) every swing is smaller."""
    c2 = 2.0 if effect.id == "contact_no_tension" else 0.0
    rig = TestRig(c1=0.0, c2=c2, k2=(5350.0,), y0=(-6.5e-3,), v0=(0.0,), rate=10000.0, duration=1.5)
    if c2 == 0.0:
        still = lower_turns(moved([], {}, rig))
        np.testing.assert_allclose(still, rig.y0[0], rtol=0, atol=1e-11)
    turns = lower_turns(moved([effect], typical(effect, rig), rig))
    assert turns.size > 6
    assert np.all(np.diff(turns) > 1e-7)
    assert np.all(turns < 0)
