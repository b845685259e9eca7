"""Derivatives by superposition against simulated ones: a residual force beside power damping."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_rig import vector

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.input import Input
from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.residual_force.learned import learned_force
from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.effects import EFFECTS
from bayesimpact.model.effects.effect import Effect
from bayesimpact.model.linear_response import nearby
from bayesimpact.model.oscillator import Oscillator, build_oscillator

pytestmark = pytest.mark.long

MASS, STIFFNESS, KNOTS = 1.0, 190e3, 24
BY_ID = {e.id: e for e in EFFECTS}
VALUES = {
    "c1": 30.0,
    "k1": STIFFNESS,
    "power_damping.coefficient": 8.0,
    "power_damping.exponent": 1.1,
    "presliding_friction.force": 3000.0,
    "presliding_friction.displacement": 1e-2,
    "sigma": 3e-4,
}


def driven(*ids: str, knots: int = KNOTS) -> tuple[Likelihood, np.ndarray, np.ndarray]:
    """A likelihood of a motion forced by noise, nine samples a period, with a residual force.

    Also parameters, and steps that change the motion by a tenth of the noise or so.
    """
    rng, n = np.random.default_rng(5), 2000
    force = Input(2e4 * np.convolve(rng.standard_normal(n), np.ones(4) / 4, mode="same"))
    recording = Recording("driven", "", np.zeros(n), 1.6e-3, input=force)
    campaign = Campaign("driven", MASS, (recording,), stop=False)
    effects: list[Effect] = [BY_ID[i] for i in ids]
    reach = float(np.abs(predicted(campaign, effects)).max())
    effects.append(learned_force(-reach, reach, 1.0, 1.0, knots))
    samples = predicted(campaign, effects) + VALUES["sigma"] * rng.standard_normal(n)
    campaign = replace(campaign, recordings=(replace(recording, samples=samples),))
    oscillator = build_oscillator(campaign, effects)
    names = oscillator.layout.names
    theta = start(oscillator)
    steps = np.array([1.0 if ".a" in x else 1e-2 if ".b" in x else 1e-6 for x in names])
    return Likelihood(oscillator, Noise()), theta, steps


def start(oscillator: Oscillator) -> np.ndarray:
    known = {name: 0.0 for name in oscillator.layout.names} | VALUES
    return vector(oscillator.layout, known)


def predicted(campaign: Campaign, effects: list[Effect]) -> np.ndarray:
    oscillator = build_oscillator(campaign, effects)
    return oscillator.displacements(start(oscillator))[0]


def simulations(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many motions are asked of the simulator, call by call, from now on."""
    asked: list[int] = []
    simulate = Oscillator.motions_of

    def counted(self, recordings, slots, orders=None):
        asked.append(len(recordings))
        return simulate(self, recordings, slots, orders)

    monkeypatch.setattr(Oscillator, "motions_of", counted)
    return asked


def columns(likelihood, theta, steps, monkeypatch) -> tuple[np.ndarray, np.ndarray, int]:
    """Changes (n, k) by a step each, superposed and simulated; motions simulated for the first."""
    with monkeypatch.context() as context:
        asked = simulations(context)
        found = likelihood.linearise(theta, steps)[0]
        count, step = sum(asked), steps[found.columns]
        context.setattr(nearby, "PAYS", 10**9)
        return found.jacobian * step, likelihood.linearise(theta, steps)[0].jacobian * step, count


def errors(found: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """Of every column, over its norm."""
    return np.linalg.norm(found - expected, axis=0) / np.linalg.norm(expected, axis=0)


def test_columns_are_the_simulated_ones(monkeypatch):
    likelihood, theta, steps = driven("power_damping")
    found, expected, count = columns(likelihood, theta, steps, monkeypatch)
    assert count < KNOTS  # of two for each of 2 KNOTS coefficients
    wrong, size = errors(found, expected), np.linalg.norm(expected, axis=0)
    assert np.all(wrong[size > 1e-3 * size.max()] < 0.01)  # the others are hardly ever reached
    assert np.median(wrong) < 1e-3


def test_where_they_are_not_they_are_simulated(monkeypatch):
    """Behind a law with a state of its own, which free changes of the motion do not know."""
    likelihood, theta, steps = driven("presliding_friction")
    found, expected, count = columns(likelihood, theta, steps, monkeypatch)
    np.testing.assert_array_equal(found, expected)
    assert count > 4 * KNOTS


def test_an_error_above_the_allowed_one_is_not_taken(monkeypatch):
    likelihood, theta, steps = driven("power_damping")
    found, expected, _ = columns(likelihood, theta, 1e4 * steps, monkeypatch)
    np.testing.assert_array_equal(found, expected)
