"""Pendulums that swing far: against the elliptic integral and against the independent rig."""

from __future__ import annotations

import numpy as np
import pytest
from effect_rigs import BY_ID, TestRig, by_hand, by_rig, moved
from scipy.special import ellipk

SINE, SPRING = BY_ID["pendulum_sine"], BY_ID["pendulum_with_spring"]
# 1 m, 0.5 kg
PENDULUM = TestRig(
    mass=0.5, c1=0.004, k1=4.905, k2=(), y0=(-1.2, -0.5), v0=(0.0, 0.3), rate=100.0, duration=20.0
)


def swinging(angle: float, **changes: object) -> TestRig:
    return TestRig(**{**PENDULUM.__dict__, "y0": (-angle,), "v0": (0.0,), **changes})


@pytest.mark.parametrize("angle", [0.3, 1.0, 2.0, 2.5, 2.9])
def test_period(angle):
    """T = 4 K(sin^2(a / 2)) / w."""
    T = 4 * ellipk(np.sin(angle / 2) ** 2) / np.sqrt(PENDULUM.k1 / PENDULUM.mass)
    rig = swinging(angle, c1=0.0, rate=40 / T, duration=10.1 * T)
    y = moved([SINE], {}, rig)
    tolerance = (1e-6 if angle > 2.5 else 5e-8) * angle  # next to the top small errors grow fast
    np.testing.assert_allclose(y[::40], -angle, rtol=0, atol=tolerance)
    np.testing.assert_allclose(y[10::20], 0.0, rtol=0, atol=tolerance)


@pytest.mark.parametrize("angle", [0.3, 1.2, 2.5])
@pytest.mark.parametrize("rate", [20.0, 100.0, 1000.0])
def test_independent_rig(angle, rate):
    rig = swinging(angle, rate=rate)
    difference = moved([SINE], {}, rig) - by_rig([SINE], {}, rig)
    assert np.abs(difference).max() < 5e-8 * angle


def test_naive_twin():
    rig = swinging(2.0, duration=6.0)
    assert np.abs(moved([SINE], {}, rig) - by_hand([SINE], {}, rig)).max() < 1e-7
    assert np.abs(moved([SINE], {}, rig) - moved([], {}, rig)).max() > 0.5


@pytest.mark.parametrize("share", [0.3, 1.0, 1.5])
def test_with_a_spring(share):
    """All of k1 is gravity's: a plain pendulum; more than all: a spring that pushes away."""
    rig = swinging(1.2)
    values = {"pendulum_with_spring.stiffness": share * rig.k1}
    y = moved([SPRING], values, rig)
    assert np.abs(y - by_rig([SPRING], values, rig)).max() < 6e-8
    plain = np.abs(y - moved([SINE], {}, rig)).max()
    assert plain < 1e-9 if share == 1.0 else plain > 0.1


def test_pendulum_against_a_stop():
    rig = TestRig(
        mass=0.5, c1=0.004, k1=4.905, c2=0.2, g=0.15, k2=(300.0,), y0=(-1.0,), v0=(0.0,),
        rate=200.0, duration=10.0,
    )  # fmt: skip
    assert np.abs(moved([SINE], {}, rig) - by_rig([SINE], {}, rig)).max() < 5e-8
