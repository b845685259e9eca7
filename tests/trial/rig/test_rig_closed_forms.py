"""Closed forms of the rig's effects: wear of the gap, relaxation, drift, knocks, loose bodies."""

from __future__ import annotations

from math import cos, exp, pi, sqrt

import numpy as np
import pytest

from bayesimpact.errors import SimulationError
from bayesimpact.trial.bundle import PAPER_RIG
from bayesimpact.trial.rig import motion as rig_motion
from bayesimpact.trial.rig.recordings import Release, Rig, motion

RELEASE = Release("r", "1", -6e-3, 0.01)


def test_gap_of_the_ith_contact_is_g_plus_i_steps():
    run = motion(PAPER_RIG, RELEASE, {"gap_wear": {"step": 2e-5}}, rate=1e5, duration=1)
    gaps = 1.1e-3 + 2e-5 * np.arange(len(run.onsets))
    assert len(run.onsets) > 6
    at_onset = np.interp(run.onsets, run.times, run.displacement)
    at_leave = np.interp(run.ends, run.times, run.displacement)
    assert np.abs(at_onset - gaps).max() < 1e-9
    assert np.abs(at_leave - gaps[: at_leave.size]).max() < 1e-9


def test_shrinking_gap_does_not_touch_again_on_the_way_back():
    run = motion(PAPER_RIG, RELEASE, {"gap_wear": {"step": -2e-5}}, rate=1000, duration=1)
    assert np.diff(run.onsets).min() > 0.08


def test_fast_relaxation_is_a_damper_and_slow_relaxation_a_spring():
    stiffness = {"1": PAPER_RIG.k2["1"] + 500.0}
    spring = Rig(0.503, 0.148, 808.556, 2.085, 1.1e-3, stiffness)
    damper = Rig(0.503, 0.148, 808.556, 2.085 + 0.5, 1.1e-3, {"1": PAPER_RIG.k2["1"]})
    for rig, kz, tau, tolerance in ((spring, 500.0, 1e4, 1e-8), (damper, 5e4, 1e-5, 2e-6)):
        effects = {"contact_relaxation": {"stiffness": kz, "time": tau}}
        run = motion(PAPER_RIG, RELEASE, effects, rate=1000, duration=0.5)
        limit = motion(rig, RELEASE, rate=1000, duration=0.5)
        base = motion(PAPER_RIG, RELEASE, rate=1000, duration=0.5)
        assert np.abs(run.displacement - limit.displacement).max() < tolerance
        assert np.abs(run.displacement - base.displacement).max() > 50 * tolerance


def test_stiffness_drift_moves_the_frequency():
    rig = Rig(mass=0.5, c1=0.0, k1=800.0)
    effects = {"stiffness_drift": {"rate": 0.02}}
    run = motion(rig, Release("r", "", -5e-3), effects, rate=2000, duration=6)
    rising = run.times[1:][(run.displacement[1:] > 0) & (run.displacement[:-1] <= 0)]
    frequency = 1 / np.diff(rising)
    middle = (rising[1:] + rising[:-1]) / 2
    expected = sqrt(1600) / 2 / pi * np.sqrt(1 + 0.02 * middle)
    assert frequency == pytest.approx(expected, rel=5e-3)
    assert frequency[-1] / frequency[0] == pytest.approx(expected[-1] / expected[0], rel=8e-3)


def test_drift_of_an_obstacle_shortens_its_contacts():
    rig = Rig(mass=0.5, c1=0.0, k1=800.0, c2=0.0, g=0.0, k2={"1": 20000.0})
    effects = {"contact_stiffness_drift": {"rate": 0.1}}
    run = motion(rig, Release("r", "1", -5e-3), effects, rate=20000, duration=6)
    y, t = run.displacement, run.times
    crossing = np.flatnonzero(y[1:] * y[:-1] < 0)
    at = t[crossing] - y[crossing] / (y[crossing + 1] - y[crossing]) * np.diff(t)[crossing]
    inside = y[crossing] < 0
    onset, leave = at[inside], at[~inside]
    lasted = leave[: onset.size] - onset[: leave.size]
    middle = onset[: leave.size] + lasted / 2
    assert lasted.size > 50
    assert lasted == pytest.approx(pi / np.sqrt((800 + 20000 * (1 + 0.1 * middle)) / 0.5), rel=1e-4)


def test_knock_hands_over_its_impulse():
    effects = {"knock": {"impulse": 0.02, "time": 0.1, "width": 1e-4}}
    rig = Rig(mass=0.5, c1=0.0, k1=800.0)
    run = motion(rig, Release("r", "", 0.0), effects, rate=1000, duration=0.2)
    assert (run.displacement[:100] == 0).all()
    # the sample at 0.101 s comes 0.95 ms after the middle of the knock
    assert run.velocity[101] == pytest.approx(0.02 / 0.5 * cos(40 * 0.95e-3), rel=1e-5)


def test_detent_pulls_towards_its_place():
    """Equilibrium of k1 y + a x exp(-x^2/w^2) = 0 under strong damping."""
    rig = Rig(mass=0.5, c1=60.0, k1=800.0)
    effects = {"detent": {"stiffness": 4000.0, "place": 1e-3, "width": 1e-3}}
    run = motion(rig, Release("r", "", 0.5e-3), effects, rate=100, duration=3)
    y = run.displacement[-1]
    assert 0.5e-3 < y < 1e-3
    x = y - 1e-3
    assert 800 * y + 4000 * x * exp(-((x / 1e-3) ** 2)) == pytest.approx(0.0, abs=1e-9)


def test_a_law_too_stiff_for_the_integrator_is_given_up(monkeypatch):
    monkeypatch.setattr(rig_motion, "_STEPS", 500)
    stiff = {"contact_relaxation": {"stiffness": 5e4, "time": 1e-5}}
    with pytest.raises(SimulationError, match="too stiff"):
        motion(PAPER_RIG, RELEASE, stiff, rate=1000, duration=0.5)
    motion(PAPER_RIG, RELEASE, rate=1000, duration=0.5)


def test_a_loose_body_is_a_moving_frame_in_other_numbers():
    """Mass m r on a spring beside m: a frame of ratio r, every constant divided by 1 + r."""
    ratio, frequency, damping = 0.07, 11.0, 0.02
    loose = {"mass": ratio * PAPER_RIG.mass, "frequency": frequency, "damping_ratio": damping}
    body = motion(PAPER_RIG, RELEASE, {"resonator": loose}, rate=1000, duration=1)
    rest = 1 + ratio
    other = Rig(
        PAPER_RIG.mass, PAPER_RIG.c1 / rest, PAPER_RIG.k1 / rest, PAPER_RIG.c2 / rest, PAPER_RIG.g,
        {"1": PAPER_RIG.k2["1"] / rest},
    )  # fmt: skip
    numbers = {"frequency": frequency * sqrt(rest), "damping": damping * sqrt(rest)}
    effects = {"base_motion": {**numbers, "mass_ratio": ratio}}
    frame = motion(other, RELEASE, effects, rate=1000, duration=1)
    assert np.abs(body.displacement - frame.displacement).max() < 1e-11
