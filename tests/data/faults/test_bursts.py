"""Bad samples close to each other are found where they were put; impacts and noise are none."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter, savgol_filter

from bayesimpact.data.bundled import bundled_campaign
from bayesimpact.data.faults.bursts import MOST, LocalPolynomial, find_bursts
from bayesimpact.data.faults.find import recording_faults
from bayesimpact.data.faults.spikes import find_spikes, lone_spikes
from bayesimpact.data.quantity import Quantity
from bayesimpact.data.read import load_campaign
from bayesimpact.data.recording import Recording

NOISE = 1e-4
CLUSTERS = ((79, 84), (87, 88), (109, 113), (173, 175), (178, 182), (186, 187), (380, 383))


def decay(seed: int, count: int = 532) -> np.ndarray:
    """A free decay of 74 samples a period, white noise."""
    t = np.arange(count)
    motion = 0.07 * np.exp(-2e-4 * t) * np.cos(2 * np.pi * t / 74.5)
    return motion + NOISE * np.random.default_rng(seed).standard_normal(count)


def planted(x: np.ndarray, size: float, seed: int) -> np.ndarray:
    """Runs of either sign, every sample at 0.7 to 1.3 of the size."""
    rng, x = np.random.default_rng([seed, 1]), x.copy()
    for first, end in CLUSTERS:
        x[first:end] += rng.choice([-1, 1]) * size * rng.uniform(0.7, 1.3, end - first)
    return x


def places(recording: Recording) -> set[int]:
    return {i for f in find_spikes(recording) for a, b in f.spans for i in range(a, b)}


@pytest.mark.parametrize("size", [50.0, 150.0, 1000.0, 1e5])
@pytest.mark.parametrize("seed", range(3))
def test_runs_close_to_each_other(size: float, seed: int) -> None:
    recording = Recording("r", "", planted(decay(seed), size * NOISE, seed), 0.01)
    assert places(recording) == {i for a, b in CLUSTERS for i in range(a, b)}
    alone = {i for f in lone_spikes(recording) for a, b in f.spans for i in range(a, b)}
    assert len(alone) < 10  # of 20: what lies close together hides itself


def test_they_are_one_fault_with_its_remedy() -> None:
    recording = Recording("r", "", planted(decay(1), 50 * NOISE, 1), 0.01)
    (fault,) = recording_faults(recording)
    assert fault.id == "recording_spikes" and fault.spans == CLUSTERS
    assert fault.statement.startswith("7 spikes of up to ")
    assert fault.remedy.startswith("exclude_s = [[0.786, 0.834], [0.866, 0.874], ")
    assert fault.size == pytest.approx(50 * NOISE, rel=0.35)


def test_more_than_a_tenth_of_the_samples_are_the_signal() -> None:
    x = decay(2)
    x[20:500:24] += 0.01
    x[21:500:24] += 0.01
    assert np.isclose(MOST, 0.1)
    assert sum(f.span[1] - f.span[0] for f in find_bursts(Recording("r", "", x, 0.01))) == 40
    x[22:500:24] += 0.01
    assert find_bursts(Recording("r", "", x, 0.01)) == []


def test_no_impact_is_set_aside_with_runs_next_to_a_stop() -> None:
    """In the paper's recording: runs in flight, in contact and at its edges.

    Between runs of one sign and size two good samples may be taken for the bad ones: nothing
    further away may be.
    """
    sound = load_campaign(bundled_campaign("paper")).recordings[4]
    x, rng = sound.samples.copy(), np.random.default_rng(5)
    bad, near = np.zeros((2, x.size), bool)
    for place in range(300, 5000, 311):
        for first in (place, place + 7, place + 13):
            width = int(rng.integers(1, 5))
            bad[first : first + width] = near[place : first + width] = True
            x[first : first + width] += rng.choice([-1, 1]) * 60 * 5e-6
    assert find_bursts(sound) == []
    recording = Recording("r", sound.case, x, sound.interval)
    found = np.zeros(x.size, bool)
    found[list(places(recording))] = True
    assert not np.any(found & ~near) and np.sum(found & ~bad) <= 2
    assert np.mean(found[bad]) > 0.5


@pytest.mark.parametrize("width", [0, 1, 3, 5, 8])
@pytest.mark.parametrize("noise", [1e-6, 1e-4, 1e-2])
def test_a_hard_impact_is_none_however_short(width: int, noise: float) -> None:
    """A mass thrown back, its contact half a sine of `width` samples and as steep at its ends."""
    t = np.arange(3000) + 0.37
    phase = np.mod(t, 74.3)
    depth = width / 74.3
    inside = phase < width
    x = np.where(
        inside,
        depth * np.sin(np.pi * phase / max(width, 1)),
        -np.sin(np.pi * (phase - width) / (74.3 - width)),
    )
    for seed in range(5):
        y = x + noise * np.random.default_rng(seed).standard_normal(t.size)
        assert find_bursts(Recording("r", "1", y, 1e-3)) == []


@pytest.mark.parametrize("quantity", ["velocity", "acceleration"])
def test_a_step_of_the_velocity_and_a_blow_in_the_acceleration_are_none(
    quantity: Quantity,
) -> None:
    t = np.arange(2000)
    if quantity == "velocity":
        x = np.sin(2 * np.pi * (t % 80) / 200)
    else:
        x = np.sin(2 * np.pi * t / 200)
        x[78::80] -= 30.0
        x[79::80] -= 20.0
    x += 1e-3 * np.random.default_rng(3).standard_normal(x.size)
    assert find_bursts(Recording("r", "1", x, 1e-3, quantity=quantity)) == []


def noise_of(kind: str, rng: np.random.Generator, count: int) -> np.ndarray:
    white = rng.standard_normal(count)
    if kind == "ar1":
        return lfilter([1.0], [1.0, -0.9], white)
    if kind == "filtered":
        return savgol_filter(white, 9, 2)
    if kind == "hum":
        return white + 20 * np.sin(2.1 * np.arange(count))
    return white


@pytest.mark.parametrize("kind", ["white", "ar1", "filtered", "hum", "coarse"])
def test_noise_is_none(kind: str) -> None:
    alarms = 0
    for seed in range(60):
        rng = np.random.default_rng([seed, 2])
        sd = 0.07 * 10 ** rng.uniform(-5, -1)
        x = 0.07 * np.cos(2 * np.pi * np.arange(900) / rng.uniform(12, 300))
        x = x + sd * noise_of(kind, rng, x.size)
        if kind == "coarse":
            step = sd * rng.uniform(1, 50)
            x = np.round(x / step) * step
        alarms += bool(find_bursts(Recording("r", "", x, 0.01)))
    assert alarms == 0


def test_samples_that_do_not_count_are_neither_good_nor_bad() -> None:
    x, used = planted(decay(3), 50 * NOISE, 3), np.ones(532, bool)
    used[79:88] = used[103:107] = False
    x[103:107] += 20 * NOISE
    found = find_bursts(Recording("r", "", x, 0.01, used=used))
    assert [one.span for one in found] == [c for c in CLUSTERS if c[0] > 100]


@pytest.mark.parametrize(("degree", "beside"), [(3, 8), (4, 12)])
def test_the_share_of_a_corner_that_good_samples_show(degree: int, beside: int) -> None:
    """Against polynomials fitted by `polyfit` to corners and steps anywhere."""
    rng, run = np.random.default_rng(6), np.arange(3.0)
    good = np.concatenate([np.arange(-beside, 0), np.arange(3, 3 + beside)])
    curve = LocalPolynomial(1.0 * good, degree)
    largest = 0.0
    for place in rng.uniform(-beside, beside + 3, 3000):
        for power in (0, 1):
            shape = [np.where(t > place, (t - place) ** power, 0.0) for t in (good, run)]
            fit = np.polyfit(good, shape[0], degree)
            rest = shape[0] - np.polyval(fit, good)
            rms = np.sqrt(rest @ rest / (good.size - degree - 1))
            if rms > 1e-9:
                largest = max(largest, np.abs(shape[1] - np.polyval(fit, run)).max() / rms)
    assert curve.corner(run) == pytest.approx(largest, rel=0.01)
    noise = rng.standard_normal((20000, good.size + 3))
    _, missed = curve.misses(noise[:, :-3], run, noise[:, -3:])
    assert curve.leverage(run) == pytest.approx(missed.std(axis=0).max(), rel=0.03)
