"""The measuring chain's filters against their definitions, written out sample by sample."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bayesimpact.data.campaign import Smoothing
from bayesimpact.model.measurement import edge, magnitude_response, smooth

INTERVAL = 1e-3
SAVGOL = Smoothing("savgol", window=21, polyorder=2)
LAG = Smoothing("lag", time_constant=3.7e-3)


def polynomial_fits(x: np.ndarray, window: int, order: int) -> np.ndarray:
    """Savitzky-Golay by a least-squares fit per sample; the end windows serve all their samples."""
    half, n = window // 2, x.size
    out = np.empty(n)
    for i in range(n):
        first = min(max(i - half, 0), n - window)
        place = np.arange(window) - half
        fit = np.polynomial.Polynomial.fit(place, x[first : first + window], order)
        out[i] = fit(i - first - half)
    return out


@pytest.mark.parametrize(("window", "order"), [(21, 2), (19, 2), (5, 1), (11, 4)])
def test_savgol_is_a_polynomial_fit_around_every_sample(window, order):
    x = np.cumsum(np.random.default_rng(window).standard_normal(90))
    smoothing = Smoothing("savgol", window=window, polyorder=order)
    found = smooth(x, smoothing, INTERVAL)
    np.testing.assert_allclose(found, polynomial_fits(x, window, order), atol=1e-10)


def test_lag_is_the_exact_response_to_a_staircase():
    """dz/dt = (x - z) / tau with x held between samples, z(0) = x(0)."""
    x = np.cumsum(np.random.default_rng(1).standard_normal(200))
    z, expected = x[0], []
    for value in x:
        z = value + (z - value) * math.exp(-INTERVAL / LAG.time_constant)
        expected.append(z)
    np.testing.assert_allclose(smooth(x, LAG, INTERVAL), expected, rtol=1e-12)
    np.testing.assert_allclose(smooth(np.full(50, 3.0), LAG, INTERVAL), 3.0, rtol=1e-14)


def test_no_filter_changes_nothing():
    x = np.random.default_rng(2).standard_normal((2, 30))
    assert smooth(x, None, INTERVAL) is x
    np.testing.assert_array_equal(magnitude_response(None, INTERVAL, np.array([0.0, 50.0])), 1.0)
    assert edge(None, INTERVAL) == 0


@pytest.mark.parametrize("smoothing", [SAVGOL, LAG])
def test_every_row_is_filtered_alone(smoothing):
    x = np.random.default_rng(3).standard_normal((2, 3, 80))
    whole = smooth(x, smoothing, INTERVAL)
    for i in np.ndindex(2, 3):
        np.testing.assert_allclose(whole[i], smooth(x[i], smoothing, INTERVAL), atol=1e-14)


@pytest.mark.parametrize("smoothing", [SAVGOL, LAG])
def test_a_failed_simulation_stays_failed_and_spoils_no_other(smoothing):
    x = np.random.default_rng(4).standard_normal((3, 80))
    x[1] = np.nan
    found = smooth(x, smoothing, INTERVAL)
    assert np.isnan(found[1]).all()
    np.testing.assert_array_equal(found[[0, 2]], smooth(x[[0, 2]], smoothing, INTERVAL))


@pytest.mark.parametrize("smoothing", [SAVGOL, LAG])
@pytest.mark.parametrize("frequency", [6.4, 40.0, 91.0, 230.0])
def test_gain_is_what_a_long_sine_loses(smoothing, frequency):
    t = np.arange(4000) * INTERVAL
    inside = slice(200, 3800)
    wave = np.exp(2j * np.pi * frequency * t)
    passed = smooth(wave.real, smoothing, INTERVAL) + 1j * smooth(wave.imag, smoothing, INTERVAL)
    ratio = np.abs(passed[inside] / wave[inside])
    expected = magnitude_response(smoothing, INTERVAL, np.array([frequency]))[0]
    np.testing.assert_allclose(ratio, expected, atol=1e-12)


@pytest.mark.parametrize(("smoothing", "remainder"), [(SAVGOL, 1e-12), (LAG, math.exp(-5))])
def test_beyond_the_edge_the_start_is_forgotten(smoothing, remainder):
    """What came before the first sample matters within `edge` samples of the start only."""
    rng = np.random.default_rng(5)
    history, x = rng.standard_normal(100), rng.standard_normal(100)
    alone = smooth(x, smoothing, INTERVAL)
    continued = smooth(np.concatenate([history, x]), smoothing, INTERVAL)[100:]
    difference = np.abs(alone - continued)
    scale = np.abs(difference).max()
    cut = edge(smoothing, INTERVAL)
    end = x.size - (cut if smoothing.kind == "savgol" else 0)
    assert np.all(difference[cut:end] <= remainder * scale)
    assert difference[cut // 2] > remainder * scale  # and no shorter cut would do
