"""Samples that are set aside: the likelihood against dense covariance matrices of what is left."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from scipy.linalg import toeplitz

from bayesimpact.data.campaign import Campaign, Smoothing
from bayesimpact.data.gaps import without
from bayesimpact.inference.identify import identify
from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.noise.estimate import estimate_noise
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.measurement import smooth
from bayesimpact.model.oscillator import build_oscillator
from bayesimpact.trial.bundle import PAPER_RIG
from bayesimpact.trial.rig.measuring_chain import MeasuringChain
from bayesimpact.trial.rig.recordings import Release, make_campaign

INTERVAL = 1e-3


def simulated(duration: float, noise: float = 5e-6) -> Campaign:
    """Three recordings of the paper's rig by the independent simulator."""
    releases = [Release(f"r{i}", str(1 + i % 3), -5e-3 - 5e-4 * i, 0.0) for i in range(3)]
    rng = np.random.default_rng(5)
    return make_campaign(
        "gaps",
        PAPER_RIG,
        releases,
        {},
        MeasuringChain(noise),
        rate=1000.0,
        duration=duration,
        rng=rng,
    )


def gaps(n: int) -> np.ndarray:
    used = np.ones(n, dtype=bool)
    used[[0, 7, 8, 9, 20, n - 1]] = False
    return used


@pytest.mark.parametrize("rho", [0.0, 0.7, -0.4])
def test_the_density_is_that_of_the_samples_left(rho: float) -> None:
    rng = np.random.default_rng(1)
    n, sigma = 40, 2e-6
    noise, x, used = Noise(correlation=rho), rng.standard_normal(n) * sigma, gaps(n)
    white = noise.whiten(x, INTERVAL, used)
    size = noise.size(n, INTERVAL, used)
    ours = (
        -size * (np.log(sigma) + 0.5 * np.log(2 * np.pi))
        - white @ white / (2 * sigma**2)
        + noise.log_volume(n, INTERVAL, used)
    )
    covariance = sigma**2 * toeplitz(rho ** np.arange(n))[np.ix_(used, used)]
    dense = stats.multivariate_normal(np.zeros(size), covariance).logpdf(x[used])
    assert ours == pytest.approx(dense, rel=1e-10)


def test_a_mask_without_gaps_changes_nothing() -> None:
    x = np.random.default_rng(2).standard_normal(50)
    everything = np.ones(50, dtype=bool)
    noise = Noise(correlation=0.5)
    np.testing.assert_allclose(noise.whiten(x, 1.0, everything), noise.whiten(x, 1.0), rtol=1e-14)
    assert noise.log_volume(50, 1.0, everything) == pytest.approx(noise.log_volume(50, 1.0))


@pytest.mark.parametrize(
    "smoothing", [Smoothing("savgol", 21, 2), Smoothing("lag", time_constant=0.003)]
)
def test_behind_a_filter_the_numbers_are_white_and_blind_to_what_it_carried(
    smoothing: Smoothing,
) -> None:
    rng = np.random.default_rng(3)
    n = 3000
    used = np.ones(n, dtype=bool)
    used[1000:1004] = used[2000] = False
    noise = Noise(smoothing=smoothing)
    raw = rng.standard_normal((200, n))
    spoiled = raw.copy()
    spoiled[:, 1001:1004] += 1e3  # before the filter
    white = noise.whiten(smooth(raw, smoothing, INTERVAL), INTERVAL, used)
    size = noise.size(n, INTERVAL, used)
    assert white.shape[-1] == size
    assert np.mean(white**2) == pytest.approx(1.0, abs=0.02)
    whole = noise.size(n, INTERVAL)
    assert 0.8 * whole < size < whole
    again = noise.whiten(smooth(spoiled, smoothing, INTERVAL), INTERVAL, used)
    # a lag forgets as exp(-t / tau), five of which are cut; a Savitzky-Golay filter at once
    np.testing.assert_allclose(again, white, atol=1e-9 if smoothing.kind == "savgol" else 300)
    signal, start = noise.in_time(white, n, INTERVAL, used)
    assert start == 0.0 and signal.shape == raw.shape
    np.testing.assert_allclose(np.sum(signal**2, axis=1), np.sum(white**2, axis=1), rtol=1e-3)


@pytest.mark.parametrize("rho", [0.0, 0.5])
def test_spoiled_samples_set_aside_do_not_move_the_mode(rho: float) -> None:
    campaign = simulated(duration=1.2, noise=5e-6)
    spoiled, expected = [], []
    for number, recording in enumerate(campaign.recordings):
        samples = recording.samples.copy()
        spans = [(100 + 10 * number, 103 + 10 * number), (600, 640)]
        for first, end in spans:
            samples[first:end] += 1e-3
        spoiled.append(without(replace(recording, samples=samples), spans))
        expected.append(without(recording, spans))
    found, clean = (
        identify(
            replace(campaign, recordings=tuple(recordings)),
            rng=np.random.default_rng(0),
            noise=Noise(correlation=rho, level=5e-6, level_error=0.01),
            search=False,
        ).fit
        for recordings in (spoiled, expected)
    )
    assert np.all(np.abs(found.mode - clean.mode) < 1e-2 * clean.sd)
    if rho == 0.0:
        assert 0.9 < found.reduced_chi2 < 1.1
    assert found.rms < 6e-6


def test_sums_of_squares_count_no_sample_set_aside() -> None:
    campaign = simulated(duration=1.0, noise=5e-6)
    first = without(campaign.recordings[0], [(50, 60)])
    gapped = replace(campaign, recordings=(first, *campaign.recordings[1:]))
    oscillator = build_oscillator(campaign)
    theta = identify(campaign, rng=np.random.default_rng(0), search=False).fit.mode
    likelihood = Likelihood(build_oscillator(gapped), Noise(level=5e-6))
    sums = likelihood.misfit(theta)[0]
    predicted = oscillator.predict(theta)[0]
    kept = np.delete(first.samples - predicted, np.arange(50, 60))
    assert sums[0] == pytest.approx(kept @ kept, rel=1e-9)
    assert likelihood.sizes[0] == kept.size
    part = likelihood.linearise(theta)[0]
    assert part.residual @ part.residual == pytest.approx(sums[0], rel=1e-9)
    assert not part.jacobian[50:60].any()


def test_the_noise_estimate_knows_no_stand_in() -> None:
    campaign = simulated(duration=2.0, noise=5e-6)
    spans = [(k, k + 6) for k in range(20, 1900, 40)]
    gapped = replace(campaign, recordings=tuple(without(r, spans) for r in campaign.recordings))
    assert estimate_noise(gapped).level == pytest.approx(5e-6, rel=0.1)
