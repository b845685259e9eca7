"""A steady hum is found with its frequency and amplitude, and nothing else is taken for one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayesimpact.data import hum as hum_module
from bayesimpact.data.bundled import bundled_campaign
from bayesimpact.data.hum import Hum, find_hum, hum_at
from bayesimpact.data.read import load_campaign

INTERVAL, SIZE = 1e-3, 5000
TIMES = np.arange(SIZE) * INTERVAL
LINE = 49.98
KNOWN = Hum(50.0, 14e-6, 0.0, 100.0, 30.0)


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


@pytest.mark.parametrize("times", [1.45, 1.79, 2.6])
def test_a_hum_between_the_multiples_of_a_motion_that_slows_down(times: float) -> None:
    """Mains at 1.8 times the frequency of a blade that falls by 15 % as impacts cease."""
    for seed in range(12):
        rng = np.random.default_rng(seed)
        slower = 28.0 * (1.0 + 0.15 * np.exp(-3.0 * TIMES))
        phase = 2 * np.pi * np.cumsum(slower) * INTERVAL
        motion = 3e-3 * np.exp(-1.5 * TIMES) * (np.cos(phase) + 0.02 * np.cos(2 * phase))
        line = 14e-6 * np.cos(2 * np.pi * times * 28.0 * TIMES + rng.uniform(0, 2 * np.pi))
        noise = 3e-6 * rng.standard_normal(SIZE)
        assert find_hum(motion + noise, INTERVAL) is None
        hum = find_hum(motion + line + noise, INTERVAL)
        assert hum is not None and hum.frequency == pytest.approx(times * 28.0, abs=0.02)
        assert hum.amplitude == pytest.approx(14e-6, rel=0.1)


def test_the_hum_of_another_recording_is_found_where_the_motion_hides_it() -> None:
    """Knocks at the beginning lift the level beside the line; three parts of four have it."""
    rng = np.random.default_rng(3)
    motion = 3e-3 * np.exp(-3.0 * TIMES) * np.cos(2 * np.pi * 28.0 * TIMES)
    motion[:1200] += 2e-4 * rng.standard_normal(1200)
    motion += 1e-6 * rng.standard_normal(SIZE)
    line = 14e-6 * np.cos(2 * np.pi * LINE * TIMES + 0.4)
    assert find_hum(motion + line, INTERVAL) is None
    for known, has in ((KNOWN, True), (replace(KNOWN, frequency=63.0), False),
                       (replace(KNOWN, cosine=40e-6), False),
                       (replace(KNOWN, frequency=1060.0), False)):  # fmt: skip
        found = hum_at(motion + line, INTERVAL, known)
        assert (found is not None) is has
        if found is not None:
            assert found.frequency == pytest.approx(LINE, abs=0.01)
            assert np.std(found.readings(TIMES) - line) < 0.05 * 14e-6


def test_a_motion_at_the_frequency_of_another_recordings_hum_is_none() -> None:
    own = 1e-5 * np.exp(-0.02 * TIMES) * np.cos(2 * np.pi * LINE * TIMES)
    noise = 1e-7 * np.random.default_rng(0).standard_normal(SIZE)
    assert hum_at(own + noise, INTERVAL, KNOWN) is None


def test_no_hum_in_odd_harmonics_of_a_motion_that_hardly_decays() -> None:
    """A cubic spring leaves the even ones empty, between which they would stand alone."""
    for seed in range(20):
        rng = np.random.default_rng(seed)
        height, phase = np.exp(-0.02 * TIMES), 2 * np.pi * 6.0 * TIMES + rng.uniform(0, 6.0)
        motion = sum(
            height**n * a * np.cos(n * phase) for n, a in ((1, 5e-3), (3, 3e-4), (5, 1e-5))
        )
        assert find_hum(motion + 1e-7 * rng.standard_normal(SIZE), INTERVAL) is None


@pytest.mark.parametrize("rate", [0.02, 0.4])
def test_no_hum_in_the_double_frequency_of_a_motion_that_hardly_decays(rate: float) -> None:
    for seed in range(30):
        rng = np.random.default_rng(seed)
        phase = 2 * np.pi * 6.0 * TIMES + rng.uniform(0, 2 * np.pi)
        height = np.exp(-rate * TIMES)
        motion = 5e-3 * (height * np.cos(phase) + 0.02 * height**2 * np.cos(2 * phase))
        assert find_hum(motion + 1e-6 * rng.standard_normal(SIZE), INTERVAL) is None


@pytest.mark.parametrize(("tapered", "expected"), [(False, 1e-3), (True, 2e-3)])
def test_the_chance_of_a_line_in_noise_is_the_stated_one(
    monkeypatch: pytest.MonkeyPatch, tapered: bool, expected: float
) -> None:
    """Neighbours behind a taper are not independent: twice as many exceed the level of 1e-3."""
    monkeypatch.setattr(hum_module, "FALSE_ALARM", 1e-3)
    threshold = hum_module._threshold.__wrapped__(1)
    rng, above, trials = np.random.default_rng(0), 0, 1500
    for _ in range(trials):
        noise = rng.standard_normal(602)
        series = np.diff(noise, 2) * np.hanning(600) if tapered else noise
        power = np.abs(np.fft.rfft(series)) ** 2
        above += int((power / hum_module._level(power) > threshold)[40:-40].sum())
    lines = trials * 221
    assert abs(above / lines - expected) < 5 * np.sqrt(2 * expected / lines)


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
