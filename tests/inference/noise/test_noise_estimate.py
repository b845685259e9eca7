"""Level and correlation of the noise, recovered from recordings over many seeds."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import small_rig
from scipy import stats

from bayesimpact.data.campaign import Campaign, Measurement
from bayesimpact.data.recording import Recording
from bayesimpact.errors import InputError
from bayesimpact.inference.noise.estimate import estimate_noise, unfiltered_noise
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.trial.rig.measuring_chain import MeasuringChain
from bayesimpact.trial.rig.recordings import Release, Rig

STIFF = Rig(mass=0.1, c1=0.05, k1=2000.0, c2=1.0, g=5e-4, k2={"1": 60_000.0})
RIGS = {
    "rig": (small_rig.RIG, small_rig.RELEASES, 1000.0, 2.0),
    "few samples": (small_rig.RIG, small_rig.RELEASES, 200.0, 6.0),
    "hard stop": (STIFF, (Release("a", "1", -3e-3), Release("b", "1", -2e-3)), 5000.0, 1.0),
    "no stop": (small_rig.PLAIN, small_rig.PLAIN_RELEASES, 500.0, 4.0),
}


@cache
def silent(name: str) -> Campaign:
    rig, releases, rate, duration = RIGS[name]
    return small_rig.record(
        rig=rig, releases=releases, chain=MeasuringChain(), rate=rate, duration=duration
    )


def noisy(campaign: Campaign, rho: float, sigma: float, seed: int) -> list[Recording]:
    rng = np.random.default_rng(seed)
    noise = Noise(rho)
    return [
        replace(r, samples=r.samples + noise.coloured(rng, r.samples.size, r.interval, sigma))
        for r in campaign.recordings
    ]


def chi2_limits(count: int) -> tuple[float, float]:
    return tuple(stats.chi2.ppf([1e-4, 1 - 1e-4], count))


@pytest.mark.parametrize(
    ("name", "sigma"),
    [("rig", 5e-6), ("rig", 5e-5), ("few samples", 5e-6), ("hard stop", 2e-6), ("no stop", 5e-6)],
)
def test_white_noise_is_found_white_and_its_level_within_its_error(name, sigma):
    found = [unfiltered_noise(noisy(silent(name), 0.0, sigma, seed)) for seed in range(8)]
    assert sum(f.correlation != 0.0 for f in found) <= 1
    z = np.array([(f.level / sigma - 1) / f.level_error for f in found])
    assert np.sum(z**2) < chi2_limits(8)[1] and abs(z.mean()) < 4 / np.sqrt(8)
    assert max(f.level_error for f in found) < 0.06


@pytest.mark.parametrize("rho", [0.3, 0.6, -0.3])
def test_level_and_correlation_of_coloured_noise(rho):
    sigma = 5e-6
    found = [unfiltered_noise(noisy(silent("rig"), rho, sigma, seed)) for seed in range(8)]
    for z in (
        np.array([(f.correlation - rho) / f.correlation_error for f in found]),
        np.array([(f.level / sigma - 1) / f.level_error for f in found]),
    ):
        assert chi2_limits(8)[0] < np.sum(z**2) < chi2_limits(8)[1]
        assert abs(z.mean()) < 4 / np.sqrt(8)
    assert max(f.correlation_error for f in found) < 0.06


@pytest.mark.parametrize("name", ["rig", "no stop"])
def test_a_steady_hum_is_no_noise(name):
    """Of 180 Hz, forty times the noise: level and colour are those without it, within its error."""
    campaign, z = silent(name), []
    for seed in range(8):
        clean = noisy(campaign, 0.0, 5e-6, seed)
        humming = [
            replace(r, samples=r.samples + 2e-4 * np.sin(2 * np.pi * 180.07 * r.times + seed))
            for r in clean
        ]
        found = unfiltered_noise(humming)
        z.append((found.level / 5e-6 - 1) / found.level_error)
        assert found.correlation == 0.0
    assert np.sum(np.square(z)) < chi2_limits(8)[1] and abs(np.mean(z)) < 4 / np.sqrt(8)


def test_a_few_disturbed_windows_do_not_count():
    """Glitches of thirty deviations in two of a hundred windows."""
    campaign, rng = silent("no stop"), np.random.default_rng(0)
    recordings = noisy(campaign, 0.0, 5e-6, 1)
    clean = unfiltered_noise(recordings)
    spoilt = []
    for r in recordings:
        samples = r.samples.copy()
        samples[rng.integers(0, samples.size, 3)] += 1.5e-4
        spoilt.append(replace(r, samples=samples))
    found = unfiltered_noise(spoilt)
    assert found.correlation == 0.0
    assert found.level == pytest.approx(clean.level, rel=0.05)


def test_a_stated_noise_level_is_taken():
    recordings = tuple(noisy(silent("rig"), 0.5, 5e-6, 2))
    campaign = replace(silent("rig"), recordings=recordings, measurement=Measurement(noise=7e-6))
    noise = estimate_noise(campaign)
    assert noise.level == 7e-6 and noise.source == "campaign.toml"
    assert noise.correlation == unfiltered_noise(recordings).correlation != 0.0


def test_recordings_too_short_are_refused():
    with pytest.raises(InputError, match="30 samples"):
        unfiltered_noise([Recording("a", "", np.sin(np.arange(30.0)), 1e-3)])


def test_a_motion_that_ends_below_the_step_of_its_readings():
    """Most windows are constant: the noise is the step's, and nothing is divided by it."""
    t = np.arange(12_000) * 1e-3
    motion = 0.3 * np.exp(-2.0 * t) * np.cos(6.0 * t)
    step = 1.5e-3
    readings = step * np.round(motion / step)
    recording = Recording("a", "", readings, 1e-3, quantity="angle")
    with np.errstate(all="raise"):
        noise = unfiltered_noise([recording])
    assert noise.level == pytest.approx(step / np.sqrt(12), rel=1e-6)
    assert noise.source == "the step of the readings" and noise.level_error > 0.0
