"""Campaigns with a measured input, drawn by an independent integrator: start values and mode."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from driven_twin import driven_motion

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.faults.find import find_faults
from bayesimpact.data.input import Input
from bayesimpact.data.recording import Recording
from bayesimpact.inference.identify import identify
from bayesimpact.inference.initial.driven import estimate_driven
from bayesimpact.inference.initial.estimates import estimate
from bayesimpact.inference.noise.estimate import estimate_noise
from bayesimpact.response.weak_form import bump

TRUTH = {"mass": 0.5, "c1": 0.6, "k1": 800.0, "c2": 2.0, "g": 1.1e-3, "k2": 5000.0}
FREE = {name: TRUTH[name] for name in ("mass", "c1", "k1")}
INTERVAL, NOISE, OFFSET = 2e-3, 5e-6, 2e-4


def _force(kind: str, n: int) -> np.ndarray:
    t = np.arange(n) * INTERVAL
    if kind == "sweep":
        return 1.2 * np.sin(2 * np.pi * (4.0 * t + 1.5 * t**2))
    if kind == "steps":
        return 3.0 * (np.floor(t / 0.31) % 2)
    white = np.random.default_rng(4).standard_normal(n)
    return 6.0 * np.convolve(white, np.ones(5) / 5, "same")


@cache
def _recording(kind: str, stop: bool, gain: float = 1.0, n: int = 1200) -> Recording:
    """Read without an input where `kind` is "decay"."""
    force = np.zeros(n) if kind == "decay" else _force(kind, n)
    start = {"y0": -6e-3, "v0": 0.0} if kind == "decay" else {"y0": 1e-4, "v0": 0.01}
    motion, events = driven_motion({**(TRUTH if stop else FREE), **start}, force, INTERVAL)
    assert (events > 8) == stop
    noise = NOISE * np.random.default_rng(len(kind)).standard_normal(n)
    given = None if kind == "decay" else Input(force / gain, free=gain != 1.0)
    return Recording(kind, "1" if stop else "", motion + OFFSET + noise, INTERVAL, input=given)


def _campaign(kinds: tuple[str, ...], stop: bool, gain: float = 1.0) -> Campaign:
    recordings = tuple(_recording(kind, stop, gain) for kind in kinds)
    return Campaign("rig", TRUTH["mass"], recordings, stop=stop)


CASES = [
    (("sweep",), False, 1.0),
    (("noise",), False, 2.5),
    (("steps",), True, 1.0),
    (("sweep",), True, 2.5),
    (("noise",), True, 1.0),
    (("decay", "sweep"), True, -2.5),
]


@pytest.mark.parametrize(("kinds", "stop", "gain"), CASES)
def test_the_weak_form_comes_near(kinds: tuple[str, ...], stop: bool, gain: float) -> None:
    found = estimate_driven(_campaign(kinds, stop, gain))
    assert found.k1 == pytest.approx(TRUTH["k1"], rel=0.01)
    assert found.c1 == pytest.approx(TRUTH["c1"], rel=0.05)
    assert found.gain == pytest.approx(gain, rel=0.01)
    if stop:
        assert found.gap == pytest.approx(TRUTH["g"], abs=2e-5)
        assert found.k2[0] == pytest.approx(TRUTH["k2"], rel=0.01)
        assert found.c2 == pytest.approx(TRUTH["c2"], rel=0.05)


@pytest.mark.parametrize(("kinds", "stop", "gain"), CASES)
def test_the_mode_holds_the_truth(kinds: tuple[str, ...], stop: bool, gain: float) -> None:
    campaign = _campaign(kinds, stop, gain)
    fit = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    assert fit.converged
    assert fit.rms == pytest.approx(NOISE, rel=0.06)
    assert fit.reduced_chi2 == pytest.approx(1.0, abs=0.2)
    truth = {**TRUTH, "k2[1]": TRUTH["k2"], "input_gain": gain}
    for name, value, sd in zip(fit.names, fit.mode, fit.sd, strict=True):
        if name in truth:
            assert abs(value - truth[name]) < 4.0 * sd, (name, value, sd)
    known = ("c1", "k1") + (("g", "k2[1]") if stop else ())
    assert all(fit.sd[fit.names.index(n)] < 0.01 * truth[n] for n in known)


def test_the_search_ends_where_the_guess_does() -> None:
    found = identify(_campaign(("noise",), True), rng=np.random.default_rng(0), evaluations=3000)
    assert found.agree


def test_a_bump_is_the_derivative_of_its_own() -> None:
    phi, slope, bend, third = bump(50)
    np.testing.assert_allclose(np.gradient(phi)[1:-1], slope[1:-1], atol=2e-4)
    np.testing.assert_allclose(np.gradient(slope)[1:-1], bend[1:-1], atol=2e-4)
    np.testing.assert_allclose(np.gradient(bend)[2:-2], third[2:-2], atol=2e-4)
    assert abs(slope.sum()) < 1e-12 and abs(bend.sum()) < 1e-9


def test_initial_motion_and_rest_are_estimated() -> None:
    values = estimate(_campaign(("sweep",), False)).values
    assert values["offset[sweep]"] == pytest.approx(OFFSET, abs=2e-5)
    assert values["y0[sweep]"] == pytest.approx(1e-4, abs=5e-5)
    assert values["v0[sweep]"] == pytest.approx(0.01, abs=5e-3)


def _band_limited(n: int, highest: float, noise: float) -> Recording:
    """A fast motion under an input that ends at `highest` (of the sampling rate)."""
    rng = np.random.default_rng(7)
    spectrum = np.fft.rfft(rng.standard_normal(n))
    spectrum[np.fft.rfftfreq(n) > highest] = 0.0
    force = np.fft.irfft(spectrum, n)
    response = np.convolve(force, np.exp(-0.03 * np.arange(200)) * np.sin(0.6 * np.arange(200)))
    samples = response[:n] + noise * rng.standard_normal(n)
    return Recording("a", "", samples, 1.0, input=Input(force))


def test_noise_from_the_gap_that_an_input_leaves() -> None:
    recording = _band_limited(8192, 0.3, 2e-3)
    noise = estimate_noise(Campaign("rig", 1.0, (recording,), stop=False))
    assert noise.level == pytest.approx(2e-3, rel=0.05)
    assert "above the input's band" in noise.source and not noise.is_bound


def test_noise_from_the_gap_in_a_short_recording() -> None:
    recording = _band_limited(1200, 0.3, 2e-3)
    noise = estimate_noise(Campaign("rig", 1.0, (recording,), stop=False))
    assert noise.level == pytest.approx(2e-3, rel=0.35)  # of bands that differ, the loudest
    assert "above the input's band" in noise.source


def test_a_hum_in_the_input_hides_nothing_of_its_gap() -> None:
    """The recorder's filter cuts the noise above the hum: there it would seem to be less."""
    recording = _band_limited(8192, 0.3, 0.0)
    noise = np.fft.rfft(2e-3 * np.random.default_rng(3).standard_normal(8192))
    noise[np.fft.rfftfreq(8192) > 0.42] *= 1e-2
    hum = 0.05 * np.sin(2 * np.pi * 0.425 * np.arange(8192))
    samples = recording.samples + np.fft.irfft(noise, 8192)
    humming = replace(recording, samples=samples, input=Input(recording.input.samples + hum))
    found = estimate_noise(Campaign("rig", 1.0, (humming,), stop=False))
    assert 1.8e-3 < found.level < 2.8e-3 and found.is_bound  # the loudest of its bands


def test_noise_without_a_gap_is_a_bound_that_a_residual_lowers() -> None:
    recording = _band_limited(8192, 0.5, 2e-3)
    noise = estimate_noise(Campaign("rig", 1.0, (recording,), stop=False))
    assert noise.is_bound and noise.level > 2e-3


def test_noise_under_a_rough_input() -> None:
    """Kinks of the force at every sample are motion, which polynomials take for noise: the input
    tells it from noise, and without one the upper end of the spectrum, as a bound.
    """
    for stop in (False, True):
        campaign = _campaign(("noise",), stop)
        noise = estimate_noise(campaign)
        assert noise.level == pytest.approx(NOISE, rel=0.08)
        free = replace(campaign.recordings[0], input=None)
        alone = estimate_noise(replace(campaign, recordings=(free,)))
        assert alone.is_bound and not noise.is_bound
        assert alone.level == pytest.approx(NOISE, rel=3 * alone.level_error)


def test_rest_and_loud_parts_of_an_input_are_no_faults() -> None:
    times = np.arange(600) * INTERVAL
    steady = np.concatenate([np.zeros(600), 40.0 * np.sin(2 * np.pi * 60.0 * times)])
    force = np.concatenate([np.zeros(600), _force("noise", 600)]) + steady
    motion, _ = driven_motion({**FREE, "y0": 0.0, "v0": 0.0}, force, INTERVAL)
    samples = motion + NOISE * np.random.default_rng(1).standard_normal(1200)
    driven = Recording("a", "", samples, INTERVAL, input=Input(force))
    free = Recording("a", "", samples, INTERVAL)
    found = {
        given: {f.id for f in find_faults(Campaign("rig", 0.5, (r,), stop=False))}
        for given, r in (("driven", driven), ("free", free))
    }
    assert "recording_start" in found["free"] and found["driven"] == set()
