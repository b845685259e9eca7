"""The missing force against dense Gaussian algebra, exact derivatives and planted forces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID
from scipy import stats

from bayesimpact.diagnosis.refits.evidence import model_evidence
from bayesimpact.diagnosis.refits.extend import campaign_scales, extend, transfer
from bayesimpact.diagnosis.refits.refit import base_candidate
from bayesimpact.diagnosis.residual_force.evidence import WIDTHS, ForceEvidence
from bayesimpact.diagnosis.residual_force.gaussian_process import (
    MissingForce,
    basis_responses,
    missing_contact,
    missing_drift,
    missing_force,
    motion_range,
    refinement,
    trajectory_points,
)
from bayesimpact.diagnosis.residual_force.learned import (
    knots_of,
    learned_drift,
    learned_force,
    refined_force,
    spline_basis,
)
from bayesimpact.diagnosis.score_test.directions import sigma_of
from bayesimpact.diagnosis.score_test.scan import scan
from bayesimpact.diagnosis.selection.outcome import ExaminedModel, leaves_something
from bayesimpact.diagnosis.selection.unknown import (
    coefficient_names,
    finer_factors,
    learn_force,
    with_force,
)
from bayesimpact.inference.fit import Fit, PosteriorDensity
from bayesimpact.inference.identify import identify
from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.mode import find_mode
from bayesimpact.model.oscillator import Oscillator

KNOTS = 10


def dense_log_evidence(d: np.ndarray, residual: np.ndarray, width: np.ndarray) -> float:
    """Log density of the residual with coefficients of these widths over that of pure noise."""
    covariance = np.eye(residual.size) + (d * width**2) @ d.T
    normal = stats.multivariate_normal
    return float(
        normal(cov=covariance).logpdf(residual) - normal(cov=np.eye(residual.size)).logpdf(residual)
    )


@pytest.fixture
def problem():
    """60 white residuals, 2 x 3 coefficients in units of 1 N and 10 N s/m."""
    rng = np.random.default_rng(0)
    unit = np.repeat([1.0, 10.0], 3)
    d = rng.standard_normal((60, 6)) * 10.0 ** rng.uniform(0, 4, 6) / unit
    residual = rng.standard_normal(60) + 4e-4 * d[:, 0]
    return d, residual, unit


def test_evidence_and_posterior_are_the_dense_ones(problem):
    d, residual, unit = problem
    evidence = ForceEvidence(d.T @ d, unit, 3)
    score = d.T @ residual
    for a, b in [(1e-3, 1e-2), (1e-4, 0.0), (0.0, 1e-2)]:
        width = np.repeat([a, b], 3) * unit
        factor, penalty = evidence._factor(a, b)
        found = 0.5 * np.sum((factor @ (score * unit)) ** 2) - penalty
        assert found == pytest.approx(dense_log_evidence(d, residual, width), abs=1e-8)
        mean, covariance = evidence.posterior(score, a, b)
        dense = np.diag(width**2)
        gain = dense @ d.T @ np.linalg.inv(np.eye(60) + d @ dense @ d.T)
        np.testing.assert_allclose(mean, gain @ residual, atol=1e-9 * np.abs(mean).max())
        expected = dense - gain @ d @ dense
        np.testing.assert_allclose(covariance, expected, atol=1e-8 * np.abs(expected).max())


def test_the_widths_maximise_the_evidence(problem):
    d, residual, unit = problem
    evidence = ForceEvidence(d.T @ d, unit, 3)
    found, which = evidence.maximum((d.T @ residual)[None])
    values = {
        (a, b): dense_log_evidence(d, residual, np.repeat([a, b], 3) * unit)
        for a in WIDTHS[::1]
        for b in WIDTHS[::1]
        if a > 0 or b > 0
    }
    best = max(values, key=values.__getitem__)
    assert evidence.pairs[which[0]] == best
    assert found[0] == pytest.approx(values[best], abs=1e-7)


def test_scores_under_the_model_have_the_information_as_covariance(problem):
    d, _, unit = problem
    information = d.T @ d
    draws = ForceEvidence(information, unit, 3).null_draws(np.random.default_rng(1), 20_000)
    scale = np.sqrt(np.diag(information))
    found = draws.T @ draws / 20_000 / np.outer(scale, scale)
    np.testing.assert_allclose(found, information / np.outer(scale, scale), atol=0.04)


def line(low: float, spacing: float) -> np.ndarray:
    return low + spacing * np.arange(-1, KNOTS - 1)


def test_responses_add_up_to_the_exact_derivatives(small):
    """The coefficients of a(y) = y together are k1, those of b = 1 are c1."""
    fit, scales = small.fit, campaign_scales(small.fit)
    low, high = motion_range(fit)
    effect = learned_force(low, high, 1.0, 1.0, KNOTS)
    responses = basis_responses(fit, effect, KNOTS, scales)
    stiffness = np.concatenate([line(low, (high - low) / (KNOTS - 3)), np.zeros(KNOTS)])
    damping = np.concatenate([np.zeros(KNOTS), np.ones(KNOTS)])
    for part, lin, sigma in zip(responses, fit.linearisation, sigma_of(fit), strict=True):
        for name, weights in (("k1", stiffness), ("c1", damping)):
            exact = lin.jacobian[:, list(lin.columns).index(fit.names.index(name))] / sigma
            error = np.linalg.norm(part @ weights - exact) / np.linalg.norm(exact)
            assert error < 1e-3, name


def test_responses_in_a_model_that_has_effects_already(small):
    """With another law in the model the coefficients stand behind its parameters."""
    scales = campaign_scales(small.fit)
    effects = (BY_ID["spring_cubic"],)
    density = extend(small.fit, effects, scales)
    theta = transfer(small.fit, density.oscillator.layout, effects, scales, {})
    fit = find_mode(density, theta, steps=0.05 * np.insert(small.fit.sd, 6, 1e3), max_iterations=1)
    low, high = motion_range(fit)
    effect = learned_force(low, high, 1.0, 1.0, KNOTS)
    responses = basis_responses(fit, effect, KNOTS, scales)
    weights = np.concatenate([line(low, (high - low) / (KNOTS - 3)), np.zeros(KNOTS)])
    for part, lin, sigma in zip(responses, fit.linearisation, sigma_of(fit), strict=True):
        exact = lin.jacobian[:, list(lin.columns).index(fit.names.index("k1"))] / sigma
        assert np.linalg.norm(part @ weights - exact) < 2e-3 * np.linalg.norm(exact)


def planted(small, force_of, seed: int = 5) -> Fit:
    """The small rig with an added force a(y), refitted without it."""
    scales = campaign_scales(small.fit)
    low, high = motion_range(small.fit)
    effect = learned_force(low, high, 1.0, 1.0, 40)
    places = low + (high - low) / 37 * np.arange(-1, 39)
    oscillator = extend(small.fit, (effect,), scales).oscillator
    values = dict(zip(small.fit.names, small.fit.mode, strict=True))
    values |= {f"learned_force.a{i + 1}": force_of(y) for i, y in enumerate(places)}
    values |= {f"learned_force.b{i + 1}": 0.0 for i in range(40)}
    readings = oscillator.predict(small_rig.vector(oscillator.layout, values))
    rng = np.random.default_rng(seed)
    old = small.fit.density.oscillator
    recordings = tuple(
        replace(r, samples=m + small_rig.NOISE * rng.standard_normal(m.size))
        for r, m in zip(old.campaign.recordings, readings, strict=True)
    )
    campaign = replace(old.campaign, recordings=recordings)
    density = PosteriorDensity(
        Likelihood(Oscillator(campaign, (), old.layout, None), small.fit.density.likelihood.noise),
        small.fit.density.priors,
    )
    return find_mode(density, small.fit.mode)


def bump(y: float) -> float:
    """A detent of 20 mN at -3 mm, half a millimetre wide."""
    return 0.02 * np.exp(-0.5 * ((y + 3e-3) / 5e-4) ** 2)


@pytest.fixture(scope="module")
def detent(small) -> tuple[Fit, MissingForce]:
    fit = planted(small, bump)
    scales = campaign_scales(fit)
    return fit, missing_force(fit, scales, rng=np.random.default_rng(0))


def test_nothing_is_found_where_nothing_is_missing(small):
    found = missing_force(small.fit, campaign_scales(small.fit), rng=np.random.default_rng(0))
    assert found.p_value > 0.01 and found.log_evidence < 8


def test_a_local_force_is_found_where_it_acts(detent):
    """The residual is still near the noise, but the force view shows the place."""
    _, found = detent
    assert found.p_value == pytest.approx(1 / 1001) and found.log_evidence > 20
    # what the base model can imitate (a constant, a spring) is free: compare without it
    y = np.linspace(-5.5e-3, 0.5e-3, 121)
    a, sd = found.parts(y)[0], found.sd(y)[0]
    truth = np.array([bump(x) for x in y])
    absorbed = np.column_stack([np.ones_like(y), y])
    weights = 1 / sd**2

    def beyond(f: np.ndarray) -> np.ndarray:
        solve = np.linalg.lstsq(
            absorbed * np.sqrt(weights)[:, None], f * np.sqrt(weights), rcond=None
        )
        return f - absorbed @ solve[0]

    difference = beyond(a) - beyond(truth)
    assert np.abs(difference / sd).max() < 4
    assert np.abs(difference).max() < 0.3 * np.abs(beyond(truth)).max()
    assert abs(y[np.argmax(beyond(a))] + 3e-3) < 3e-4


def test_force_and_sd_are_those_of_the_coefficients(detent):
    _, found = detent
    y = np.array([-4e-3, -1e-3, 1.5e-3])
    v = np.array([0.1, -0.2, 0.05])
    basis = spline_basis(y, found.low, found.spacing, found.knots)
    whole = np.concatenate([basis, basis * v[:, None]], axis=1)
    np.testing.assert_allclose(found.force(y, v, np.zeros_like(y)), whole @ found.mean, rtol=1e-12)
    draws = np.random.default_rng(0).multivariate_normal(found.mean, found.covariance, 20_000)
    spread = np.concatenate([(draws[:, : found.knots] @ basis.T).std(axis=0),
                             (draws[:, found.knots :] @ basis.T).std(axis=0)])  # fmt: skip
    np.testing.assert_allclose(np.concatenate(found.sd(y)), spread, rtol=0.03, atol=1e-9)
    deviation = found.deviation(y, v, np.zeros_like(y))
    np.testing.assert_allclose(deviation, (draws @ whole.T).std(axis=0), rtol=0.03)


def test_the_learned_force_goes_back_into_the_simulator(detent):
    """Fitted with the parameters: the residual is noise, the parameters are right again."""
    fit, found = detent
    scales = campaign_scales(fit)
    rng = np.random.default_rng(0)
    drift = missing_drift(fit, scales, rng=rng)
    assert drift.log_evidence < found.log_evidence - 20  # a detent is no drift
    state = ExaminedModel(base_candidate(fit), scan(fit, [], scales, rng=rng), found, drift)
    assert state.unknown is found
    learned = learn_force(state.candidate.fit, state.unknown, scales)
    assert fit.reduced_chi2 > learned.reduced_chi2
    chi2 = learned.sums.sum() / small_rig.NOISE**2
    assert chi2 < stats.chi2.ppf(1 - 1e-4, 6000)
    assert len(coefficient_names(found.knots)) == 2 * found.knots
    names = coefficient_names(found.knots)[: found.knots]
    stiffness = np.array([learned.value(n) for n in names])
    places = found.low + found.spacing * np.arange(-1, found.knots - 1)
    strongest = places[np.argmax(stiffness - np.median(stiffness))]
    assert abs(strongest + 3e-3) < 1e-3
    for name in ("k2[1]", "k2[2]", "c2"):
        i = learned.names.index(name)
        assert abs(learned.mode[i] - small_rig.true_values()[name]) < 4 * learned.sd[i]


def test_a_force_on_knots_too_coarse_is_refined_where_something_remains(detent):
    """Four knots cannot hold a narrow detent; nested ones begin as the same force and learn it."""
    fit, _ = detent
    scales = campaign_scales(fit)
    coarse = missing_force(fit, scales, rng=np.random.default_rng(0), knots=6)
    first = learn_force(fit, coarse, scales)
    assert coarse.knots == 6 and leaves_something(first)
    found = with_force(base_candidate(fit), coarse, scales)
    assert knots_of(found.effects[-1]).count in (24, 45)
    assert found.log_evidence > model_evidence(first) + 20
    assert not leaves_something(found.fit)


def test_a_finer_force_begins_as_the_same_force():
    coarse = learned_force(-3e-3, 2e-3, 1e-3, 1e-2, 6)
    finer = refined_force(coarse, 7)
    assert knots_of(finer).count == 24 and finer.parameter("b24").scale(None) == 1e-2
    own = np.random.default_rng(0).standard_normal(6)
    y = np.linspace(-3e-3, 2e-3, 101)
    same = knots_of(finer).basis(y) @ (refinement(6, 7) @ own)
    np.testing.assert_allclose(same, knots_of(coarse).basis(y) @ own, atol=1e-12)
    assert (
        finer_factors(coarse) == [7, 14] and finer_factors(learned_drift(1.0, 1.0, 1.0, 1.0)) == []
    )


def test_a_purely_conservative_force_can_be_learned(detent):
    """The best width of the dissipative part may be zero: its prior still needs some width."""
    _, found = detent
    widths = [p.scale(None) for p in found.effect.parameters if p.fixed is None]
    assert min(widths) > 0


def test_points_of_the_trajectory(small):
    fit = small.fit
    offsets = [fit.value(f"offset[{n}]") for n in "abc"]
    points = zip(trajectory_points(fit), fit.predicted, offsets, strict=True)
    for (y, v), predicted, offset in points:
        np.testing.assert_allclose(y, predicted - offset, atol=1e-15)
        ends = np.cumsum(0.5 * (v[1:] + v[:-1])) * 1e-3
        assert np.abs(ends - (y[1:] - y[0])).max() < 2e-5
    low, high = motion_range(fit)
    assert low == min(p[0].min() for p in trajectory_points(fit))
    assert high == max(p[0].max() for p in trajectory_points(fit))


def test_damping_that_drifts_is_a_force_of_time():
    campaign = small_rig.record(5, {"damping_drift": {"rate": 0.15}})
    fit = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    scales, rng = campaign_scales(fit), np.random.default_rng(0)
    drift, force = missing_drift(fit, scales, rng=rng), missing_force(fit, scales, rng=rng)
    assert drift.p_value == pytest.approx(1 / 1001)
    assert drift.log_evidence > force.log_evidence + 10
    times = np.linspace(0.1, 0.9, 9) * scales.duration
    _, damping = drift.parts(times)
    slope = np.polyfit(times, damping, 1)[0]
    assert 0.3 < slope / (0.15 * small_rig.RIG.c1) < 2.0  # c1 (1 + rate t)
    state = ExaminedModel(base_candidate(fit), scan(fit, [], scales, rng=rng), force, drift)
    learned = learn_force(state.candidate.fit, state.unknown, scales)
    assert learned.sums.sum() / small_rig.NOISE**2 < stats.chi2.ppf(1 - 1e-3, 6000)


def test_nothing_drifts_in_a_control(small):
    scales = campaign_scales(small.fit)
    assert missing_drift(small.fit, scales, rng=np.random.default_rng(0)).p_value > 0.01


def test_a_force_in_contact_is_found_in_contact():
    """Wherever the mean force lies, for the stiffness and the gap imitate parts of it."""
    campaign = small_rig.record(5, {"contact_hardening": {"stiffness": 4e6}})
    fit = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    found = missing_force(fit, campaign_scales(fit), rng=np.random.default_rng(0))
    gap = fit.value("g")
    assert found.log_evidence > 20
    assert found.share_within(gap, 1.0) > 0.9 > 0.8 > found.share_within(-1.0, -1e-3)
    assert found.share_within(-1.0, 1.0) == pytest.approx(1.0)


def test_a_preload_is_a_force_in_contact_that_jumps_at_the_onset():
    """The free force of displacement is too smooth for it; the one in contact learns it."""
    force = 0.05
    campaign = small_rig.record(5, {"contact_preload": {"force": force}})
    fit = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    scales, rng = campaign_scales(fit), np.random.default_rng(0)
    contact, smooth = missing_contact(fit, scales, rng=rng), missing_force(fit, scales, rng=rng)
    assert contact is not None and contact.log_evidence > smooth.log_evidence + 10
    y, v = np.array([-1e-3, scales.gap + 1e-5]), np.zeros(2)
    assert contact.force(y, v, v)[0] == 0.0
    learned = learn_force(fit, contact, scales)
    assert learned.converged
    assert learned.sums.sum() / small_rig.NOISE**2 < stats.chi2.ppf(1 - 1e-3, 6000)
    for name in ("k2[1]", "k2[2]", "c2"):
        i = learned.names.index(name)
        assert abs(learned.mode[i] - small_rig.true_values()[name]) < 4 * learned.sd[i]


def test_without_an_obstacle_there_is_no_force_in_contact(small):
    scales = replace(campaign_scales(small.fit), indentation=0.0)
    assert missing_contact(small.fit, scales, rng=np.random.default_rng(0)) is None
