"""Noise that grows with the reading or its rate: planted, found, and taken for nothing else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.hum import find_hum
from bayesimpact.data.recording import Recording
from bayesimpact.inference.identify import identify
from bayesimpact.inference.noise.estimate import estimate_noise
from bayesimpact.inference.noise.growth import _has_fast_hum
from bayesimpact.inference.noise.whitening import Noise

RATE, DURATION, LEVEL = 1000.0, 6.0, 3e-6
TIME = np.arange(int(RATE * DURATION)) / RATE


def decay(y0: float, frequency: float = 5.0) -> tuple[np.ndarray, np.ndarray]:
    """Displacement and velocity of a free decay."""
    w = 2 * np.pi * frequency
    z = y0 * np.exp((-0.4 + 1j * w) * TIME)
    return z.real, ((-0.4 + 1j * w) * z).real


def campaign(seed: int, share: float = 0.0, jitter: float = 0.0, mode: float = 0.0) -> Campaign:
    """Three decays; `mode` is the frequency, Hz, of a line of 40 um that rings down with them."""
    rng = np.random.default_rng(seed)
    recordings = []
    for i, y0 in enumerate((-6e-3, -5e-3, -4e-3)):
        y, v = decay(y0)
        noise = LEVEL * rng.standard_normal(y.size)
        noise += share * y * rng.standard_normal(y.size)
        noise += jitter * v * rng.standard_normal(y.size)
        line = 40e-6 * np.exp(-0.8 * TIME) * np.sin(2 * np.pi * mode * TIME) if mode else 0.0
        recordings.append(Recording(f"r{i}", "", y + noise + line + 1e-4, 1 / RATE))
    return Campaign(name="planted", mass=0.5, recordings=tuple(recordings), stop=False)


@pytest.mark.parametrize(("share", "jitter"), [(0.0, 2e-4), (3e-3, 0.0), (0.0, 2e-5)])
def test_growth_is_found_as_planted(share, jitter):
    """Over seeds, within three standard errors of the mean."""
    found = [estimate_noise(campaign(seed, share, jitter)) for seed in range(6)]
    for planted, own in ((share, 0), (jitter, 1)):
        sizes = np.array([noise.growth[own] * noise.level for noise in found])
        if planted == 0.0:
            assert not sizes.any()
            continue
        error = max(float(sizes.std()) / np.sqrt(sizes.size), 0.004 * planted)
        assert abs(sizes.mean() - planted) < 3 * error
    assert np.mean([noise.level for noise in found]) == pytest.approx(LEVEL, rel=0.02)


def test_none_is_found_where_none_is():
    assert not any(estimate_noise(campaign(seed)).grows for seed in range(12))


@pytest.mark.parametrize("frequency", [83.0, 170.0, 250.0, 333.0])
def test_a_mode_that_rings_down_is_no_noise(frequency):
    assert not estimate_noise(campaign(1, mode=frequency)).grows


def test_whitened_is_of_one_level_and_its_volume_is_that_of_the_scaling():
    """The density of readings is that of whitened ones times the scaling."""
    recording = campaign(0).recordings[0]
    y, v = decay(-6e-3)
    noise = Noise(0.3, growth=(500.0, 20.0))
    spread = np.sqrt(1.0 + (500.0 * y) ** 2 + (20.0 * v) ** 2)
    inner = slice(20, -20)  # the ends of smoothing polynomials tell less
    np.testing.assert_allclose(noise.relative_sd(recording)[inner], spread[inner], rtol=0.02)
    drawn = np.array([noise.drawn(np.random.default_rng(k), recording, 2.0) for k in range(200)])
    white = noise.whitened(recording, drawn)
    assert np.abs(white.std(axis=0) / 2.0 - 1.0).max() < 5 * np.sqrt(0.5 / 200)
    plain = replace(noise, growth=(0.0, 0.0))
    expected = plain.volume_of(recording) - np.sum(np.log(noise.relative_sd(recording)))
    assert noise.volume_of(recording) == pytest.approx(expected)


def test_intervals_hold_the_truth_where_stamps_jitter():
    """Stiffness and damping within four standard deviations, misfit that of noise."""
    for seed in range(2):
        fit = identify(campaign(seed, jitter=2e-4), rng=np.random.default_rng(0), search=False).fit
        assert fit.reduced_chi2 == pytest.approx(1.0, abs=0.05)
        w2 = (10 * np.pi) ** 2 + 0.4**2
        for name, truth in (("k1", 0.5 * w2), ("c1", 0.4)):
            i = fit.names.index(name)
            assert abs(fit.mode[i] - truth) < 4 * fit.sd[i]


@pytest.mark.parametrize(("times", "fast"), [(2.6, False), (8.4, True)])
def test_only_a_line_that_windows_do_not_follow_ends_the_search_for_growth(times, fast) -> None:
    t = np.arange(4000) / 1000.0
    noise = 1e-6 * np.random.default_rng(0).standard_normal(t.size)
    motion = 5e-3 * np.exp(-0.4 * t) * np.cos(2 * np.pi * 5.0 * t)
    line = 5e-5 * np.cos(2 * np.pi * 5.0 * times * t)
    assert find_hum(motion + line + noise, 1e-3) is not None
    assert _has_fast_hum(Recording("a", "", motion + line + noise, 1e-3)) is fast
