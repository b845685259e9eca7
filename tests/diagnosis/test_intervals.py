"""Intervals that carry what is unexplained, against the joint linear problem; whiteness."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import small_rig
from scipy import stats

from bayesimpact.diagnosis.directions import sigma_of
from bayesimpact.diagnosis.extend import campaign_scales
from bayesimpact.diagnosis.force import basis_responses, missing_force
from bayesimpact.diagnosis.intervals import Intervals, intervals, sandwich
from bayesimpact.diagnosis.whiteness import combined, ljung_box, whiteness_p
from bayesimpact.inference.noise import Noise


def test_intervals_are_the_marginal_of_the_joint_problem(small):
    """Parameters (their priors flat) and coefficients of the force, solved together."""
    fit, scales = small.fit, campaign_scales(small.fit)
    force = missing_force(fit, scales, rng=np.random.default_rng(0), knots=8)
    assert force.knots == 8
    widths = 3e-5 * np.repeat([scales.force, scales.force / scales.speed], 8)
    scaled = force.projection.information * np.outer(widths, widths)
    covariance = np.linalg.inv(scaled + np.eye(16)) * np.outer(widths, widths)
    force = replace(force, covariance=covariance, mean=covariance @ force.projection.score)
    state = SimpleNamespace(candidate=SimpleNamespace(fit=fit), unknown=force, is_white=True)
    found = intervals(fit, state)
    d = fit.mode.size
    responses = basis_responses(fit, force.effect, 8, scales)
    matrix, right = np.zeros((d + 16, d + 16)), np.zeros(d + 16)
    for lin, part, s in zip(fit.linearisation, responses, sigma_of(fit), strict=True):
        block = np.zeros((lin.residual.size, d + 16))
        block[:, lin.columns] = lin.jacobian / s
        block[:, d:] = part
        matrix += block.T @ block
        right += block.T @ (lin.residual / s)
    sigma = fit.names.index("sigma")
    matrix[sigma, sigma] = 1 / fit.covariance[sigma, sigma]
    matrix[d:, d:] += np.diag(widths**-2.0)
    scale = np.sqrt(np.diag(matrix))
    joint = np.linalg.inv(matrix / np.outer(scale, scale)) / np.outer(scale, scale)
    expected = joint[:d, :d]
    ratio = np.sqrt(np.diag(found.covariance) / np.diag(expected))
    assert np.all((ratio > 0.99) & (ratio < 1.5)), ratio  # the residual's own colour comes on top
    shift = (joint @ right)[:d]
    np.testing.assert_allclose((found.mean - fit.mode) / fit.sd, shift / fit.sd, atol=0.05)
    assert np.all(np.diag(found.covariance) >= 0.999 * np.diag(fit.covariance))


def test_intervals_are_central():
    bounds = np.array([0.0, -np.inf]), np.array([np.inf, np.inf])
    found = Intervals(("a", "b"), np.array([1.0, 2.0]), np.diag([4.0, 9.0]), *bounds)
    assert stats.norm(2, 3).cdf(found.quantiles("b")) == pytest.approx([0.05, 0.5, 0.95])
    with pytest.raises(KeyError):
        found.quantiles("c")


@pytest.mark.parametrize("mean", [1.0, 0.0, -3.0, -300.0])
def test_a_bound_cuts_the_posterior_and_the_median_stays_inside(mean):
    bounds = np.array([0.0]), np.array([np.inf])
    found = Intervals(("c1",), np.array([mean]), np.array([[1.0]]), *bounds)
    low, median, high = found.quantiles("c1")
    assert 0.0 <= low <= median <= high and np.isfinite(high)
    if mean > -10:
        draws = np.random.default_rng(0).normal(mean, 1.0, 4_000_000)
        draws = draws[draws > 0]
        error = 4 / np.sqrt(draws.size)  # of a quantile, over the density there (at least 0.1)
        expected = np.percentile(draws, [5, 50, 95])
        np.testing.assert_allclose([low, median, high], expected, atol=10 * error)


def test_a_large_misfit_counts_the_shift_as_uncertainty(small):
    fit, scales = small.fit, campaign_scales(small.fit)
    force = missing_force(fit, scales, rng=np.random.default_rng(0), knots=8)
    force = replace(force, mean=1e-3 * scales.force * np.ones(16))
    far = replace(fit, sums=100.0 * fit.sums)
    shift = force.projection.absorbed @ force.mean
    found = intervals(far, SimpleNamespace(candidate=SimpleNamespace(fit=far), unknown=force))
    np.testing.assert_array_equal(found.mean, fit.mode)
    assert np.all(np.sqrt(np.diag(found.covariance)) >= np.abs(shift))
    near = intervals(fit, SimpleNamespace(candidate=SimpleNamespace(fit=fit), unknown=force))
    np.testing.assert_allclose(near.mean, fit.mode - shift)


def with_residuals(fit, noise: Noise, seed: int):
    """The fit with fresh noise for its residuals, nothing else changed."""
    rng = np.random.default_rng(seed)
    parts = []
    for lin in fit.linearisation:
        draw = noise.coloured(rng, lin.residual.size, 1e-3, small_rig.NOISE)
        parts.append(replace(lin, residual=draw))
    return replace(fit, linearisation=tuple(parts))


@pytest.mark.parametrize("rho", [0.0, 0.7])
def test_sandwich_is_the_long_run_covariance(small, rho):
    """Averaged over draws: J+ C J+' with C the covariance of the residuals, or what was claimed."""
    fit, d = small.fit, small.fit.mode.size
    middle = np.zeros((d, d))
    for lin, s in zip(fit.linearisation, sigma_of(fit), strict=True):
        n = lin.residual.size
        lags = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
        weights = lin.jacobian / s**2
        where = np.ix_(lin.columns, lin.columns)
        middle[where] += weights.T @ (small_rig.NOISE**2 * rho**lags) @ weights
    physical = fit.target.oscillator.layout.roles("physical")
    expected = np.diag(fit.covariance @ middle @ fit.covariance)[physical]
    expected = np.maximum(expected / np.diag(fit.covariance)[physical], 1.0)
    found = [
        np.diag(sandwich(with_residuals(fit, Noise(rho), seed)))[physical]
        / np.diag(fit.covariance)[physical]
        for seed in range(6)
    ]
    assert np.min(found) >= 1.0
    # Bartlett weights lose a part of slow covariances; a floor of one adds where there are none
    low, high = (0.97, 1.5) if rho == 0.0 else (0.6, 1.3)
    ratio = np.mean(found, axis=0) / expected
    assert np.all((low < ratio) & (ratio < high)), ratio


def test_ljung_box_statistic_and_its_law():
    rng = np.random.default_rng(0)
    x = rng.standard_normal(500)
    centred = x - x.mean()
    full = np.correlate(centred, centred, "full")[500 - 1 :]
    rho = full[1:21] / full[0]
    q = 500 * 502 * np.sum(rho**2 / (500 - np.arange(1, 21)))
    assert ljung_box(x) == pytest.approx(stats.chi2.sf(q, 20))
    p = [ljung_box(rng.standard_normal(1500)) for _ in range(300)]
    assert stats.kstest(p, "uniform").pvalue > 1e-3
    walk = Noise(0.2).coloured(rng, 1500, 1e-3, 1.0)
    assert ljung_box(walk) < 1e-4


def test_combined_p_value_is_fishers(small):
    p = [0.3, 0.02, 0.7]
    assert combined(p) == pytest.approx(stats.combine_pvalues(p, "fisher").pvalue)
    assert combined([0.0, 0.5]) > 0.0 or combined([0.0, 0.5]) == 0.0  # no NaN
    parts = [ljung_box(lin.residual) for lin in small.fit.linearisation]
    assert whiteness_p(small.fit) == pytest.approx(combined(parts))
    assert whiteness_p(small.fit) > 1e-3
    assert whiteness_p(with_residuals(small.fit, Noise(0.3), 0)) < 1e-6
