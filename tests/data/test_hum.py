"""A steady hum is found with its frequency and amplitude, and nothing else is taken for one."""

from __future__ import annotations

import numpy as np
import pytest

from bayesimpact.data.bundled import bundled_campaign
from bayesimpact.data.hum import find_hum
from bayesimpact.data.read import load_campaign

INTERVAL, SIZE = 1e-3, 5000
TIMES = np.arange(SIZE) * INTERVAL


def decay(rng: np.random.Generator, third: float = 0.0) -> np.ndarray:
    """Free decay of 6 Hz with a third harmonic that goes with the cube of the amplitude."""
    height = 5e-3 * np.exp(-0.4 * TIMES)
    phase = 2 * np.pi * 6.0 * TIMES + rng.uniform(0, 2 * np.pi)
    cube = third * (height / height[0]) ** 3
    return height * np.cos(phase) + 5e-3 * cube * np.cos(3 * phase)


@pytest.mark.parametrize("amplitude", [5e-7, 5e-6, 2e-4])
def test_frequency_and_amplitude(amplitude: float) -> None:
    """Noise of 1 um: the smallest hum is half of it.

    A line of amplitude a in white noise s over a time T: sd of the frequency sqrt(6 / n) s /
    (pi a T), of the amplitude s sqrt(2 / n) (Rife and Boorstyn 1974); tapers and quarters double
    both at most. The least that second differences let through of the decay is added.
    """
    noise, found = 1e-6, []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        frequency, phase = rng.uniform(45.0, 300.0), rng.uniform(0, 2 * np.pi)
        reading = amplitude * np.cos(2 * np.pi * frequency * TIMES + phase)
        hum = find_hum(decay(rng) + reading + noise * rng.standard_normal(SIZE), INTERVAL)
        found.append(hum)
        if hum is None:
            continue
        accuracy = 4 * 2 * noise * np.sqrt(2 / SIZE)
        spread = 4 * 2 * np.sqrt(6 / SIZE) * noise / (np.pi * amplitude * TIMES[-1])
        assert hum.frequency == pytest.approx(frequency, abs=spread + 1e-4)
        assert hum.amplitude == pytest.approx(amplitude, abs=accuracy + 2e-3 * amplitude)
        left = hum.readings(TIMES) - reading
        assert np.std(left) < 2 * accuracy + 0.02 * amplitude
    assert None not in found


@pytest.mark.parametrize("third", [0.0, 0.02])
def test_no_hum_in_noise_or_in_harmonics_of_a_decay(third: float) -> None:
    for seed in range(60):
        rng = np.random.default_rng(seed)
        noise = 1e-6 * rng.standard_normal(SIZE)
        assert find_hum(decay(rng, third) + noise, INTERVAL) is None


def test_no_hum_in_the_bundled_recordings() -> None:
    for name in ("paper", "concealed"):
        for r in load_campaign(bundled_campaign(name)).recordings:
            assert find_hum(r.samples, r.interval) is None


def test_a_burst_is_no_steady_hum() -> None:
    rng = np.random.default_rng(0)
    burst = np.where(TIMES < 1.2, 1e-4 * np.cos(2 * np.pi * 50 * TIMES), 0.0)
    noise = 1e-6 * rng.standard_normal(SIZE)
    assert find_hum(decay(rng) + burst + noise, INTERVAL) is None


def test_too_short_or_without_motion() -> None:
    assert find_hum(np.zeros(1000), INTERVAL) is None
    assert find_hum(decay(np.random.default_rng(0))[:200], INTERVAL) is None
