"""Gravity on a pendulum, a bump in the contact, a rest before the release."""

from __future__ import annotations

import numpy as np
import pytest
from naive_rig import NaiveRig
from scipy.special import ellipk

from bayesimpact.trial.bundle import PAPER_RIG
from bayesimpact.trial.rig.measuring_chain import MeasuringChain
from bayesimpact.trial.rig.recordings import Release, Rig, motion, record

INERTIA, K1 = 0.04, 0.04 * 6.0**2
FAR = Rig(INERTIA, 0.002, K1, 0.0, 10.0, {"1": 1.0})  # its obstacle is out of reach


def test_the_period_of_a_pendulum() -> None:
    """T = 4 sqrt(I / K) K(sin^2(A / 2)): the complete elliptic integral."""
    amplitude = 1.1
    free = Rig(INERTIA, 0.0, K1)
    effects = {"pendulum_sine": {"stiffness": K1}}
    period = 4 * np.sqrt(INERTIA / K1) * ellipk(np.sin(amplitude / 2) ** 2)
    rate = 4000 / period
    run = motion(free, Release("r", "", -amplitude), effects, rate=rate, duration=2.5 * period)
    for turns in (1, 2):
        assert run.displacement[4000 * turns] == pytest.approx(-amplitude, abs=1e-9)
        assert run.displacement[4000 * turns - 2000] == pytest.approx(amplitude, abs=1e-9)
    linear = motion(free, Release("r", "", -amplitude), rate=rate, duration=2.5 * period)
    assert abs(linear.displacement[4000] + amplitude) > 0.05


def test_pendulum_against_the_naive_twin() -> None:
    effects = {
        "pendulum_sine": {"stiffness": K1},
        "coulomb_friction": {"force": 4e-3},
        "spring_quadratic": {"stiffness": 0.1},
    }
    start = Release("r", "1", -0.9, 0.1)
    run = motion(FAR, start, effects, rate=1000, duration=2.0)
    naive = NaiveRig(FAR, start, effects).run(2.0, 1e-3)
    assert np.abs(run.displacement - naive).max() < 1e-9
    without = {k: v for k, v in effects.items() if k != "pendulum_sine"}
    other = motion(FAR, start, without, rate=1000, duration=2.0)
    assert np.abs(run.displacement - other.displacement).max() > 0.1


def test_bump_against_the_naive_twin() -> None:
    effects = {"contact_bump": {"force": 0.5, "depth": 1e-3, "width": 1e-4}}
    start = Release("r", "1", -6e-3)
    run = motion(PAPER_RIG, start, effects, rate=1e5, duration=0.2)
    naive = NaiveRig(PAPER_RIG, start, effects).run(0.2, 1e-5)
    assert np.abs(run.displacement - naive).max() < 1e-11
    base = motion(PAPER_RIG, start, rate=1e5, duration=0.2)
    assert np.abs(run.displacement - base.displacement).max() > 1e-6


def test_a_rest_before_the_release() -> None:
    """Held at y0; the motion after it is the one without a rest; the chain counts from the first
    sample.
    """
    start = Release("r", "1", -0.5)
    effects = {"pendulum_sine": {"stiffness": K1}, "sensor_drift": {"rate": 1e-2}}
    chain = MeasuringChain(offsets={"r": 0.02})
    rng = np.random.default_rng(0)
    plain = record(FAR, start, effects, chain, rate=100, duration=1.0, rng=rng)
    rested = record(FAR, start, effects, chain, rate=100, duration=1.0, rng=rng, rest=0.3)
    assert rested.size == 130
    drift = 1e-2 * np.arange(30) / 100
    np.testing.assert_allclose(rested[:30], -0.48 + drift, atol=1e-12)
    np.testing.assert_allclose(rested[30:], plain + 1e-2 * 0.3, atol=1e-12)
