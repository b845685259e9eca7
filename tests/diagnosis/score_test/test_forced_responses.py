"""Responses to many harmonic forces by superposition, against simulations and a closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.input import Input
from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import refit
from bayesimpact.diagnosis.score_test import forced_responses as module
from bayesimpact.diagnosis.score_test.forced_responses import (
    force_responses,
    simulated_responses,
)
from bayesimpact.diagnosis.score_test.scan import scan
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import identify
from bayesimpact.model.experiment import simulate
from bayesimpact.model.linear_response.forced import wave_responses
from bayesimpact.model.linear_response.free_changes import FreeChanges, Stretch, free_changes
from bayesimpact.model.oscillator import build_oscillator

MASS, STIFFNESS, DAMPING, INTERVAL = 0.5, 900.0, 1.5, 1e-3


def long_decay(n: int = 16_000) -> Recording:
    """A decay to e^-24 of its first amplitude, plus noise."""
    recording = simulate(
        effects={}, mass=MASS, c1=DAMPING, k1=STIFFNESS, y0=0.01, v0=0.0, interval=INTERVAL, n=n
    )
    noise = 1e-6 * np.random.default_rng(3).standard_normal(n)
    return replace(recording, samples=recording.samples + noise)


def fitted(*recordings: Recording) -> Fit:
    campaign = Campaign("decay", MASS, recordings, stop=False)
    return identify(campaign, rng=np.random.default_rng(0), search=False).fit


def error(found: np.ndarray, expected: np.ndarray) -> float:
    """Largest relative error of a response."""
    wrong = np.linalg.norm(found - expected, axis=1)
    return float(np.max(wrong / np.linalg.norm(expected, axis=1)))


def superposed(fit: Fit, frequencies: np.ndarray, monkeypatch: pytest.MonkeyPatch) -> np.ndarray:
    """By superposition, although only a grid of five frequencies has been simulated."""
    scales = campaign_scales(fit)
    grid = np.linspace(frequencies[0], frequencies[-1], 50)
    responses = force_responses(fit, 0, grid, scales)
    with monkeypatch.context() as context:
        context.setattr(module, "motions_beside", None)  # a simulation would fail
        return responses(frequencies)


def changes_of(fit: Fit) -> FreeChanges:
    """Of the first recording."""
    oscillator = fit.density.oscillator
    return free_changes(oscillator, 0, oscillator.layout.slots(fit.mode)[0], 1e-9)


def test_they_are_the_simulated_ones_through_contacts(monkeypatch):
    fit = identify(small_rig.record(6), rng=np.random.default_rng(0), search=False).fit
    scales = campaign_scales(fit)
    assert scales.impacts > 0
    lines = np.array([0.3, 0.9, 1.0, 1.7, 3.9]) * scales.natural_frequency
    found = superposed(fit, lines, monkeypatch)
    assert error(found, simulated_responses(fit, 0, lines, scales)) < 0.01


def test_they_are_the_closed_form_of_a_linear_oscillator():
    """Duhamel's integral of a sine, at rest before it: long after its own decay too."""
    fit = fitted(long_decay())
    n, changes = 16_000, changes_of(fit)
    assert len(changes.stretches) > 3  # one alone would drown in rounding
    k, c = fit.value("k1"), fit.value("c1")
    t = np.arange(n) * INTERVAL
    decay, w0 = 0.5 * c / MASS, np.sqrt(k / MASS)
    wd = np.sqrt(w0**2 - decay**2)

    def reading(stretch: Stretch, order: int) -> Stretch:
        y, v = stretch.states[:, 0], stretch.states[:, 1]
        return replace(stretch, readings=(y, v, -(k * y + c * v) / MASS)[order])

    for order in (0, 1, 2):
        for frequency in (2.0, 6.75, 20.0):
            w = 2 * np.pi * frequency
            steady = np.exp(1j * w * t) / (k - MASS * w**2 + 1j * c * w)
            at_rest = np.array([-steady[0], -1j * w * steady[0]])
            s = -decay + 1j * wd  # and its conjugate: two complex amplitudes
            both = np.linalg.solve(np.array([[1, 1], [s, s.conjugate()]]), at_rest)
            exact = steady * (1j * w) ** order
            exact += both[0] * s**order * np.exp(s * t)
            exact += both[1] * s.conjugate() ** order * np.exp(s.conjugate() * t)
            read = tuple(reading(x, order) for x in changes.stretches)
            ours = wave_responses(
                replace(changes, stretches=read, order=order), np.array([frequency])
            )
            assert error(ours, np.stack([exact.imag, exact.real])) < 1e-3


def test_beside_a_measured_input_the_force_comes_on_top(monkeypatch):
    rng = np.random.default_rng(5)
    n = 4000
    force = np.convolve(rng.standard_normal(n), np.ones(8) / 8, mode="same")
    recording = replace(long_decay(n), input=Input(force, free=True))
    campaign = Campaign("driven", MASS, (recording,), stop=False)
    oscillator = build_oscillator(campaign)
    theta = np.array([
        {"c1": DAMPING, "k1": STIFFNESS, "input_gain": 1.3}.get(name, 0.0)
        for name in oscillator.layout.names
    ])  # fmt: skip
    (samples,) = oscillator.predict(theta)
    recording = replace(recording, samples=samples + 1e-6 * rng.standard_normal(n))
    fit = fitted(recording)
    assert fit.value("input_gain") == pytest.approx(1.3, rel=1e-3)
    scales = campaign_scales(fit)
    lines = np.array([0.5, 1.0, 3.0]) * scales.natural_frequency
    found = superposed(fit, lines, monkeypatch)
    assert error(found, simulated_responses(fit, 0, lines, scales)) < 0.01
    free = fitted(long_decay(n))  # a linear oscillator answers alike whatever else shakes it
    alike = simulated_responses(free, 0, lines, scales)
    ratio = np.linalg.norm(found, axis=1) / np.linalg.norm(alike, axis=1)
    assert np.ptp(ratio) < 0.05 * ratio[0]  # the noise level apart


@pytest.mark.parametrize("friction", [0.2, 0.6])
def test_they_are_the_simulated_ones_where_friction_ends_the_motion(friction, monkeypatch):
    """A mass that sticks does not answer; before, superposition serves as without friction."""
    effects, plain = {"coulomb_friction": {"force": friction}}, small_rig.PLAIN
    campaign = small_rig.record(8, effects, rig=plain, releases=small_rig.PLAIN_RELEASES)
    base = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    scales, law = campaign_scales(base), BY_ID["coulomb_friction"]
    score = scan(base, [law], scales, rng=np.random.default_rng(0)).best()[0]
    fit = refit(base, [score], scales).fit
    assert not changes_of(fit).motion[1, -100:].any()
    lines = np.array([0.5, 1.0, 1.5, 3.0]) * scales.natural_frequency
    found = superposed(fit, lines, monkeypatch)
    assert error(found, simulated_responses(fit, 0, lines, scales)) < 0.03


@pytest.mark.parametrize("wrong", [1.05, np.nan])
def test_where_superposition_fails_it_does_not_serve(wrong, monkeypatch):
    """As behind a law with a state of its own, or where the mass sticks."""
    fit = identify(small_rig.record(6), rng=np.random.default_rng(0), search=False).fit
    scales = campaign_scales(fit)
    changes = changes_of(fit)
    false = [replace(x, readings=wrong * x.readings) for x in changes.stretches]
    monkeypatch.setattr(module, "free_changes", lambda *_: replace(changes, stretches=tuple(false)))
    grid = np.linspace(0.5, 3, 40) * scales.natural_frequency
    assert force_responses(fit, 0, grid, scales) is None
