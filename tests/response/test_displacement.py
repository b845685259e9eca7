"""The displacement behind a velocity or an acceleration, against the motion it came from."""

from __future__ import annotations

import numpy as np
import pytest
import small_rig

from bayesimpact.inference.initial.estimates import estimate
from bayesimpact.response.displacement import displacement
from bayesimpact.response.half_cycles import spectral_period
from bayesimpact.trial.rig.recordings import motion

NOISE = {1: 2e-4, 2: 2e-2}
STIFF = small_rig.Rig(0.503, 0.148, 808.556, 2.085, 1.1e-3, {"1": 8e4})


@pytest.fixture(scope="module")
def moved():
    return motion(small_rig.RIG, small_rig.RELEASES[0], rate=1000.0, duration=3.0)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("bias", [0.0, 3.0])
def test_displacement(moved, order, bias):
    true = (moved.displacement, moved.velocity, moved.acceleration)[order]
    rng = np.random.default_rng(order)
    reading = true + NOISE[order] * rng.standard_normal(true.size) + bias
    found = displacement(reading, 1e-3, order)
    error = found.samples - moved.displacement
    # The middle may be off by what the mean over whole cycles is off; the shape is not.
    assert np.std(error) < 0.01 * np.ptp(moved.displacement)
    assert abs(error.mean()) < 0.02 * np.ptp(moved.displacement)
    assert found.bias == pytest.approx(bias, abs=0.02 * np.ptp(true))
    assert found.noise == pytest.approx(NOISE[order], rel=0.3)


def test_what_a_dashpot_pulls_for_an_instant_is_no_half_cycle():
    """Between two stops flights are short; at the end of a contact the acceleration turns over."""
    second = {"spring_piecewise": {"stiffness": 14000.0, "gap": 1.4e-3, "damping": 4.0}}
    rig = small_rig.Rig(0.25, 0.25, 300.0, 3.0, 1e-3, {"1": 9000.0})
    moved = motion(rig, small_rig.Release("r", "1", -2e-4, 0.35), second, rate=5000.0, duration=0.5)
    for seed in (1, 2, 3):
        noise = 0.15 * np.random.default_rng(seed).standard_normal(moved.acceleration.size)
        found = displacement(moved.acceleration + noise, 2e-4, 2, both=True)
        error = found.samples - moved.displacement
        assert np.std(error) < 0.04 * np.ptp(moved.displacement)
        assert np.abs(error).max() < 0.2 * np.ptp(moved.displacement)


def test_a_displacement_is_itself(moved):
    found = displacement(moved.displacement, 1e-3, 0)
    assert found.samples is moved.displacement and found.bias is None


@pytest.mark.parametrize("rig", [small_rig.RIG, STIFF])
def test_the_period_is_that_of_the_motion_whatever_is_read(rig):
    found = motion(rig, small_rig.RELEASES[0], rate=1000.0, duration=3.0)
    rising = np.flatnonzero((found.displacement[:-1] < 0) & (found.displacement[1:] >= 0))
    shortest, longest = np.diff(rising).min(), np.diff(rising).max()
    readings = (found.displacement, found.velocity, found.acceleration + 5.0)
    for order, reading in enumerate(readings):
        assert 0.8 * shortest < spectral_period(reading, order) < 1.2 * longest


@pytest.mark.parametrize("quantity", ["velocity", "acceleration"])
def test_start_values(quantity):
    chain = small_rig.MeasuringChain(noise=NOISE[1 if quantity == "velocity" else 2])
    found = estimate(small_rig.record(quantity=quantity, chain=chain, duration=3.0)).values
    true = small_rig.true_values(offsets=dict.fromkeys("abc", 0.0))
    assert found["k1"] == pytest.approx(true["k1"], rel=0.1)
    assert found["g"] == pytest.approx(true["g"], rel=0.1)
    assert found["k2[1]"] == pytest.approx(true["k2[1]"], rel=0.4)
    assert found["y0[a]"] == pytest.approx(true["y0[a]"], rel=0.15)
