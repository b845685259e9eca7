"""The mode that contact forces excite, against matrix exponentials and textbook formulas."""

from __future__ import annotations

import numpy as np
import pytest
from effect_rigs import BY_ID, TestRig, moved
from scipy.linalg import expm

from bayesimpact.model.exact.simulate import simulate
from bayesimpact.model.general.second_mode import joint_response, polynomial_response


@pytest.mark.parametrize(
    ("b", "K", "beta", "W", "t"),
    [
        (2.0, 1e4, 3.0, 4e5, 1e-3),
        (2.0, 1e4, 2.0, 1e4, 0.05),  # equal modes: resonance
        (2.0, 1e4, 2.0, 1.0001e4, 0.05),
        (0.0, 1e4, 0.0, 1e4, 0.2),
        (200.0, 1e4, 3.0, 4e5, 0.02),  # an overdamped contact
        (2.0, 1e4, 900.0, 4e5, 0.02),  # an overdamped mode
        (2.0, 1e4, 10.0, 1e9, 1e-3),  # thirty radians between two samples
        (2.0, 1e4, 3.0, 4e5, 0.0),
    ],
)
def test_joint_response_is_the_matrix_exponential(b, K, beta, W, t):
    """u'' + 2 b u' + K u = 0 drives q'' + 2 beta q' + W q = u."""
    rates = np.zeros((4, 4))
    rates[0, 1], rates[1, :2] = 1.0, (-K, -2 * b)
    rates[2, 3], rates[3] = 1.0, (1.0, 0.0, -W, -2 * beta)
    flow = expm(rates * t)
    expected = [flow[0, 1], flow[1, 1], flow[2, 3], flow[3, 3], flow[2, 1], flow[3, 1]]
    scale = np.array([1 / np.sqrt(K), 1, 1 / np.sqrt(W), 1, 1 / np.sqrt(K) / W, 1 / np.sqrt(K * W)])
    found = np.array(joint_response(b, K, beta, W, t))
    np.testing.assert_allclose(found / scale, expected / scale, rtol=1e-11, atol=3e-12)


@pytest.mark.parametrize("t", [0.0, 1e-5, 8e-4, 1.2e-3, 0.03])
def test_polynomial_response_is_the_matrix_exponential(t):
    beta, W, force = 12.0, 3e5, np.array([0.7, -30.0, 4e3, 1e5])
    rates = np.zeros((6, 6))  # q, q', then s^3, s^2, s, 1
    rates[0, 1], rates[1] = 1.0, (-W, -2 * beta, *force[::-1])
    rates[2, 3], rates[3, 4], rates[4, 5] = 3.0, 2.0, 1.0
    expected = expm(rates * t) @ [1e-4, 0.02, 0.0, 0.0, 0.0, 1.0]
    found = polynomial_response(1e-4, 0.02, beta, W, *force, t)
    np.testing.assert_allclose(found, expected[:2], rtol=1e-11, atol=1e-14)


def added(rig: TestRig, frequency: float, damping: float, gain: float) -> np.ndarray:
    """What the mode adds to the reading of the first recording."""
    values = {"frequency": frequency, "damping": damping, "gain": gain}
    named = {f"second_mode.{key}": value for key, value in values.items()}
    return moved([BY_ID["second_mode"]], named, rig) - moved([], {}, rig)


def test_pressed_at_rest_it_takes_its_static_place():
    """The mass settles against an overdamped stop behind y = 0: q -> b F / w^2, F = -k1 y."""
    rig = TestRig(g=-2e-3, c2=40.0, k2=(5350.0,), y0=(-1.5e-3,), v0=(0.0,), duration=4.0)
    y = rig.k2[0] * rig.g / (rig.k1 + rig.k2[0])
    q = added(rig, 30.0, 0.05, 2.0)
    assert q[-1] == pytest.approx(2.0 * -rig.k1 * y / (2 * np.pi * 30.0) ** 2, rel=1e-9)


def test_a_contact_short_against_the_period_is_a_blow():
    """q' = b J after it, J = m (v + v') the momentum taken: free ringing from there."""
    rig = TestRig(
        mass=0.5, c1=0.0, k1=1e-9, c2=0.0, g=0.0, k2=(5e6,), y0=(-1e-3,), v0=(0.2,), duration=0.2
    )
    frequency, damping, gain = 7.0, 0.03, 0.4
    q = added(rig, frequency, damping, gain)
    w = 2 * np.pi * frequency
    wd = w * np.sqrt(1 - damping**2)
    middle = 1e-3 / 0.2 + 0.5 * np.pi * np.sqrt(rig.mass / rig.k2[0])
    since = np.arange(rig.count) / rig.rate - middle
    free = since > 2e-3
    ring = gain * 2 * rig.mass * 0.2 / wd * np.exp(-damping * w * since) * np.sin(wd * since)
    np.testing.assert_allclose(q[free], ring[free], rtol=0, atol=2e-4 * np.abs(ring[free]).max())
    assert np.abs(q[since < -2e-3]).max() < 1e-15


@pytest.mark.parametrize("frequency", [2.5, 18.2, 103.0, 1840.0])
def test_against_the_force_of_the_closed_form(frequency):
    """A convolution on a fine grid with the exact simulator's contact force, 1000 Hz readings."""
    rig, fine = TestRig(k2=(5350.0,), y0=(-6e-3,), v0=(0.0,), duration=0.3), 400
    exact = simulate(
        mass=rig.mass, c1=rig.c1, k1=rig.k1, c2=rig.c2, g=rig.g, k2=rig.k2[0], y0=rig.y0[0],
        v0=0.0, interval=1e-3 / fine, n=rig.count * fine,
    )  # fmt: skip
    assert exact.impacts.shape[0] >= 2
    force = rig.c2 * exact.velocity + rig.k2[0] * (exact.displacement - rig.g)
    force[exact.displacement < rig.g] = 0.0
    w, z = 2 * np.pi * frequency, 0.02
    t = exact.times
    ring = np.exp(-z * w * t) * np.sin(w * np.sqrt(1 - z * z) * t) / (w * np.sqrt(1 - z * z))
    size = 2 * t.size
    q = np.fft.irfft(np.fft.rfft(force, size) * np.fft.rfft(ring, size), size)[: t.size] * t[1]
    found = added(rig, frequency, z, 1.7)
    reach = np.abs(found).max()
    np.testing.assert_allclose(found, 1.7 * q[::fine], rtol=0, atol=3e-3 * reach)


def test_a_mode_that_does_not_exist_is_refused():
    for wrong in ({"frequency": 0.0}, {"frequency": -3.0}, {"damping": -0.1}):
        numbers = {"frequency": 50.0, "damping": 0.1, "gain": 1.0} | wrong
        assert np.all(np.isnan(added(TestRig(duration=0.2), **numbers)))
