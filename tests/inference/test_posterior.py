"""Posterior draws, their intervals and what they predict; calibration of the modes' covariances."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID
from scipy import stats
from scipy.linalg import toeplitz

from bayesimpact.data.campaign import Campaign, Smoothing
from bayesimpact.data.recording import Recording
from bayesimpact.errors import InputError
from bayesimpact.inference.fit import Fit, PosteriorDensity
from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.mode import find_mode
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.inference.posterior import Posterior, sample
from bayesimpact.inference.prior import LogUniform, Uniform
from bayesimpact.inference.priors import Priors
from bayesimpact.model.measurement import smooth
from bayesimpact.model.oscillator import Oscillator, build_oscillator

SAVGOL = Smoothing("savgol", window=15, polyorder=2)
LAG = Smoothing("lag", time_constant=2e-3)
WIDE = {"c1": (0, 20), "k1": (0, 1e4), "c2": (0, 100), "k2": (0, 1e5)}


def flat_priors(oscillator: Oscillator) -> Priors:
    names = [n.split("[")[0] for n in oscillator.layout.names]
    return Priors(
        tuple(
            LogUniform(1e-9, 1e-2) if n == "sigma" else Uniform(*WIDE.get(n, (-10, 10)))
            for n in names
        )
    )


def plain(noise: Noise | None = None) -> Oscillator:
    """One free decay of 0.5 s, without a stop."""
    recording = Recording("a", "", np.zeros(500), 1e-3)
    smoothing = noise.smoothing if noise else None
    return build_oscillator(Campaign("x", 0.503, (recording,), stop=False), smoothing=smoothing)


def with_noise(
    oscillator: Oscillator, theta: np.ndarray, noise: Noise, rng: np.random.Generator
) -> Oscillator:
    """The same model for recordings that it made itself, with noise behind the filter."""
    sigma = theta[oscillator.layout.index("sigma")]
    recordings = []
    for recording, mean in zip(
        oscillator.campaign.recordings, oscillator.predict(theta), strict=True
    ):
        raw = noise.coloured(rng, mean.size, recording.interval, sigma)
        samples = mean + smooth(raw, noise.smoothing, recording.interval)
        recordings.append(replace(recording, samples=samples))
    campaign = replace(oscillator.campaign, recordings=tuple(recordings))
    return Oscillator(campaign, oscillator.effects, oscillator.layout, oscillator.smoothing)


def fitted(oscillator: Oscillator, noise: Noise, start: np.ndarray) -> Fit:
    return find_mode(
        PosteriorDensity(Likelihood(oscillator, noise), flat_priors(oscillator)), start
    )


NOISES = [Noise(), Noise(0.6), Noise(smoothing=SAVGOL), Noise(0.4, LAG)]


@pytest.mark.parametrize("noise", NOISES, ids=lambda n: n.kind)
def test_modes_scatter_about_the_truth_as_their_covariances_say(noise):
    """Squared distances in the metric of the covariance, over seeds, against chi squared."""
    releases = small_rig.RELEASES[1:]
    zeros = tuple(Recording(r.name, r.case, np.zeros(1000), 1e-3) for r in releases)
    oscillator = build_oscillator(Campaign("x", 0.503, zeros), smoothing=noise.smoothing)
    truth = small_rig.vector(oscillator.layout, small_rig.true_values(releases=releases))
    shared = oscillator.layout.roles("physical", "noise")
    rng, distances, draws = np.random.default_rng(1), [], 30
    for _ in range(draws):
        fit = fitted(with_noise(oscillator, truth, noise, rng), noise, truth)
        assert fit.converged
        off = (fit.mode - truth)[shared] / fit.sd[shared]
        correlation = fit.covariance[np.ix_(shared, shared)]
        correlation = correlation / np.outer(fit.sd[shared], fit.sd[shared])
        distances.append(off @ np.linalg.solve(correlation, off))
    low, high = stats.chi2.ppf([1e-4, 1 - 1e-4], draws * shared.size)
    # a fitted level adds to the scatter of squares: t instead of normal, 1 in the freedom
    assert low < np.sum(distances) < 1.03 * high


TRUTH = {"c1": 0.148, "k1": 808.556, "y0[a]": -6e-3, "v0[a]": 0.01, "offset[a]": 1e-5}
TRUTH |= {"sigma": 5e-6}


def posterior_of(fit: Fit, draws: np.ndarray) -> Posterior:
    return Posterior(fit, SimpleNamespace(draws=draws), 0)


@pytest.mark.parametrize("noise", NOISES, ids=lambda n: n.kind)
def test_predicted_recordings_scatter_as_recordings_do(noise):
    """All draws at one point: mean and covariance of the predictions are those of the noise."""
    oscillator = plain(noise)
    theta = small_rig.vector(oscillator.layout, TRUTH)
    data = with_noise(oscillator, theta, noise, np.random.default_rng(0))
    fit = fitted(data, noise, theta)
    count, part = 4000, slice(0, 40)
    posterior = posterior_of(fit, np.tile(theta, (2, 20, 100, 1)))
    found = posterior.predictive(0, count, np.random.default_rng(1))
    assert found.shape == (count, 500)
    deviations = (found - oscillator.predict(theta)[0])[:, part] / 5e-6
    matrix = smooth(np.eye(500), noise.smoothing, 1e-3).T
    covariance = matrix @ toeplitz(noise.correlation ** np.arange(500)) @ matrix.T
    covariance = covariance[part, part]
    variances = np.diag(covariance)
    error = np.sqrt((np.outer(variances, variances) + covariance**2) / count)
    z = (deviations.T @ deviations / count - covariance) / error
    assert np.abs(z).max() < 5
    assert np.abs(deviations.mean(axis=0) / np.sqrt(variances / count)).max() < 4.5


def test_predictions_carry_the_parameters_uncertainty_and_their_own_noise_level():
    oscillator = plain()
    theta = np.tile(small_rig.vector(oscillator.layout, TRUTH), (1, 2, 50, 1))
    theta[0, 0, :, oscillator.layout.index("offset[a]")] = 1e-3
    theta[0, 0, :, oscillator.layout.index("sigma")] = 1e-9
    theta[0, 1, :, oscillator.layout.index("sigma")] = 1e-4
    start = theta[0, 0, 0]
    fit = fitted(with_noise(oscillator, start, Noise(), np.random.default_rng(0)), Noise(), start)
    found = posterior_of(fit, theta).predictive(0, 100, np.random.default_rng(2))
    high = found[:, 0] > -5.5e-3
    assert high.sum() == 50
    spread = found[high].std(axis=0).mean(), found[~high].std(axis=0).mean()
    assert spread[0] < 2e-9 and spread[1] == pytest.approx(1e-4, rel=0.03)


def test_intervals_columns_and_thinning():
    oscillator = plain()
    start = small_rig.vector(oscillator.layout, TRUTH)
    fit = fitted(with_noise(oscillator, start, Noise(), np.random.default_rng(0)), Noise(), start)
    draws = np.random.default_rng(0).standard_normal((2, 30, 40, start.size))
    posterior = posterior_of(fit, draws)
    assert posterior.names == oscillator.layout.names
    np.testing.assert_array_equal(posterior.column("k1"), draws[..., 1].ravel())
    for probability in (0.5, 0.9):
        low, high = posterior.interval("k1", probability)
        inside = np.mean((draws[..., 1] > low) & (draws[..., 1] < high))
        assert inside == pytest.approx(probability, abs=1e-3)
    ends = posterior.interval("y0[a]")
    assert posterior.interval("y0") == {"y0[a]": ends} and len(ends) == 2
    with pytest.raises(InputError, match=r"'k9'; accepted: c1, k1, y0\[a\]"):
        posterior.interval("k9")
    short = replace(posterior, chains=SimpleNamespace(draws=draws, converged=True))
    assert repr(short) == "<Posterior of 'x': 2400 draws, converged>" and len(repr(fit)) < 80
    few = posterior.thinned(500, np.random.default_rng(1))
    assert few.shape == (500, start.size) and len(np.unique(few[:, 0])) == 500
    assert posterior.thinned(10**6, np.random.default_rng(1)).shape == (2400, start.size)


def test_the_sampler_agrees_with_the_curvature_where_the_posterior_is_normal():
    oscillator = plain()
    truth = small_rig.vector(oscillator.layout, TRUTH)
    fit = fitted(with_noise(oscillator, truth, Noise(), np.random.default_rng(3)), Noise(), truth)
    posterior = sample(fit, seed=4, target_ess=2000)
    assert posterior.chains.converged
    expected = fit.mode.copy()
    expected[-1] = np.sqrt(fit.sums[0] / (500 - 5 - 1.5))  # S / sigma^2 is chi squared, 500 - 5
    z = (posterior.draws.mean(axis=0) - expected) / fit.sd
    ratio = posterior.draws.std(axis=0) / fit.sd
    assert np.abs(z).max() < 4 / np.sqrt(2000)
    np.testing.assert_allclose(ratio, 1.0, atol=4 / np.sqrt(2 * 2000))


def test_draws_stay_inside_the_bounds():
    """An undamped oscillator: half of the normal approximation lies at c1 < 0."""
    oscillator = plain()
    truth = small_rig.vector(oscillator.layout, TRUTH | {"c1": 0.0})
    fit = fitted(with_noise(oscillator, truth, Noise(), np.random.default_rng(3)), Noise(), truth)
    posterior = sample(fit, seed=4, target_ess=1000)
    c1 = posterior.column("c1")
    assert c1.min() >= 0.0
    part, sd = fit.linearisation[0], fit.sd[0]
    gradient = part.jacobian[:, 0] @ part.residual / fit.value("sigma") ** 2
    centre = fit.value("c1") + gradient * sd**2  # of the normal density that the bound cuts
    assert abs(centre) < 2 * sd
    expected = stats.truncnorm(-centre / sd, np.inf, centre, sd)
    assert abs(c1.mean() - expected.mean()) < 4 * expected.std() / np.sqrt(1000)
    np.testing.assert_allclose(
        np.quantile(c1, [0.05, 0.5, 0.95]), expected.ppf([0.05, 0.5, 0.95]), atol=0.1 * sd
    )


def test_a_chain_belongs_to_its_data_and_model(tmp_path):
    oscillator = plain()
    truth = small_rig.vector(oscillator.layout, TRUTH)
    data = with_noise(oscillator, truth, Noise(), np.random.default_rng(3))
    fit = fitted(data, Noise(), truth)
    settings = {"seed": 1, "folder": tmp_path, "max_steps": 100}
    first = sample(fit, **settings)
    again = sample(fit, resume=True, **settings)
    np.testing.assert_array_equal(first.draws, again.draws)
    other = fitted(with_noise(oscillator, truth, Noise(), np.random.default_rng(4)), Noise(), truth)
    same_data = fit.density.likelihood
    heavier = replace(data.campaign, mass=0.504)
    changed = (
        other,
        replace(fit, density=PosteriorDensity(Likelihood(data, Noise(0.1)), fit.density.priors)),
        replace(
            fit,
            density=PosteriorDensity(
                same_data, Priors((Uniform(0, 21), *fit.density.priors.parameters[1:]))
            ),
        ),
        replace(
            fit,
            density=PosteriorDensity(
                Likelihood(Oscillator(heavier, (), data.layout), Noise()), fit.density.priors
            ),
        ),
        replace(
            fit,
            density=PosteriorDensity(
                Likelihood(
                    Oscillator(data.campaign, (BY_ID["contact_no_tension"],), data.layout), Noise()
                ),
                fit.density.priors,
            ),
        ),
    )
    for fit_of_something_else in changed:
        with pytest.raises(InputError):
            sample(fit_of_something_else, resume=True, **settings)
