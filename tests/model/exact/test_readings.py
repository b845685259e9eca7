"""Velocities and accelerations of all simulators against an independent one (the rig's DOP853)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_simulate import campaign as many_recordings

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.recording import Recording
from bayesimpact.model.effects import EFFECTS
from bayesimpact.model.exact.sensitivities.derivatives import grams, trajectories_and_derivatives
from bayesimpact.model.exact.simulate import predictions, sums_of_squares
from bayesimpact.model.oscillator import build_oscillator
from bayesimpact.trial.rig.recordings import Release, Rig, motion

BY_ID = {effect.id: effect for effect in EFFECTS}
RIG = Rig(0.503, 0.148, 808.556, 2.085, 1.1e-3, {"1": 5350.156})
RELEASE = Release("a", "1", -5.5e-3, 4e-3)
RATE, DURATION = 1000.0, 0.6
BASE = {
    "c1": 0.148, "k1": 808.556, "c2": 2.085, "g": 1.1e-3, "k2[1]": 5350.156,
    "y0[a]": -5.5e-3, "v0[a]": 4e-3, "offset[a]": 0.0, "sigma": 1.0,
}  # fmt: skip
ADDED = {
    "coulomb_friction": {"force": 0.05},
    "quadratic_drag": {"coefficient": 0.5},
    "contact_damping_indentation": {"coefficient": 800.0},
    "contact_hardening": {"stiffness": 1e8},
    "contact_relaxation": {"stiffness": 500.0, "time": 0.01},
    "contact_no_tension": {},
    "obstacle_mass": {"mass": 0.01},
    "gap_wear": {"step": 2e-5},
    "spring_cubic": {"stiffness": 1e6},
    "stiffness_drift": {"rate": 0.05},
    "harmonic_forcing": {"amplitude": 0.2, "frequency": 9.0, "phase": 0.4},
    "opposite_stop": {"stiffness": 2000.0, "gap": 4e-3},
}
QUANTITIES = ("displacement", "velocity", "acceleration")


def simulated(ids, values, quantity):
    """Readings (n,) of one recording under added effects."""
    recording = Recording("a", "1", np.zeros(int(RATE * DURATION)), 1 / RATE, quantity=quantity)
    effects = tuple(BY_ID[i] for i in ids)
    oscillator = build_oscillator(Campaign("test", 0.503, (recording,)), effects)
    theta = []
    for name in oscillator.layout.names:
        effect, _, rest = name.partition(".")
        theta.append(BASE[name] if name in BASE else values[effect][rest.split("[")[0]])
    return oscillator.predict(np.array(theta))[0]


def truth(effects):
    found = motion(RIG, RELEASE, effects, rate=RATE, duration=DURATION)
    return {
        "displacement": found.displacement,
        "velocity": found.velocity,
        "acceleration": found.acceleration,
    }


@pytest.mark.parametrize("effect", ADDED)
def test_added_effects_read_alike(effect):
    true = truth({effect: ADDED[effect]})
    for quantity in QUANTITIES:
        found = simulated([effect], {effect: ADDED[effect]}, quantity)
        size = np.ptp(true[quantity])
        # Two independent integrators; an acceleration that jumps has no accuracy at the jump.
        np.testing.assert_allclose(
            found, true[quantity], rtol=0, atol=3e-6 * size, err_msg=quantity
        )


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_the_base_model_reads_alike_in_both_simulators(quantity):
    true = truth({})[quantity]
    exact = simulated([], {}, quantity)
    np.testing.assert_allclose(exact, true, rtol=0, atol=1e-9 * np.ptp(true))
    general = simulated(["quadratic_drag"], {"quadratic_drag": {"coefficient": 0.0}}, quantity)
    np.testing.assert_allclose(general, exact, rtol=0, atol=1e-11 * np.ptp(true))


def test_a_second_mode_is_read_as_the_derivatives_of_what_a_displacement_probe_reads():
    values = {"second_mode": {"frequency": 60.0, "damping": 0.05, "gain": 0.3}}
    names = [p.name for p in BY_ID["second_mode"].parameters]
    values = {"second_mode": dict(zip(names, values["second_mode"].values(), strict=True))}
    y, v, a = (simulated(["second_mode"], values, q) for q in QUANTITIES)
    step = 1 / RATE
    assert np.ptp(y - truth({})["displacement"]) > 1e-5
    # integrals over the recording: Simpson's error is that of the kinks at contact
    np.testing.assert_allclose(np.cumsum(v)[:-1] * step, y[1:] - y[0], atol=5e-4)
    smooth = np.abs(np.diff(a)) < 0.3
    central = (v[2:] - v[:-2]) / (2 * step)
    quiet = smooth[:-1] & smooth[1:]
    np.testing.assert_allclose(a[1:-1][quiet], central[quiet], atol=0.05 * np.ptp(a))


def test_sums_and_gram_matrices_of_mixed_recordings():
    theta, columns, constants, mass, _, starts, counts, intervals = many_recordings(n=300)
    orders = np.arange(counts.size) % 3
    values, codes = predictions(
        theta[None], columns, constants, mass, counts, intervals, counts.sum(), orders
    )
    assert not codes.any()
    measured = values[0] + 1e-3 * np.sin(np.arange(counts.sum()))
    sums, _ = sums_of_squares(
        theta[None], columns, constants, mass, measured, starts, counts, intervals, orders
    )
    found, _ = grams(theta, columns, constants, mass, measured, starts, counts, intervals, orders)
    _, jacobian, _ = trajectories_and_derivatives(
        theta, columns, constants, mass, counts, intervals, counts.sum(), orders
    )
    for r, (first, n) in enumerate(zip(starts, counts, strict=True)):
        rows = slice(first, first + n)
        residual = (measured - values[0])[rows]
        stacked = np.column_stack([jacobian[rows], residual])
        scale = np.sqrt(np.maximum(np.diag(stacked.T @ stacked), 1e-300))
        error = (found[r] - stacked.T @ stacked) / np.outer(scale, scale)
        assert np.abs(error).max() < 1e-9
        assert sums[0, r] == pytest.approx(residual @ residual, rel=1e-9)


def test_a_probe_of_velocity_has_an_offset_and_effects_of_its_own():
    effect = BY_ID["sensor_drift"]
    recording = Recording("a", "1", np.zeros(40), 1 / RATE, quantity="velocity")
    oscillator = build_oscillator(Campaign("test", 0.503, (recording,)), (effect,))
    units = {p.name: p.unit for p in oscillator.layout.parameters}
    assert units["offset[a]"] == units["sigma"] == "m/s" and units["y0[a]"] == "m"
    assert units["sensor_drift.rate"] == "m/s2"
    theta = np.array([BASE.get(n, 0.0) for n in oscillator.layout.names])
    plain = oscillator.predict(theta)[0]
    theta[oscillator.layout.index("offset[a]")] = 0.25
    theta[oscillator.layout.index("sensor_drift.rate")] = 2.0
    t = np.arange(40) / RATE
    np.testing.assert_allclose(oscillator.predict(theta)[0], plain + 0.25 + 2.0 * t, atol=1e-15)
    assert replace(recording, quantity="acceleration").unit == "m/s2"
