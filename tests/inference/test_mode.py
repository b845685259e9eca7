"""The mode against SciPy's optimisers, its bounds, noise level and curvature."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID
from made_up_banana import banana
from scipy.optimize import least_squares, minimize_scalar

from bayesimpact.data.campaign import Smoothing
from bayesimpact.inference.ascent import best_sigma
from bayesimpact.inference.fit import Fit, PosteriorDensity, inverse
from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.mode import find_mode
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.inference.prior import (
    HalfNormal,
    LogNormal,
    LogUniform,
    Normal,
    Uniform,
)
from bayesimpact.inference.priors import Priors
from bayesimpact.model.oscillator import build_oscillator
from bayesimpact.trial.rig.recordings import Release, Rig

SAVGOL = Smoothing("savgol", window=11, polyorder=2)
WIDE = {
    "c1": Uniform(0, 20), "k1": Uniform(0, 1e4), "c2": Uniform(0, 100), "g": Uniform(-1, 1),
    "k2": Uniform(0, 1e5), "y0": Uniform(-1, 1), "v0": Uniform(-10, 10), "offset": Uniform(-1, 1),
    "sigma": LogUniform(1e-9, 1e-2),
}  # fmt: skip


def density(
    campaign, noise=None, effects=(), *, sigma_per_recording=False, **priors: object
) -> PosteriorDensity:
    noise = noise or Noise()
    oscillator = build_oscillator(
        campaign, effects, smoothing=noise.smoothing, sigma_per_recording=sigma_per_recording
    )
    chosen = [
        priors.get(n) or WIDE.get(n.split("[")[0]) or Normal(0.0, 1e6)
        for n in oscillator.layout.names
    ]
    return PosteriorDensity(Likelihood(oscillator, noise), Priors(tuple(chosen)))


def near_truth(
    problem: PosteriorDensity, values: dict[str, float], relative: float = 1e-3
) -> np.ndarray:
    layout = problem.oscillator.layout
    rng = np.random.default_rng(5)
    known = {n: values.get(n, 0.0) for n in layout.names} | {"sigma": 1e-3}
    return small_rig.vector(layout, known) * (1 + relative * rng.standard_normal(layout.size))


def scipy_mode(problem: PosteriorDensity, fit: Fit) -> tuple[np.ndarray, np.ndarray]:
    """Mode and covariance at the fit's noise levels, by SciPy with its own differences.

    Normal priors become further residuals; parameters are counted in the fit's deviations.
    """
    likelihood, layout = problem.likelihood, problem.oscillator.layout
    moving = layout.roles("physical", "effect", "nuisance")
    sigma = fit.mode[likelihood.sigma_columns]
    scale = np.where(fit.sd[moving] > 0, fit.sd[moving], 1.0)
    normal = [(i, p) for i, p in enumerate(problem.priors.parameters) if isinstance(p, Normal)]

    def residuals(x: np.ndarray) -> np.ndarray:
        theta = fit.mode.copy()
        theta[moving] = x * scale
        rows = zip(
            problem.oscillator.campaign.recordings,
            problem.oscillator.predict(theta),
            sigma,
            strict=True,
        )
        white = [likelihood.noise.whiten(r.samples - m, r.interval) / s for r, m, s in rows]
        return np.concatenate([*white, [(theta[i] - p.mean) / p.sd for i, p in normal]])

    bounds = problem.priors.lower[moving] / scale, problem.priors.upper[moving] / scale
    start = np.clip(fit.mode[moving] / scale + 0.3, *bounds)
    steps = 1e-4 / (1 + np.abs(start))
    found = least_squares(residuals, start, jac="3-point", bounds=bounds, diff_step=steps,
                          xtol=1e-14, ftol=1e-14, gtol=1e-14)  # fmt: skip
    mode = fit.mode.copy()
    mode[moving] = found.x * scale
    return mode, np.linalg.pinv(found.jac.T @ found.jac) * np.outer(scale, scale)


def assert_same_mode(problem: PosteriorDensity, fit: Fit) -> None:
    mode, covariance = scipy_mode(problem, fit)
    assert fit.converged
    np.testing.assert_array_less(np.abs(mode - fit.mode) / fit.sd, 0.01)
    moving = problem.oscillator.layout.roles("physical", "effect", "nuisance")
    found = fit.covariance[np.ix_(moving, moving)]
    scale = np.outer(fit.sd[moving], fit.sd[moving])
    np.testing.assert_allclose(found / scale, covariance / scale, atol=2e-3)


PLAIN = {"rig": small_rig.PLAIN, "releases": small_rig.PLAIN_RELEASES}
PLAIN_TRUTH = small_rig.true_values(small_rig.PLAIN, small_rig.PLAIN_RELEASES)


@pytest.mark.parametrize(
    "noise", [Noise(), Noise(correlation=0.5), Noise(smoothing=SAVGOL)], ids=lambda n: n.kind
)
@pytest.mark.parametrize("stop", [False, True])
def test_same_optimum_as_scipy(noise, stop):
    campaign = small_rig.record(3, duration=0.8, **({} if stop else PLAIN))
    problem = density(campaign, noise)
    truth = small_rig.true_values() if stop else PLAIN_TRUTH
    assert_same_mode(problem, find_mode(problem, near_truth(problem, truth)))


def test_same_optimum_as_scipy_with_priors_that_matter():
    campaign = small_rig.record(3, duration=0.8, **PLAIN)
    plain = find_mode(density(campaign), near_truth(density(campaign), PLAIN_TRUTH))
    width = 0.5 * plain.sd[plain.names.index("k1")]
    problem = density(campaign, k1=Normal(plain.value("k1") + 4 * width, width))
    fit = find_mode(problem, near_truth(problem, PLAIN_TRUTH))
    assert_same_mode(problem, fit)
    assert (fit.value("k1") - plain.value("k1")) / width > 1.0  # pulled


def test_same_optimum_as_scipy_by_differences():
    campaign = small_rig.record(3, {"quadratic_drag": {"coefficient": 0.05}}, duration=0.8)
    effects = (BY_ID["quadratic_drag"], BY_ID["sensor_quadratic"])
    problem = density(campaign, None, effects)
    start = near_truth(problem, small_rig.true_values())
    floor = [1e-2 if n.startswith("v0") else 1e-4 for n in problem.oscillator.layout.names]
    fit = find_mode(problem, start, steps=1e-5 * np.maximum(np.abs(start), floor))
    assert_same_mode(problem, fit)


def test_noise_levels_of_their_own():
    campaign = small_rig.record(3, duration=0.8, **PLAIN)
    rng = np.random.default_rng(0)
    second = replace(
        campaign.recordings[1],
        samples=campaign.recordings[1].samples + 4e-5 * rng.standard_normal(800),
    )
    campaign = replace(campaign, recordings=(campaign.recordings[0], second))
    levels = {f"sigma[{n}]": LogUniform(1e-9, 1e-2) for n in "ab"}
    problem = density(campaign, sigma_per_recording=True, **levels)
    truth = PLAIN_TRUTH | {"sigma[a]": 1e-3, "sigma[b]": 1e-3}
    fit = find_mode(problem, near_truth(problem, truth))
    assert_same_mode(problem, fit)
    for name, level in (("sigma[a]", 5e-6), ("sigma[b]", 4.03e-5)):
        assert abs(fit.value(name) - level) < 4 * fit.sd[fit.names.index(name)]
        assert fit.sd[fit.names.index(name)] == pytest.approx(level / np.sqrt(1600), rel=0.1)


def test_a_bound_is_respected_and_the_rest_is_at_its_best():
    """Undamped rig: half of all recordings would like c1 < 0."""
    rig = Rig(mass=0.503, c1=0.0, k1=808.556)
    at_bound = 0
    for seed in range(6):
        campaign = small_rig.record(seed, rig=rig, releases=small_rig.PLAIN_RELEASES, duration=0.8)
        problem = density(campaign)
        fit = find_mode(problem, near_truth(problem, PLAIN_TRUTH))
        mode, _ = scipy_mode(problem, fit)
        assert fit.converged and fit.value("c1") >= 0.0
        np.testing.assert_array_less(np.abs(mode - fit.mode) / fit.sd, 0.01)
        at_bound += fit.value("c1") == 0.0
    assert 1 <= at_bound <= 5


def test_an_upper_bound_from_a_prior():
    campaign = small_rig.record(3, duration=0.8, **PLAIN)
    problem = density(campaign, k1=Uniform(700.0, 808.0))
    fit = find_mode(problem, near_truth(problem, PLAIN_TRUTH, 0.0))
    mode, _ = scipy_mode(problem, fit)
    assert fit.converged and fit.value("k1") == 808.0
    np.testing.assert_array_less(np.abs(mode - fit.mode) / fit.sd, 0.01)


def test_mode_of_the_density_itself():
    """No direction of the full posterior, noise level included, goes up; curvature as reported."""
    campaign = small_rig.record(4, duration=0.8)
    problem = density(campaign, sigma=LogNormal(4e-6, 0.1), k1=Normal(808.0, 0.3))
    fit = find_mode(problem, near_truth(problem, small_rig.true_values()), tolerance=1e-6)
    assert fit.log_posterior == pytest.approx(problem(fit.mode)[0], abs=1e-6)
    step = 0.02 * fit.sd
    sides = [problem(fit.mode + sign * np.diag(step)) for sign in (1, -1)]
    slope = (sides[0] - sides[1]) / 0.04
    np.testing.assert_array_less(np.abs(slope), 1e-3)
    bend = -(sides[0] + sides[1] - 2 * fit.log_posterior) / 0.02**2
    information = np.diag(np.linalg.inv(fit.covariance / np.outer(fit.sd, fit.sd)))
    np.testing.assert_allclose(bend, information, rtol=0.02)


@pytest.mark.parametrize(
    "prior",
    [
        LogUniform(1e-9, 1e-2),
        LogNormal(5e-6, 0.1),
        LogNormal(3e-5, 0.02),
        HalfNormal(1e-6),
        Uniform(0, 1e-3),
        Uniform(7e-6, 1e-3),
        Uniform(0, 2e-6),
    ],
    ids=repr,
)
@pytest.mark.parametrize("n", [10, 1000])
def test_best_noise_level(prior, n):
    """The maximum over sigma of n log-normal terms and the prior, against a scalar search."""
    layout = SimpleNamespace(roles=lambda *roles: np.array([0]))
    likelihood = SimpleNamespace(sizes=np.array([n / 2, n / 2]), sigma_columns=np.array([0, 0]))
    problem = SimpleNamespace(
        likelihood=likelihood,
        oscillator=SimpleNamespace(layout=layout, campaign=SimpleNamespace(stop=False)),
        priors=SimpleNamespace(parameters=(prior,)),
    )
    sums = np.array([0.7, 1.3]) * 0.5 * n * (5e-6) ** 2

    def cost(log_sigma: float) -> float:
        sigma = np.clip(np.exp(log_sigma), *prior.support)
        log_density = float(prior.log_density(sigma))
        return n * np.log(sigma) + sums.sum() / (2 * sigma**2) - log_density

    expected = minimize_scalar(cost, bounds=np.log([1e-7, 1e-4]), method="bounded",
                               options={"xatol": 1e-12})  # fmt: skip
    found = best_sigma(problem, sums)[0]
    assert prior.support[0] <= found <= prior.support[1]
    assert cost(np.log(found)) <= expected.fun + 1e-6


def test_what_a_fit_says_of_itself():
    campaign = small_rig.record(3, duration=0.8, **PLAIN)
    problem = density(campaign, Noise(level=4e-6))
    fit = find_mode(problem, near_truth(problem, PLAIN_TRUTH))
    residual = np.concatenate(
        [r.samples - m for r, m in zip(campaign.recordings, fit.predicted, strict=True)]
    )
    np.testing.assert_array_equal(np.concatenate(fit.residuals), residual)
    assert fit.rms == pytest.approx(np.sqrt(np.mean(residual**2)))
    assert fit.reduced_chi2 == pytest.approx(np.sum(residual**2) / 4e-6**2 / (1600 - 8))
    assert fit.value("k1") == fit.mode[1] and fit.names[1] == "k1"
    np.testing.assert_allclose(fit.sums.sum(), np.sum(residual**2))


def test_a_start_that_cannot_be_simulated_is_no_mode():
    problem = density(small_rig.record(3, duration=0.3, **PLAIN))
    start = near_truth(problem, PLAIN_TRUTH)
    start[1] = np.nan
    fit = find_mode(problem, start)
    assert not fit.converged and fit.log_posterior == -np.inf
    assert fit.linearisation == ()  # derivatives take longest where a motion runs away


def test_what_the_recordings_do_not_tell_stays_where_it_was():
    """An obstacle never touched: its stiffness keeps its start and its prior's deviation."""
    releases = (small_rig.RELEASES[0], Release("c", "2", -0.9e-3))
    campaign = small_rig.record(3, releases=releases, duration=0.8)
    problem = density(campaign)
    start = near_truth(problem, small_rig.true_values(releases=releases), 1e-6)
    fit = find_mode(problem, start)
    k2 = fit.names.index("k2[2]")
    assert fit.converged
    assert fit.mode[k2] == pytest.approx(start[k2], rel=1e-6)
    assert fit.sd[k2] == pytest.approx(1e5 / np.sqrt(12), rel=1e-6)
    correlation = fit.covariance / np.outer(fit.sd, fit.sd)
    assert np.abs(correlation[k2]).sum() == pytest.approx(1.0, abs=1e-6)
    np.linalg.cholesky(correlation)


def test_iterations_are_limited():
    problem = density(small_rig.record(3, duration=0.8))
    start = near_truth(problem, small_rig.true_values(), 1e-2)
    assert find_mode(problem, start).iterations > 2
    fit = find_mode(problem, start, max_iterations=2)
    assert not fit.converged and fit.iterations == 2


@pytest.mark.parametrize(("steep", "iterations"), [(10.0, 10), (1e4, 300)])
def test_a_curved_profile_is_followed_to_its_end(steep, iterations):
    """Without bent steps it takes 16 and 1742."""
    start = np.array([-1.2, 1.0, 1.0])
    fit = find_mode(banana(steep=steep), start, max_iterations=iterations)
    assert fit.converged
    np.testing.assert_allclose(fit.mode[:2], 1.0, atol=1e-4)


def test_an_ascent_that_will_not_reach_its_goal_ends_early():
    """Neither at once nor later where the goal lies within reach."""
    start, options = np.array([-1.2, 1.0, 1.0]), {"max_iterations": 300}
    whole = find_mode(banana(steep=1e4), start, **options)
    assert whole.converged and whole.iterations > 100
    lost = find_mode(banana(steep=1e4), start, goal=whole.log_posterior + 100.0, **options)
    assert not lost.converged and lost.iterations < 0.5 * whole.iterations
    begun = find_mode(banana(steep=1e4), start, max_iterations=1)
    found = find_mode(banana(steep=1e4), start, goal=begun.log_posterior, **options)
    assert found.converged and found.iterations == whole.iterations


def test_rough_derivatives_end_the_ascent_where_they_tell_no_more():
    """Off by a tenth they lead nowhere in a steep banana; the ascent neither goes on nor claims."""
    start = np.array([1.01, 1.0201, 1.0])
    fit = find_mode(banana(rough=0.1, steep=1e3), start, max_iterations=300)
    assert fit.iterations < 200 and not fit.converged
    near = find_mode(banana(rough=0.3), start, max_iterations=300, tolerance=1e-6)
    assert near.converged
    assert abs(near.mode[0] - 1.0) < 0.01 * near.sd[0]


def test_rough_derivatives_lead_near_the_mode_and_finer_ones_to_it():
    problem = banana(rougher=0.05)
    fit = find_mode(problem, np.array([-1.2, 1.0, 1.0]), steps=np.full(3, 1e-3))
    assert fit.converged
    np.testing.assert_allclose(fit.mode[:2], 1.0, atol=1e-4)
    asked = problem.likelihood.asked
    assert asked[0] and not asked[-1] and asked == sorted(asked, reverse=True)


def test_an_ascent_by_differences_that_gains_little_fails():
    """Derivatives that promise more than a standard deviation and gain a tenth of a nat."""
    start = np.array([0.5, 0.25, 1.0])
    problem = banana(rough=0.03, steep=1e3)
    fit = find_mode(problem, start, steps=np.full(3, 1e-3), max_iterations=300)
    assert not fit.converged and fit.iterations < 60
    assert find_mode(problem, start, max_iterations=300).iterations == 300


def test_an_ascent_ends_where_new_derivatives_gain_nothing():
    """Also without more damping; were that asked for, it would take 188 iterations, not 79."""
    start = np.array([1.01, 1.0201, 1.0])
    fit = find_mode(banana(rough=0.4), start, max_iterations=300)
    assert fit.converged and fit.iterations < 120
    assert abs(fit.mode[0] - 1.0) < 0.1 * fit.sd[0]


def test_steps_that_all_fail_are_no_convergence():
    """Derivatives of the wrong sign: damping shrinks the steps until nothing moves."""
    fit = find_mode(banana(sign=-1.0), np.array([-1.2, 1.0, 1.0]))
    assert not fit.converged
    np.testing.assert_array_equal(fit.mode[:2], [-1.2, 1.0])


@pytest.mark.parametrize("fails", [False, True])
def test_inverse_of_matrices_of_mixed_scales(fails, monkeypatch):
    """Also where LAPACK's divide and conquer does not converge."""
    if fails:

        def pinv(*args, **options):
            raise np.linalg.LinAlgError("Eigenvalues did not converge")

        monkeypatch.setattr(np.linalg, "pinv", pinv)
    rng = np.random.default_rng(0)
    root = rng.standard_normal((6, 8)) * 10.0 ** np.arange(-9, 9, 3)[:, None]
    matrix = root @ root.T
    scale = np.sqrt(np.outer(np.diag(matrix), np.diag(matrix)))
    np.testing.assert_allclose(inverse(matrix) * scale, np.linalg.inv(matrix / scale), rtol=1e-9)
    matrix[2] = matrix[:, 2] = 0.0  # nothing is known of one parameter
    kept = np.ix_(*[[0, 1, 3, 4, 5]] * 2)
    expected = np.linalg.inv((matrix / scale)[kept])
    np.testing.assert_allclose((inverse(matrix) * scale)[kept], expected, rtol=1e-9)
