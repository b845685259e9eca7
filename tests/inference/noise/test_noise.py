"""Whitening against dense covariance algebra, and by simulation where there is no exact inverse."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import toeplitz

from bayesimpact.data.campaign import Smoothing
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.measurement import magnitude_response, smooth

INTERVAL = 1e-3
SAVGOL = Smoothing("savgol", window=21, polyorder=2)
LAG = Smoothing("lag", time_constant=4e-3)


def operator(noise: Noise, n: int) -> np.ndarray:
    """The whitening as a matrix."""
    return noise.whiten(np.eye(n), INTERVAL).T


def raw_covariance(noise: Noise, n: int) -> np.ndarray:
    """Covariance of the sum of processes that the noise says it is."""
    first = 1.0 - sum(share for _, share in noise.others)
    parts = ((noise.correlation, first), *noise.others)
    return sum(share * toeplitz(rho ** np.arange(n)) for rho, share in parts)


def passed_covariance(noise: Noise, n: int) -> np.ndarray:
    """Covariance of unit raw noise behind the filter."""
    raw = raw_covariance(noise, n)
    if noise.smoothing is None:
        return raw
    matrix = smooth(np.eye(n), noise.smoothing, INTERVAL).T
    return matrix @ raw @ matrix.T


@pytest.mark.parametrize("rho", [0.0, 0.6, -0.4, 0.97])
def test_ar1_whitening_is_exact(rho):
    n, noise = 60, Noise(correlation=rho)
    white, covariance = operator(noise, n), toeplitz(rho ** np.arange(n))
    np.testing.assert_allclose(white.T @ white @ covariance, np.eye(n), atol=1e-11)
    half = 0.5 * np.linalg.slogdet(covariance)[1]
    assert noise.log_volume(n, INTERVAL) == pytest.approx(-half, abs=1e-10)
    assert noise.size(n, INTERVAL) == n


SUMS = (
    Noise(0.9, others=((0.0, 0.4),)),
    Noise(-0.3, others=((0.0, 0.5),)),
    Noise(0.0, others=((0.995, 0.95),)),
    Noise(0.6, others=((0.99, 0.3),)),
    Noise(0.8, others=((0.0, 0.3), (0.999, 0.5))),
)


@pytest.mark.parametrize("noise", SUMS)
@pytest.mark.parametrize("gaps", [(), (0, 1, 2), (20, 21, 22, 23, 40, 59)])
def test_whitening_of_a_sum_of_processes_is_exact(noise, gaps):
    n, used = 60, np.ones(60, dtype=bool)
    used[list(gaps)] = False
    white = noise.whiten(np.eye(n), INTERVAL, used if gaps else None).T
    covariance = raw_covariance(noise, n)
    assert not white[:, ~used].any() and not white[~used].any()
    kept, left = np.ix_(used, used), int(used.sum())
    precision = white[kept].T @ white[kept]
    np.testing.assert_allclose(precision @ covariance[kept], np.eye(left), atol=1e-10)
    half = 0.5 * np.linalg.slogdet(covariance[kept])[1]
    assert noise.log_volume(n, INTERVAL, used if gaps else None) == pytest.approx(-half, abs=1e-9)


@pytest.mark.parametrize("rho", [0.0, 0.6])
@pytest.mark.parametrize("smoothing", [SAVGOL, LAG])
@pytest.mark.parametrize("n", [600, 601])
def test_band_leaves_nearly_independent_numbers_of_unit_variance(rho, smoothing, n):
    """Whittle's approximation: what remains is of order 1 / n, except at the band's ends."""
    noise = Noise(correlation=rho, smoothing=smoothing)
    white = operator(noise, n)
    assert white.shape[0] == noise.size(n, INTERVAL)
    covariance = white @ passed_covariance(noise, n) @ white.T
    variances = np.diag(covariance)
    assert np.mean(variances) == pytest.approx(1.0, abs=0.01)
    assert np.abs(variances - 1).max() < 0.15
    other = covariance - np.diag(variances)
    assert np.abs(other).max() < 0.12


@pytest.mark.parametrize("rho", [0.0, 0.6])
@pytest.mark.parametrize("smoothing", [SAVGOL, LAG])
def test_band_says_the_right_standard_error_of_a_decay(rho, smoothing):
    """Amplitude of a smoothed decay by whitened least squares: the variance is as claimed."""
    n, noise = 1000, Noise(rho, smoothing)
    covariance, t = passed_covariance(noise, n), np.arange(n) * INTERVAL
    for frequency, phase in ((6.4, 0.0), (6.4, 1.2), (16.0, 0.5)):
        decay = np.exp(-0.8 * t) * np.cos(2 * np.pi * frequency * t + phase)
        white = noise.whiten(smooth(decay, smoothing, INTERVAL), INTERVAL)
        weights = noise.whiten(np.eye(n), INTERVAL) @ white / (white @ white)
        claimed, actual = 1 / (white @ white), weights @ covariance @ weights
        assert actual == pytest.approx(claimed, rel=0.05)


@pytest.mark.parametrize("smoothing", [SAVGOL, LAG])
def test_band_keeps_a_slow_signal(smoothing):
    """A smoothed sine of 7 Hz tells as much as the raw one, up to the samples at the ends."""
    t = np.arange(2000) * INTERVAL
    wave = np.sin(2 * np.pi * 7 * t) * np.exp(-0.3 * t)
    white = Noise(smoothing=smoothing).whiten(smooth(wave, smoothing, INTERVAL), INTERVAL)
    assert white @ white == pytest.approx(wave @ wave, rel=0.04)


def test_band_ends_where_the_filter_has_halved_the_power():
    n = 2001
    for smoothing in (SAVGOL, LAG):
        inner = n - 20  # ten samples at both ends; five time constants at the start
        kept = (Noise(smoothing=smoothing).size(n, INTERVAL) + 1) / 2
        last = (kept - 1) / (inner * INTERVAL)
        t = np.arange(20_000) * INTERVAL

        def power(frequency, t=t, smoothing=smoothing):
            wave = np.exp(2j * np.pi * frequency * t)
            passed = smooth(wave.real, smoothing, INTERVAL) + 1j * smooth(
                wave.imag, smoothing, INTERVAL
            )
            return abs(passed[10_000]) ** 2

        assert power(last) >= 0.5 > power(last + 1 / (inner * INTERVAL))


def test_a_filter_slower_than_the_recording_still_leaves_a_band():
    noise = Noise(smoothing=Smoothing("lag", time_constant=0.5))
    assert noise.size(600, INTERVAL) == noise.whiten(np.ones(600), INTERVAL).size > 0


@pytest.mark.parametrize("noise", [Noise(), Noise(0.5), Noise(0.3, SAVGOL), Noise(0.0, LAG)])
def test_whitening_is_linear_and_works_on_the_last_axis(noise):
    rng = np.random.default_rng(0)
    x, y = rng.standard_normal((2, 3, 4, 300))
    both = noise.whiten(2 * x - 3 * y, INTERVAL)
    parts = 2 * noise.whiten(x, INTERVAL) - 3 * noise.whiten(y, INTERVAL)
    np.testing.assert_allclose(both, parts, atol=1e-10)
    one = noise.whiten(x[1, 2], INTERVAL)
    np.testing.assert_allclose(noise.whiten(x, INTERVAL)[1, 2], one, atol=1e-12)


@pytest.mark.parametrize("noise", [Noise(), Noise(0.7), Noise(-0.5), SUMS[0], SUMS[4]])
def test_coloured_noise_is_stationary(noise):
    """Covariances over draws, from the first sample on; standard errors from normal theory."""
    rng, draws, sigma = np.random.default_rng(3), 20_000, 2.5
    x = np.array([noise.coloured(rng, 12, INTERVAL, sigma) for _ in range(draws)])
    expected = sigma**2 * raw_covariance(noise, 12)
    found = x.T @ x / draws
    error = np.sqrt((np.outer(np.diag(expected), np.diag(expected)) + expected**2) / draws)
    assert np.abs((found - expected) / error).max() < 4.5


def test_what_it_says_of_itself():
    assert Noise().is_white and not Noise(0.1).is_white and not Noise(smoothing=LAG).is_white
    assert Noise().kind == "white"
    assert Noise(0.25, SAVGOL).kind == "AR(1), correlation 0.25, smoothed (savgol)"
    assert Noise(0.25).with_smoothing(LAG) == Noise(0.25, LAG)
    slow = "of its variance 60 % AR(1), correlation 0.9, 40 % white"
    assert SUMS[0].kind == slow and not SUMS[2].is_white


def test_the_spectrum_is_that_of_the_covariances():
    n, noise = 4096, SUMS[0]
    lags = np.minimum(np.arange(n), n - np.arange(n))
    expected = np.fft.fft(0.6 * 0.9**lags + 0.4 * (lags == 0)).real[: n // 2]
    frequency = np.arange(n // 2) / (n * INTERVAL)
    np.testing.assert_allclose(noise.spectrum(frequency, INTERVAL), expected, rtol=1e-9)


@pytest.mark.parametrize("smoothing", [None, SAVGOL, LAG])
@pytest.mark.parametrize("n", [400, 401])
def test_whitened_numbers_as_signals_keep_their_products(smoothing, n):
    """And their place in time: a late blip stays late."""
    noise, rng = Noise(0.3, smoothing), np.random.default_rng(3)
    white = noise.whiten(rng.standard_normal((3, n)), INTERVAL)
    signals, start = noise.in_time(white, n, INTERVAL)
    np.testing.assert_allclose(signals @ signals.T, white @ white.T, rtol=1e-12, atol=1e-12)
    blip = np.exp(-0.5 * ((np.arange(n) - 0.8 * n) / 12) ** 2)
    (signal,), start = noise.in_time(noise.whiten(blip[None], INTERVAL), n, INTERVAL)
    assert abs(start / INTERVAL + np.argmax(np.abs(signal)) - 0.8 * n) < 15


@pytest.mark.parametrize("smoothing", [SAVGOL, LAG])
def test_the_highest_frequency_known_is_the_filters_half_power_one(smoothing):
    n = 4000
    highest = Noise(0.3, smoothing).highest(n, INTERVAL)
    near = highest + np.array([0.0, 2.0]) / (n * INTERVAL)
    kept, lost = magnitude_response(smoothing, INTERVAL, near) ** 2
    assert kept >= 0.5 > lost
    assert Noise(0.3).highest(n, INTERVAL) == 0.5 / INTERVAL


def test_lengths_that_transform_slowly_are_shortened_by_less_than_half_a_percent() -> None:
    smoothing = Smoothing("savgol", window=21, polyorder=2)
    noise = Noise(smoothing=smoothing)
    for n in (331, 5567, 6001, 6007, 10007):  # prime, or prime less the filter's reach
        white = np.zeros(noise.size(n, 1e-3))
        signal, start = noise.in_time(white, n, 1e-3)
        kept, whole = signal.size, n - 2 * (smoothing.window // 2)
        assert whole * (1 - 1 / 256) <= kept <= whole
        assert start == pytest.approx(smoothing.window // 2 * 1e-3)
        assert max(p for p in range(2, kept) if kept % p == 0 and is_prime(p)) < 64


def is_prime(number: int) -> bool:
    return all(number % factor for factor in range(2, int(number**0.5) + 1))
