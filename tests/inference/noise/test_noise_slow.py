"""White and AR(1) noise from all that a fit leaves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_rig
from scipy import stats

from bayesimpact.data.campaign import Campaign, Measurement, Smoothing
from bayesimpact.diagnosis.measurement.whiteness import ljung_box
from bayesimpact.inference.identify import identify
from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.noise import slow
from bayesimpact.inference.noise.slow import slow_noise
from bayesimpact.inference.noise.whitening import Noise

RNG = np.random.default_rng
CORRELATION, SIZE, SEEDS = 0.95, 1.25, 12  # of the slow part, over the white one
SHARE = 1 / (1 + SIZE**2)


def recorded(seed: int) -> Campaign:
    return small_rig.with_slow(small_rig.record(seed), seed, SIZE, CORRELATION)


def fitted(campaign: Campaign, **options):
    return identify(campaign, rng=RNG(0), search=False, **options).fit


@pytest.fixture(scope="module")
def found():
    """What is found in recordings with planted slow noise."""
    campaigns = (
        small_rig.with_slow(small_rig.record(seed), seed, SIZE, CORRELATION)
        for seed in range(SEEDS)
    )
    return [slow_noise(fitted(campaign)) for campaign in campaigns]


def white_share(noise: Noise) -> float:
    return sum(share for rho, share in noise.parts if rho == 0.0)


def test_planted_shape_and_level_are_found_without_bias(found):
    """Means over seeds against their own standard errors."""
    level = small_rig.NOISE * np.sqrt(1 + SIZE**2)
    told = np.array([(n.correlation, white_share(n), n.level) for n in (f.noise for f in found)])
    error = told.std(axis=0, ddof=1) / np.sqrt(SEEDS)
    z = (told.mean(axis=0) - (CORRELATION, SHARE, level)) / error
    assert np.abs(z).max() < stats.t.ppf(0.9995, SEEDS - 1)
    assert (error / (CORRELATION, SHARE, level) < (0.01, 0.1, 0.05)).all()


def test_what_it_leaves_is_white_and_of_unit_variance(found):
    p_values = [ljung_box(x) for f in found for x in f.residuals]
    assert stats.kstest(p_values, "uniform").pvalue > 1e-3
    variances = [float(np.mean(np.concatenate(f.residuals) ** 2)) for f in found]
    np.testing.assert_allclose(variances, 1.0, atol=0.02)
    assert min(f.log_evidence_gain for f in found) > 100.0


def test_its_gain_is_the_log_likelihood_ratio_beside_few_parameters(found):
    """Against dense covariances of one recording, its parameters as good as known."""
    campaign = recorded(0)
    fit, noise = fitted(campaign), found[0].noise
    rows = []
    for part in fit.linearisation:
        lags = np.arange(part.residual.size)
        apart = np.abs(lags[:, None] - lags)
        covariance = sum(share * rho**apart for rho, share in noise.parts)
        square = part.residual @ np.linalg.solve(covariance, part.residual)
        rows.append((square, np.linalg.slogdet(covariance)[1], part.residual @ part.residual))
    square, volume, plain = np.sum(rows, axis=0)
    total = sum(r.samples.size for r in campaign.recordings)
    ratio = -0.5 * (total * np.log(square / plain) + volume)
    # every parameter is worth a few nats, the sixth of a percent of the whole
    assert found[0].log_evidence_gain == pytest.approx(ratio, abs=5.0 * fit.mode.size)
    assert ratio > 1000.0


def test_white_noise_has_no_slow_part():
    found = [slow_noise(fitted(small_rig.record(seed))) for seed in range(6)]
    # two more parameters: twice the gain is chi-squared with two degrees of freedom, or less
    assert stats.chi2.sf(2 * max(f.log_evidence_gain for f in found), 2) > 1e-4 / 6


@pytest.mark.parametrize(
    "measurement", [Measurement(smoothing=Smoothing("savgol", 11, 2)), Measurement(noise=5e-6)]
)
def test_behind_a_filter_or_of_a_stated_level_nothing_is_said(measurement):
    campaign = replace(small_rig.record(0), measurement=measurement)
    assert slow_noise(fitted(campaign)) is None


def test_noise_that_rises_over_decades_of_frequency_takes_two_correlation_times():
    """Flicker noise: its power goes as 1 / f."""
    rng, campaign = RNG(7), small_rig.record(7)

    def flicker(n: int) -> np.ndarray:
        f = np.fft.rfftfreq(4 * n)
        f[0] = np.inf
        z = rng.standard_normal((2, f.size)) / np.sqrt(f)
        x = np.fft.irfft(z[0] + 1j * z[1], 4 * n)[:n]
        return x / x.std()

    recordings = (
        replace(r, samples=r.samples + small_rig.NOISE * flicker(r.samples.size))
        for r in campaign.recordings
    )
    found = slow_noise(fitted(replace(campaign, recordings=tuple(recordings))))
    slow = [rho for rho, _ in found.noise.parts if rho > 0.0]
    assert len(slow) == 2 and np.log(min(slow)) < 4 * np.log(max(slow))


def test_shapes_are_compared_by_no_rounding(found):
    """Backwards, readings have the same spectra but for rounding, which an offset's would be."""
    fit, shapes = fitted(recorded(0)), [f.noise for f in found[:2]]
    plain = Likelihood(fit.density.oscillator, Noise(level=small_rig.NOISE))
    linear = plain.linearise(fit.mode, 0.05 * fit.sd)
    backwards = tuple(
        replace(p, residual=p.residual[::-1].copy(), jacobian=p.jacobian[::-1].copy())
        for p in linear
    )
    spectra = [slow._Spectra(fit, parts) for parts in (linear, backwards)]
    one, other = ([s.log_evidence(shape) for shape in shapes] for s in spectra)
    assert np.diff(one) == pytest.approx(np.diff(other), abs=1e-6)
    whole = [slow._Whole(fit, linear, shape).log_evidence for shape in shapes]
    assert np.diff(one) == pytest.approx(np.diff(whole), abs=1.0)  # but for the recordings' ends
