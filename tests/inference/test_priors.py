"""Every prior against scipy.stats, its derivatives against differences, and its refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from bayesimpact.errors import InputError
from bayesimpact.inference.prior import (
    Cauchy,
    HalfCauchy,
    HalfNormal,
    LogNormal,
    LogUniform,
    Normal,
    Prior,
    Uniform,
)
from bayesimpact.inference.priors import Priors, prior_from_table

# (ours, the same in scipy.stats); scales as in a campaign, some far from 1.
TWINS = [
    (Uniform(-2.5e-3, 4e-3), stats.uniform(-2.5e-3, 6.5e-3)),
    (Uniform(3.0, 3.5), stats.uniform(3.0, 0.5)),
    (Normal(808.0, 12.0), stats.norm(808.0, 12.0)),
    (Normal(-2e-6, 5e-6), stats.norm(-2e-6, 5e-6)),
    (HalfNormal(0.3), stats.halfnorm(scale=0.3)),
    (Cauchy(1.5, 0.2), stats.cauchy(1.5, 0.2)),
    (Cauchy(-2e-6, 5e-6), stats.cauchy(-2e-6, 5e-6)),
    (HalfCauchy(3e-3), stats.halfcauchy(scale=3e-3)),
    (LogNormal(5e3, 0.4), stats.lognorm(0.4, scale=5e3)),
    (LogNormal(0.15, 2.0), stats.lognorm(2.0, scale=0.15)),
    (LogUniform(1e-7, 1e-4), stats.loguniform(1e-7, 1e-4)),
    (LogUniform(0.5, 3.0), stats.loguniform(0.5, 3.0)),
]
IDS = [f"{prior.kind}-{i}" for i, (prior, _) in enumerate(TWINS)]
QUANTILES = np.array([1e-4, 0.02, 0.3, 0.5, 0.77, 0.99, 0.9999])

twins = pytest.mark.parametrize(("prior", "twin"), TWINS, ids=IDS)
every_prior = pytest.mark.parametrize("prior", [prior for prior, _ in TWINS], ids=IDS)


@twins
def test_log_density_is_scipys(prior: Prior, twin: stats.rv_continuous) -> None:
    x = twin.ppf(QUANTILES)
    np.testing.assert_allclose(prior.log_density(x), twin.logpdf(x), rtol=1e-12, atol=1e-12)


@twins
def test_quantiles_are_scipys(prior: Prior, twin: stats.rv_continuous) -> None:
    scale = np.abs(twin.ppf(0.9) - twin.ppf(0.1))
    np.testing.assert_allclose(
        prior.ppf(QUANTILES), twin.ppf(QUANTILES), rtol=1e-11, atol=1e-11 * scale
    )


@twins
def test_support_is_scipys_and_density_vanishes_outside(
    prior: Prior, twin: stats.rv_continuous
) -> None:
    lower, upper = prior.support
    np.testing.assert_allclose([lower, upper], twin.support(), rtol=1e-12)
    ends = prior.ppf([0.0, 1.0])
    np.testing.assert_allclose(ends, [lower, upper], rtol=1e-15)
    assert lower <= ends[0] < ends[1] <= upper
    outside = []
    if math.isfinite(lower):
        outside += [np.nextafter(lower, -np.inf), lower - 1.0]
    if math.isfinite(upper):
        outside += [np.nextafter(upper, np.inf), upper + 1.0]
    for x in [*outside, np.nan, np.inf, -np.inf]:
        assert prior.log_density(x) == -np.inf
        assert np.isnan(prior.gradient(x))
        assert np.isnan(prior.curvature(x))


def test_density_at_the_edges_themselves() -> None:
    assert Uniform(1.0, 3.0).log_density([1.0, 3.0]).tolist() == [-math.log(2)] * 2
    assert np.isfinite(LogUniform(0.1, 2.0).log_density([0.1, 2.0])).all()
    assert np.isfinite(HalfNormal(0.1).log_density(0.0))
    assert LogNormal(1.0, 1.0).log_density(0.0) == -np.inf  # the support is open there


@every_prior
def test_derivatives_are_those_of_the_log_density(prior: Prior) -> None:
    x = prior.ppf(np.linspace(0.05, 0.95, 19))
    step = 1e-5 * np.minimum(np.ptp(x), np.abs(x).min() if prior.support[0] >= 0 else np.ptp(x))
    values = [prior.log_density(x + i * step) for i in (-2, -1, 1, 2)]
    slopes = [prior.gradient(x + i * step) for i in (-2, -1, 1, 2)]
    weights = np.array([1, -8, 8, -1]) / (12 * step)
    # Rounding of the values over the step; truncation (step**4) is far below.
    rounding = 10 * np.finfo(float).eps / step
    slope, bend = weights @ np.array(values), weights @ np.array(slopes)
    size = 1 + np.abs(values).max()
    np.testing.assert_allclose(prior.gradient(x), slope, rtol=1e-8, atol=rounding * size)
    size = 1e-300 + np.abs(slopes).max()
    np.testing.assert_allclose(prior.curvature(x), bend, rtol=1e-8, atol=rounding * size)


@twins
def test_draws_follow_the_density(prior: Prior, twin: stats.rv_continuous) -> None:
    draws = prior.sample(np.random.default_rng(7), 100_000)
    assert np.isfinite(prior.log_density(draws)).all()
    assert stats.kstest(draws, twin.cdf).pvalue > 1e-3  # one fixed seed each
    again = prior.sample(np.random.default_rng(7), (400, 250))
    np.testing.assert_array_equal(again.ravel(), draws)


def test_small_quantiles_of_the_half_normal_keep_their_digits() -> None:
    q = 1e-12
    assert HalfNormal(1.0).ppf(q) == pytest.approx(q * math.sqrt(math.pi / 2), rel=1e-12, abs=0)


@every_prior
def test_shapes_are_kept_and_probabilities_checked(prior: Prior) -> None:
    x = prior.ppf(np.full((2, 3), 0.4))
    for function in (prior.log_density, prior.gradient, prior.curvature):
        assert function(x).shape == (2, 3)
        assert function(x[0, 0]).shape == ()
    mixed = np.array([x[0, 0], np.nan])
    assert np.isfinite(prior.log_density(mixed)).tolist() == [True, False]
    assert np.isnan(prior.ppf([-0.1, 1.1, np.nan])).all()


TABLES = [
    ({"distribution": "uniform", "lower": 0, "upper": 2.0}, Uniform(0, 2.0)),
    ({"distribution": "normal", "mean": 0.0, "sd": 1e-3}, Normal(0.0, 1e-3)),
    ({"distribution": "halfnormal", "scale": 3.0}, HalfNormal(3.0)),
    ({"distribution": "cauchy", "median": 1, "scale": 2.0}, Cauchy(1.0, 2.0)),
    ({"distribution": "halfcauchy", "scale": 3.0}, HalfCauchy(3.0)),
    ({"distribution": "lognormal", "median": 800.0, "sigma": 0.2}, LogNormal(800.0, 0.2)),
    ({"distribution": "loguniform", "lower": 1.0, "upper": 9.0}, LogUniform(1.0, 9.0)),
]


@pytest.mark.parametrize(("table", "expected"), TABLES)
def test_tables_become_priors(table: dict[str, object], expected: Prior) -> None:
    prior = prior_from_table("k1", table)
    assert prior == expected
    assert all(type(value) is float for value in vars(prior).values())  # TOML's 0 becomes 0.0


BAD = [
    ({}, "None", "uniform | normal"),
    ({"distribution": "laplace", "scale": 1.0}, "'laplace'", "lognormal | loguniform"),
    ({"distribution": ["uniform"]}, "['uniform']", "uniform | normal"),
    ({"distribution": "uniform", "lower": 0.0}, "the keys lower", "the keys lower, upper"),
    ({"distribution": "halfnormal"}, "the keys (none)", "the keys scale"),
    ({"distribution": "normal", "mean": 0.0, "sd": 1.0, "lower": 0.0}, "mean, sd, lower", "sd"),
    ({"distribution": "uniform", "lower": 2.0, "upper": 2.0}, "lower = 2.0", "lower < upper"),
    ({"distribution": "uniform", "lower": -1e308, "upper": 1e308}, "1e+308", "a finite width"),
    ({"distribution": "uniform", "lower": "0", "upper": 2.0}, "'0'", "a finite number"),
    ({"distribution": "uniform", "lower": 0.0, "upper": math.inf}, "inf", "a finite number"),
    ({"distribution": "uniform", "lower": 0, "upper": 10**400}, "10000", "a finite number"),
    ({"distribution": "normal", "mean": math.nan, "sd": 1.0}, "nan", "a finite number"),
    ({"distribution": "normal", "mean": 0.0, "sd": 0.0}, "0.0", "a number above 0"),
    ({"distribution": "halfnormal", "scale": True}, "True", "a finite number"),
    ({"distribution": "halfnormal", "scale": -1.0}, "-1.0", "a number above 0"),
    ({"distribution": "lognormal", "median": 0.0, "sigma": 1.0}, "0.0", "a number above 0"),
    ({"distribution": "lognormal", "median": 1.0, "sigma": 0}, "0", "a number above 0"),
    ({"distribution": "loguniform", "lower": 0.0, "upper": 1.0}, "lower = 0.0", "0 < lower"),
]


@pytest.mark.parametrize(("table", "found", "accepted"), BAD)
def test_bad_tables_are_refused(table: dict[str, object], found: str, accepted: str) -> None:
    with pytest.raises(InputError) as caught:
        prior_from_table("k2[case1]", table)
    assert caught.value.where.startswith("[priors] k2[case1]")
    assert found in caught.value.found
    assert accepted in caught.value.accepted


def test_joint_density_is_the_sum_and_derivatives_stay_apart() -> None:
    priors = Priors(tuple(prior for prior, _ in TWINS))
    theta = priors.sample(np.random.default_rng(3), 50)
    assert theta.shape == (50, len(TWINS))
    expected = sum(twin.logpdf(theta[:, i]) for i, (_, twin) in enumerate(TWINS))
    np.testing.assert_allclose(priors.log_density(theta), expected, rtol=1e-12)
    assert priors.log_density(theta[0]) == pytest.approx(expected[0], rel=1e-12)
    for i, (prior, _) in enumerate(TWINS):
        assert priors.gradient(theta[4])[i] == prior.gradient(theta[4, i])
        assert priors.hessian(theta[4])[i] == prior.curvature(theta[4, i])
    half = priors.ppf(np.full((1, len(TWINS)), 0.5))
    np.testing.assert_allclose(half[0], [t.median() for _, t in TWINS], rtol=1e-12, atol=1e-15)
    supports = np.array([twin.support() for _, twin in TWINS])
    np.testing.assert_allclose(np.stack([priors.lower, priors.upper], axis=1), supports, rtol=1e-12)


@pytest.mark.parametrize("method", ["log_density", "gradient", "information", "hessian"])
def test_joint_priors_say_what_each_prior_says(method: str) -> None:
    """In mixed order, some values outside, at a bound, or no numbers."""
    rng = np.random.default_rng(7)
    alone = [TWINS[i][0] for i in rng.permutation(len(TWINS))]
    theta = Priors(tuple(alone)).sample(rng, 40)
    theta[3], theta[4, ::3], theta[5, 1::2], theta[6] = 0.0, np.nan, np.inf, -1.0
    own = "curvature" if method == "hessian" else method
    expected = np.stack([getattr(p, own)(theta[:, i]) for i, p in enumerate(alone)], axis=-1)
    found = getattr(Priors(tuple(alone)), method)
    if method == "log_density":
        expected = expected.sum(axis=-1)
    np.testing.assert_allclose(found(theta), expected, rtol=1e-13)
    np.testing.assert_allclose(found(theta[7]), expected[7], rtol=1e-13)


def test_one_parameter_outside_makes_the_joint_density_zero() -> None:
    priors = Priors((Uniform(0.0, 1.0), Normal(0.0, 1.0)))
    result = priors.log_density([[0.5, 0.0], [1.5, 0.0], [0.5, np.nan]])
    assert np.isfinite(result).tolist() == [True, False, False]
    assert not np.isnan(result).any()


def test_wrong_lengths_and_no_priors_are_refused() -> None:
    priors = Priors((Uniform(0.0, 1.0), Normal(0.0, 1.0)))
    for theta in ([0.5], [[0.5, 0.1, 0.2]], 0.5):
        with pytest.raises(InputError, match="parameter vector"):
            priors.log_density(theta)
    with pytest.raises(InputError, match="one prior per parameter"):
        Priors(())


@pytest.mark.parametrize("prior", [Cauchy(1.0, 0.3), HalfCauchy(0.3)])
def test_a_heavy_tail_counts_as_the_parabola_below_its_log_density(prior):
    """Which touches at theta: a step on it never overshoots, and the information stays positive."""
    priors = Priors((prior,))
    x = np.linspace(0.0, 8.0, 400)
    for at in (0.0, 0.2, 1.0, 1.7, 6.0):
        information = priors.information(np.array([at]))[0]
        assert information > 0
        parabola = prior.log_density(at) + prior.gradient(at) * (x - at)
        parabola = parabola - 0.5 * information * (x - at) ** 2
        assert np.all(parabola <= prior.log_density(x) + 1e-9)
