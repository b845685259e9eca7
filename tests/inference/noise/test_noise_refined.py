"""Colour of the noise from what a fit leaves above the motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_rig

from bayesimpact.data.campaign import Measurement, Smoothing
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import identify
from bayesimpact.inference.noise.refined import (
    fastest_frequency,
    refined_noise,
    rounding_variance,
)
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.trial.rig.measuring_chain import MeasuringChain

RNG = np.random.default_rng
RHO = 0.75
SEEDS = 12


def with_noise(fit: Fit, noise: Noise) -> Fit:
    """The same fit under another description of the noise."""
    likelihood = replace(fit.density.likelihood, noise=noise)
    return replace(fit, density=replace(fit.density, likelihood=likelihood))


def moved(fit: Fit, name: str, factor: float) -> Fit:
    """The model with one parameter wrong, and what it then leaves."""
    mode = fit.mode.copy()
    mode[fit.density.oscillator.layout.index(name)] *= factor
    return replace(fit, mode=mode, sums=fit.density.likelihood.misfit(mode[None])[0])


@pytest.fixture(scope="module")
def coloured():
    """Fits of recordings with planted AR(1) noise, described by a correlation that is too low."""
    chain = MeasuringChain(noise=small_rig.NOISE, correlation=RHO, offsets=small_rig.OFFSETS)
    start = Noise(0.6, level=4e-6, level_error=0.05, correlation_error=0.05)
    return [
        with_noise(
            identify(
                small_rig.record(seed, chain=chain), noise=start, rng=RNG(0), search=False
            ).fit,
            start,
        )
        for seed in range(SEEDS)
    ]


def test_planted_correlation_and_level_lie_within_their_errors(coloured):
    found = [refined_noise(fit) for fit in coloured]
    z_rho = np.array([(n.correlation - RHO) / n.correlation_error for n in found])
    z_level = np.array([(n.level / small_rig.NOISE - 1) / n.level_error for n in found])
    for z in (z_rho, z_level):
        assert abs(z.mean()) < 3.5 / np.sqrt(SEEDS)
        assert 0.4 < z.std(ddof=1) < 1.9  # 99.9 % of the spread of a dozen unit normals
    assert all(n.correlation_error < 0.03 for n in found)


def test_missing_physics_does_not_colour_the_noise(coloured):
    """A wrong stiffness moves the mass below twice its fastest frequency: the estimate stays."""
    fit = coloured[0]
    before = refined_noise(fit)
    wrong = moved(fit, "k2[1]", 1.0015)
    assert 1.2 < wrong.reduced_chi2 / fit.reduced_chi2 < 4
    after = refined_noise(wrong)
    assert abs(after.correlation - before.correlation) < before.correlation_error
    assert abs(after.level / before.level - 1) < before.level_error


def test_rounding_is_not_taken_for_a_weaker_correlation():
    digit = small_rig.NOISE
    chain = MeasuringChain(
        noise=small_rig.NOISE, correlation=RHO, offsets=small_rig.OFFSETS, rounding=digit
    )
    start = Noise(RHO, level=small_rig.NOISE, level_error=0.05, correlation_error=0.05)
    fit = with_noise(
        identify(small_rig.record(3, chain=chain), noise=start, rng=RNG(0), search=False).fit, start
    )
    assert np.sqrt(rounding_variance(fit)) == pytest.approx(digit / np.sqrt(12), rel=1e-6)
    found = refined_noise(fit)
    assert abs(found.correlation - RHO) < 3.5 * found.correlation_error
    assert abs(found.level / small_rig.NOISE - 1) < 3.5 * found.level_error


def behind_a_filter(seed: int, rho: float, hum: float = 0.0) -> Noise:
    """What is said of noise that passed a declared filter, beside a hum of 100 Hz."""
    filtered = Smoothing("savgol", window=7, polyorder=2)
    chain = MeasuringChain(
        noise=small_rig.NOISE, correlation=rho, offsets=small_rig.OFFSETS, smoothing=filtered
    )
    campaign = small_rig.record(seed, chain=chain, measurement=Measurement(smoothing=filtered))
    recordings = [
        replace(r, samples=r.samples + hum * np.sin(2 * np.pi * 100.0 * r.times))
        for r in campaign.recordings
    ]
    campaign = replace(campaign, recordings=tuple(recordings))
    return identify(campaign, rng=RNG(0), search=False).fit.density.likelihood.noise


def test_noise_is_coloured_behind_a_filter_too():
    found = [behind_a_filter(seed, 0.65) for seed in range(SEEDS)]
    z_rho = np.array([(n.correlation - 0.65) / n.correlation_error for n in found])
    z_level = np.array([(n.level / small_rig.NOISE - 1) / n.level_error for n in found])
    for z in (z_rho, z_level):
        assert abs(z.mean()) < 3.5 / np.sqrt(SEEDS)
        assert 0.4 < z.std(ddof=1) < 1.9


@pytest.mark.parametrize("hum", [0.0, 3.0])
def test_what_a_filter_leaves_of_white_noise_is_not_called_coloured(hum):
    for seed in range(4):
        assert behind_a_filter(seed, 0.0, hum * small_rig.NOISE).correlation == 0.0


def test_noise_that_is_known_stays(small, coloured):
    white = with_noise(small.fit, Noise(0.0, level=small_rig.NOISE))
    assert refined_noise(white) is white.density.likelihood.noise
    wrong = moved(coloured[0], "k1", 1.01)
    assert wrong.reduced_chi2 > 4
    assert refined_noise(wrong) is wrong.density.likelihood.noise


def test_a_declared_level_stays(coloured):
    fit = coloured[0]
    declared = replace(fit.density.likelihood.noise, level=4e-6, level_error=0.0)
    found = refined_noise(with_noise(fit, declared))
    assert found.level == 4e-6 and found.level_error == 0.0
    assert found.correlation != declared.correlation


def test_fastest_frequency_is_that_of_the_stiffest_contact(small):
    values = small_rig.true_values()
    expected = np.sqrt((values["k1"] + values["k2[1]"]) / small_rig.RIG.mass) / (2 * np.pi)
    assert fastest_frequency(small.fit) == pytest.approx(expected, rel=0.01)
