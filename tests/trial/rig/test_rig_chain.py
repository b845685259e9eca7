"""The measuring chain: what it does, and in which order."""

from __future__ import annotations

import numpy as np
import pytest

from bayesimpact.data.campaign import Smoothing
from bayesimpact.errors import InputError
from bayesimpact.trial.bundle import PAPER_RIG
from bayesimpact.trial.rig.measuring_chain import MeasuringChain, Probe, measure, smooth
from bayesimpact.trial.rig.recordings import Release, motion, record

RELEASE = Release("r", "1", -5e-3)
SAVGOL = Smoothing("savgol", window=21, polyorder=2)
LAG = Smoothing("lag", time_constant=3e-3)


def recorded(effects=None, chain=None, seed=0):
    rng = np.random.default_rng(seed)
    return record(PAPER_RIG, RELEASE, effects, chain, rate=1000, duration=0.5, rng=rng)


@pytest.fixture(scope="module")
def truth():
    return motion(PAPER_RIG, RELEASE, rate=1000, duration=0.5)


def test_perfect_chain_returns_the_motion(truth):
    assert np.array_equal(recorded(), truth.displacement)


@pytest.mark.parametrize(
    ("effect", "parameters", "expected"),
    [
        ("sensor_drift", {"rate": 1e-5}, lambda y, t: y + 1e-5 * t),
        ("sensor_quadratic", {"gain": 0.5}, lambda y, t: y + 0.5 * y**2),
        ("sensor_cubic", {"gain": 90.0}, lambda y, t: y + 90.0 * y**3),
        (
            "sensor_hum",
            {"amplitude": 1e-5, "frequency": 50.0, "phase": {"r": 0.4}},
            lambda y, t: y + 1e-5 * np.sin(2 * np.pi * 50.0 * t + 0.4),
        ),
        (
            "released_mode",
            {"amplitude": {"r": 1e-5}, "frequency": 50.0, "decay": 3.0, "phase": {"r": 0.4}},
            lambda y, t: y + 1e-5 * np.exp(-3.0 * t) * np.sin(2 * np.pi * 50.0 * t + 0.4),
        ),
    ],
)
def test_probe_distorts_the_true_displacement_before_the_offset(
    truth, effect, parameters, expected
):
    got = recorded({effect: parameters}, MeasuringChain(offsets={"r": 1e-3}))
    want = expected(truth.displacement, truth.times) + 1e-3
    assert np.abs(got - want).max() < 1e-17
    assert np.abs(want - 1e-3 - truth.displacement).max() > 4e-6


@pytest.mark.parametrize("held", [0.0, 1.0])
def test_a_high_pass_is_its_equation_in_fine_steps(truth, held):
    corner, finer = 0.8, 32
    w, y = 2 * np.pi * corner, motion(PAPER_RIG, RELEASE, rate=1000 * finer, duration=0.5)
    first = constant = held * RELEASE.y0
    read = []
    for a, b in zip(y.displacement, [*y.displacement[1:], 0.0], strict=True):
        read.append(a - constant + first)  # the rest reading is that of the first sample
        constant += (0.5 * (a + b) - constant) * w / (1000 * finer + 0.5 * w)
    got = recorded({"sensor_high_pass": {"corner": corner, "rate": {"r": w * first}}})
    assert np.abs(got - read[::finer]).max() < 2e-9
    assert np.abs(got - truth.displacement).max() > 1e-4


def test_offset_belongs_to_its_recording(truth):
    assert np.array_equal(
        recorded(chain=MeasuringChain(offsets={"other": 1e-3})), truth.displacement
    )


@pytest.mark.parametrize("smoothing", [SAVGOL, LAG])
def test_noise_then_smoothing_then_rounding(smoothing):
    raw = recorded(chain=MeasuringChain(noise=5e-6, offsets={"r": 2e-5}))
    filtered = smooth(raw, smoothing, 1e-3)
    assert np.array_equal(
        recorded(chain=MeasuringChain(noise=5e-6, offsets={"r": 2e-5}, smoothing=smoothing)),
        filtered,
    )
    digit = 2.5e-6
    chain = MeasuringChain(noise=5e-6, offsets={"r": 2e-5}, smoothing=smoothing, rounding=digit)
    rounded = recorded(chain=chain)
    assert np.abs(rounded / digit - np.round(rounded / digit)).max() < 1e-9
    assert 0.45 * digit < np.abs(rounded - filtered).max() <= 0.5 * digit * (1 + 1e-9)


def test_savgol_is_a_polynomial_fit_of_every_window():
    signal = np.random.default_rng(1).standard_normal(60)
    filtered = smooth(signal, SAVGOL, 1e-3)
    for i in (0, 4, 10, 30, 55, 59):
        first = min(max(i - 10, 0), 60 - 21)
        x = np.arange(first, first + 21) - i
        assert filtered[i] == pytest.approx(np.polyfit(x, signal[first : first + 21], 2)[-1])


def test_lag_is_the_recursion_that_its_docstring_states():
    signal = 3.0 + np.random.default_rng(2).standard_normal(50)
    filtered = smooth(signal, LAG, 1e-3)
    x = signal[0]
    for value, got in zip(signal, filtered, strict=True):
        x += (1 - np.exp(-1 / 3)) * (value - x)
        assert got == pytest.approx(x, rel=1e-13)


def test_concealed_chain_effects_equal_the_open_ones():
    open_chain = MeasuringChain(noise=5e-6, correlation=0.6, smoothing=SAVGOL)
    hidden = {"smoothing": {"window": 21, "order": 2}, "noise_correlated": {"correlation": 0.6}}
    assert np.array_equal(recorded(hidden, MeasuringChain(noise=5e-6)), recorded(chain=open_chain))
    hidden = {"smoothing": {"time_constant": 3e-3}}
    assert np.array_equal(recorded(hidden), recorded(chain=MeasuringChain(smoothing=LAG)))
    with pytest.raises(InputError, match="only one"):
        recorded(hidden, open_chain)


@pytest.mark.parametrize(
    ("correlation", "white"), [(0.0, 0.0), (0.7, 0.0), (-0.4, 0.0), (0.8, 0.6)]
)
def test_noise_is_stationary_with_the_stated_correlation(correlation, white):
    times = np.arange(500) / 1000
    rng = np.random.default_rng(5)
    chain = MeasuringChain(noise=5e-6, correlation=correlation, white=white)
    noise = np.array([measure(0 * times, times, Probe(), chain, "r", rng) for _ in range(400)])
    # 200,000 samples; the effective number is smaller by (1 + phi^2)/(1 - phi^2)
    error = np.sqrt((1 + correlation**2) / (1 - correlation**2) / 2e5)
    assert np.var(noise) == pytest.approx(25e-12, rel=5 * np.sqrt(2) * error)
    lagged = np.mean(noise[:, 1:] * noise[:, :-1]) / np.var(noise)
    assert lagged == pytest.approx((1 - white) * correlation, abs=5 * error)
    farther = np.mean(noise[:, 2:] * noise[:, :-2]) / np.var(noise)
    assert farther == pytest.approx((1 - white) * correlation**2, abs=5 * error)
    # the first sample is as wide as the others: known to 3.5 % from 400 of them
    assert np.std(noise[:, 0]) == pytest.approx(5e-6, rel=0.15)


@pytest.mark.parametrize(
    "smoothing",
    [
        Smoothing("savgol", window=20, polyorder=2),
        Smoothing("savgol", window=3, polyorder=3),
        Smoothing("savgol", window=501, polyorder=2),
        Smoothing("lag"),
    ],
)
def test_impossible_filters_are_refused(smoothing):
    with pytest.raises(InputError, match="smoothing"):
        recorded(chain=MeasuringChain(smoothing=smoothing))


@pytest.mark.parametrize(
    "bad", [{"noise": -1e-6}, {"correlation": 1.0}, {"rounding": float("nan")}, {"white": 1.0}]
)
def test_impossible_chains_are_refused(bad):
    with pytest.raises(InputError, match=next(iter(bad))):
        MeasuringChain(**bad)
