"""The level of the noise behind a filter: under an input, of derivatives, beside friction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_rig
from driven_rigs import driven_rig

from bayesimpact.data.campaign import Campaign, Measurement, Smoothing
from bayesimpact.data.recording import Recording
from bayesimpact.inference.identify import identify
from bayesimpact.inference.noise.estimate import estimate_noise
from bayesimpact.inference.noise.spectrum import smoothed_noise
from bayesimpact.model.measurement import smooth
from bayesimpact.trial.rig.measuring_chain import MeasuringChain

LEVELS = {"displacement": 5e-6, "velocity": 2e-4, "acceleration": 1e-2}
QUANTITIES = tuple(LEVELS)
NINE = Smoothing("savgol", 9, 2)


def smoothed(campaign: Campaign, smoothing: Smoothing) -> Campaign:
    recordings = [
        replace(r, samples=smooth(r.samples, smoothing, r.interval)) for r in campaign.recordings
    ]
    return replace(
        campaign, recordings=tuple(recordings), measurement=Measurement(smoothing=smoothing)
    )


@pytest.mark.parametrize("quantity", QUANTITIES)
@pytest.mark.parametrize("seed", [1, 3, 4, 5, 6, 7])
def test_the_level_under_an_input(seed, quantity):
    rig = driven_rig(seed, quantity)
    for window in (5, 9):
        noise = estimate_noise(smoothed(rig.campaign, Smoothing("savgol", window, 2)))
        assert noise.level == pytest.approx(rig.noise, rel=max(0.08, 3 * noise.level_error))
        assert noise.correlation == 0.0 and noise.level_error < 0.1


@pytest.mark.parametrize(("seed", "quantity"), [(0, "velocity"), (4, "displacement")])
def test_a_residual_behind_the_filter_is_half_of_the_noise_before_it(seed, quantity):
    """Windows of 12 samples span a third of the fast motion of seed 0: a bound, three times off."""
    rig = driven_rig(seed, quantity)
    found = identify(smoothed(rig.campaign, NINE), rng=np.random.default_rng(0), search=False)
    assert found.noise.level == pytest.approx(rig.noise, rel=0.1)
    assert found.fit.rms == pytest.approx(0.5 * rig.noise, rel=0.1)
    assert found.fit.reduced_chi2 == pytest.approx(1.0, abs=0.2)


@pytest.mark.parametrize(
    ("quantity", "force"),
    [(quantity, 0.0) for quantity in QUANTITIES]
    + [("displacement", 0.3), ("velocity", 0.03), ("acceleration", 0.03)],
)
@pytest.mark.parametrize("stop", [True, False])
def test_the_level_in_decays(stop, quantity, force):
    """Half cycles said 50 and 400 times it of velocities and accelerations at a stop.

    And 8 to 13 times beside friction of a tenth of the first spring force, or less.
    """
    campaign = small_rig.record(
        effects={"coulomb_friction": {"force": force}} if force else None,
        rig=small_rig.RIG if stop else small_rig.PLAIN,
        releases=small_rig.RELEASES if stop else small_rig.PLAIN_RELEASES,
        chain=MeasuringChain(), duration=4.0, quantity=quantity,
    )  # fmt: skip
    rng, level = np.random.default_rng(0), LEVELS[quantity]
    noisy = [
        replace(r, samples=r.samples + level * rng.standard_normal(r.samples.size))
        for r in campaign.recordings
    ]
    whole = replace(campaign, recordings=tuple(noisy))
    noise = estimate_noise(smoothed(whole, Smoothing("savgol", 21, 2)))
    assert noise.level == pytest.approx(level, rel=max(0.05, 3 * noise.level_error))
    assert noise.level_error < 0.15


def test_half_cycles_of_few_samples_leave_the_bound() -> None:
    """Of a motion of 36 samples a period a wide filter leaves nothing that is not motion."""
    t, rng = 1e-3 * np.arange(3000), np.random.default_rng(0)
    raw = 2e-3 * np.exp(-0.3 * t) * np.cos(2 * np.pi * 27.5 * t) + 8e-6 * rng.standard_normal(3000)
    smoothing = Smoothing("savgol", 15, 2, declared_window=15)
    recording = Recording("a", "", smooth(raw[None], smoothing, 1e-3)[0], 1e-3)
    assert smoothed_noise([recording], smoothing) is None
    campaign = Campaign(
        "ribbon", 0.09, (recording,), stop=False, measurement=Measurement(smoothing=smoothing)
    )
    noise = estimate_noise(campaign)
    assert noise.is_bound and 4e-6 < noise.level < 4e-5
