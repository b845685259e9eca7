"""Undeclared filters: proved by the noise spectrum, and never where there is none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_rig
from scipy.signal import butter, lfilter, savgol_filter

from bayesimpact.data.campaign import Smoothing
from bayesimpact.data.recording import Recording
from bayesimpact.inference.noise.spectrum import find_smoothing, nulls, smoothed_noise
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.trial.rig.measuring_chain import MeasuringChain
from bayesimpact.trial.rig.recordings import Release

FILTERS = [(9, 0), (7, 2), (11, 2), (15, 4), (21, 2), (31, 4), (25, 6)]


@pytest.fixture(scope="module")
def silent():
    return small_rig.record(chain=MeasuringChain())


def noisy(silent, seed: int, rho: float = 0.0, sigma: float = small_rig.NOISE) -> list[Recording]:
    rng, noise = np.random.default_rng(seed), Noise(rho)
    return [
        replace(r, samples=r.samples + noise.coloured(rng, r.samples.size, r.interval, sigma))
        for r in silent.recordings
    ]


def filtered(recordings: list[Recording], window: int, order: int) -> list[Recording]:
    """SciPy's own filter, as a lab would have used it."""
    return [replace(r, samples=savgol_filter(r.samples, window, order)) for r in recordings]


def test_a_filter_is_found_beside_samples_that_are_set_aside(silent):
    """They may be as bad as they like."""
    recordings = filtered(noisy(silent, 1), 21, 2)
    loud = recordings[0].samples.copy()
    loud[700:1100] += 100 * small_rig.NOISE * np.random.default_rng(2).standard_normal(400)
    used = np.ones(loud.size, bool)
    used[690:1110] = False
    found = find_smoothing([replace(recordings[0], samples=loud, used=used), *recordings[1:]])
    assert found is not None
    assert (found.smoothing.window, found.smoothing.polyorder) == (21, 2)


@pytest.mark.parametrize("rho", [0.0, 0.6])
@pytest.mark.parametrize(("window", "order"), FILTERS)
def test_a_filter_is_found_behind_white_and_coloured_noise(silent, window, order, rho):
    found = find_smoothing(filtered(noisy(silent, window, rho), window, order))
    assert found is not None
    assert found.smoothing == Smoothing("savgol", window, order)
    assert found.log_ratio > 20


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.9])
def test_no_filter_is_found_where_there_is_none(silent, rho):
    for seed in range(5):
        assert find_smoothing(noisy(silent, seed, rho)) is None


def test_rounding_and_a_lag_are_no_such_filter(silent):
    digit = 5e-6
    rounded = [replace(r, samples=np.round(r.samples / digit) * digit) for r in noisy(silent, 1)]
    assert find_smoothing(rounded) is None
    lag = Smoothing("lag", time_constant=2e-3)
    chain = MeasuringChain(noise=small_rig.NOISE, smoothing=lag, offsets=small_rig.OFFSETS)
    assert find_smoothing(small_rig.record(chain=chain).recordings) is None


@pytest.mark.parametrize("order", [1, 2, 4])
def test_a_spectrum_without_side_lobes_is_no_filter(silent, order):
    """Electronics before the sampling: noise that falls, however steeply, but has no nulls."""
    low_pass = butter(order, 60.0, fs=1000.0)
    for seed in range(3):
        rng = np.random.default_rng(seed)
        recordings = [
            replace(
                r,
                samples=r.samples
                + 3 * small_rig.NOISE * lfilter(*low_pass, rng.standard_normal(r.samples.size))
                + 0.02 * small_rig.NOISE * rng.standard_normal(r.samples.size),
            )
            for r in silent.recordings
        ]
        assert find_smoothing(recordings) is None


@pytest.mark.parametrize(("frequency", "seed"), [(70.0, 0), (75.0, 1), (80.0, 0)])
def test_a_hum_is_no_filter(frequency, seed):
    """A line between the nulls of some filter looks like what that filter lets pass."""
    heights = zip("abcd", (-6.5e-3, -5e-3, 4e-3, 3e-3), strict=True)
    plain = small_rig.record(
        rig=small_rig.PLAIN, releases=[Release(name, "", y) for name, y in heights],
        chain=MeasuringChain(), rate=500.0, duration=7.5,
    )  # fmt: skip
    rng = np.random.default_rng(seed)
    hummed = []
    for r in plain.recordings:
        noise = small_rig.NOISE * rng.standard_normal(r.samples.size)
        hum = 0.4 * small_rig.NOISE * np.sin(2 * np.pi * frequency * r.times + seed)
        hummed.append(replace(r, samples=r.samples + noise + hum))
    assert find_smoothing(hummed) is None


def test_a_filter_is_found_beside_a_hum(silent):
    for window, order in FILTERS[:3]:
        hummed = [
            replace(r, samples=r.samples + 1e-5 * np.sin(2 * np.pi * 50.0 * r.times))
            for r in noisy(silent, 3)
        ]
        found = find_smoothing(filtered(hummed, window, order))
        assert found is not None and found.smoothing == Smoothing("savgol", window, order)


@pytest.mark.parametrize(("window", "order"), FILTERS)
def test_nulls_are_where_a_sine_vanishes(window, order):
    t = np.arange(4000) * 1e-3
    for frequency in nulls(Smoothing("savgol", window, order), 1e-3, count=2):
        wave = savgol_filter(np.sin(2 * np.pi * frequency * t), window, order)[window:-window]
        assert np.abs(wave).max() < 5e-3


@pytest.mark.parametrize("samples", [120, 700, 2200])  # of a period
def test_the_raw_level_behind_a_known_filter(samples, monkeypatch):
    """Half swings of any length, at the cost of one eigenvalue problem a recording."""
    solved = []
    eigh = np.linalg.eigh
    monkeypatch.setattr(np.linalg, "eigh", lambda a: solved.append(len(a)) or eigh(a))
    filtering = Smoothing("savgol", 15, 2)
    ratios = []
    for seed in range(4):
        t = np.arange(12 * samples) / samples
        motion = 5e-3 * np.exp(-0.1 * t) * np.cos(2 * np.pi * t)
        noise = 1e-6 * np.random.default_rng(seed).standard_normal(t.size)
        recording = Recording("a", "", savgol_filter(motion + noise, 15, 2), 1e-3)
        found = smoothed_noise([recording], filtering)
        ratios.append((found.level / 1e-6 - 1.0) / found.level_error)
    assert len(solved) == 4 and max(solved) <= 1024
    assert abs(np.mean(ratios)) < 4 / np.sqrt(4)
