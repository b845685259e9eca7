"""Sampling: right answers, a verdict that can fail, a resumed chain equal to the uninterrupted."""

from __future__ import annotations

from dataclasses import replace

import emcee
import numpy as np
import pytest
from sampling import Interrupted, assert_same, correlated, small
from scipy.special import digamma, polygamma

import bayesimpact.inference.sampling.sample as sample_module
from bayesimpact.errors import InputError, SimulationError
from bayesimpact.inference.sampling.convergence import autocorrelation_time
from bayesimpact.inference.sampling.ensemble import (
    DrawBlock,
    WhitenedDensity,
    adapt,
    advance,
    random_streams,
    start,
)
from bayesimpact.inference.sampling.sample import sample_posterior


def test_gaussian_of_very_different_sizes():
    log_posterior, mode, covariance = correlated()
    chains = sample_posterior(log_posterior, mode, covariance, seed=0)
    record = chains.convergence
    assert chains.converged
    assert chains.draws.shape == (2, chains.steps - chains.discarded, 32, 6)
    sd = np.sqrt(np.diag(covariance))
    error = 1.0 / np.sqrt(record.ess_bulk)
    assert (np.abs((chains.flat.mean(axis=0) - mode) / sd) < 4.0 * error).all()
    # A variance has relative error sqrt(2/ESS); its ESS is below that of the mean by up to 3 here.
    ratio = chains.flat.var(axis=0) / sd**2
    assert (np.abs(ratio - 1.0) < 4.0 * np.sqrt(6.0) * error).all()
    np.testing.assert_allclose(
        chains.log_posterior.ravel(), log_posterior(chains.flat), rtol=1e-6, atol=1e-6
    )
    assert record.steps > 50.0 * record.tau.max()
    assert record.ess_bulk.min() >= 2000.0
    assert record.rhat.max() < 1.01
    assert chains.acceptance.shape == (2,)
    assert chains.move_acceptance["independence"].min() > 0.7


def test_skewed_posterior_from_its_laplace_approximation():
    """Logarithms of gamma variates: mode and curvature miss the mean by 0.2 sd."""
    shape, dimension = 6.0, 7

    def log_posterior(y):
        return (shape * (y - np.expm1(y))).sum(axis=1)

    covariance = np.eye(dimension) / shape
    chains = sample_posterior(log_posterior, np.zeros(dimension), covariance, seed=3)
    assert chains.converged
    sd = np.sqrt(polygamma(1, shape))
    bias = (chains.flat.mean(axis=0) - digamma(shape) + np.log(shape)) / sd
    assert (np.abs(bias) < 4.0 / np.sqrt(chains.convergence.ess_bulk)).all()
    assert chains.flat.std(axis=0) == pytest.approx(np.full(dimension, sd), rel=0.06)


def test_posterior_far_wider_than_its_laplace_approximation():
    """The proposal learns from the burn-in; three parameters are 5 sd wider than stated."""
    sd = np.array([5.0, 5.0, 5.0, 1.0, 1.0])

    def log_posterior(x):
        return -0.5 * np.square(x / sd).sum(axis=1)

    chains = sample_posterior(log_posterior, np.zeros(5), np.eye(5), seed=0)
    assert chains.converged
    assert chains.move_acceptance["independence"].min() > 0.3
    assert chains.flat.std(axis=0) == pytest.approx(sd, rel=0.07)


def test_two_modes():
    """Overlapping modes of unequal mass; the Laplace approximation knows only one."""

    def log_posterior(x):
        rest = -0.5 * np.square(x[:, 1:]).sum(axis=1)
        near, far = -0.5 * x[:, 0] ** 2, -0.5 * (x[:, 0] - 5.0) ** 2
        return rest + np.logaddexp(np.log(0.4) + near, np.log(0.6) + far)

    chains = sample_posterior(log_posterior, np.zeros(4), np.eye(4), seed=2)
    assert chains.converged
    error = np.sqrt(0.24 / chains.convergence.ess_bulk[0])
    assert abs((chains.flat[:, 0] > 2.5).mean() - 0.6) < 4.0 * error


def test_bounds_hold_and_are_not_crossed_by_calls():
    """Half-normal in the first parameter, whose mode lies on the bound."""
    lower = np.array([0.0, -np.inf])

    def log_posterior(x):
        assert (x >= lower).all()
        return -0.5 * np.square(x).sum(axis=1)

    chains = sample_posterior(
        log_posterior, np.zeros(2), np.eye(2), seed=1, lower=lower, upper=np.array([np.inf, 3.0])
    )
    assert chains.converged
    assert chains.flat[:, 0].min() >= 0.0
    assert chains.flat[:, 1].max() <= 3.0
    error = np.sqrt(1.0 - 2.0 / np.pi) / np.sqrt(chains.convergence.ess_bulk[0])
    assert abs(chains.flat[:, 0].mean() - np.sqrt(2.0 / np.pi)) < 4.0 * error


def test_no_walker_starts_or_ends_inadmissible():
    def log_posterior(x):
        values = -0.5 * np.square(x).sum(axis=1)
        values[x[:, 0] + x[:, 1] > 0.5] = -np.inf
        return values

    chains = sample_posterior(log_posterior, np.zeros(3), np.eye(3), seed=1, max_steps=100)
    assert np.isfinite(chains.log_posterior).all()


def test_start_is_feasible_and_the_second_one_is_wider():
    _, mode, covariance = correlated()
    target = WhitenedDensity(
        lambda x: np.where(x[:, 0] > mode[0], 0.0, -np.inf),
        mode,
        np.linalg.cholesky(covariance),
        np.full(6, -np.inf),
        np.full(6, np.inf),
    )
    narrow, wide = (
        start(target, stream, 400, wide=k > 0) for k, stream in enumerate(random_streams(0, 2))
    )
    for snapshot in (narrow, wide):
        assert np.isfinite(snapshot.log_posterior).all()
        assert (target.theta(snapshot.walkers)[:, 0] > mode[0]).all()
    assert np.abs(wide.walkers[:, 1:]).mean() > 1.3 * np.abs(narrow.walkers[:, 1:]).mean()


def test_same_seed_same_chain_whatever_the_global_state(uninterrupted):
    np.random.seed(1)  # noqa: NPY002
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    again = small(Interrupted())
    assert_same(again, uninterrupted)
    np.testing.assert_array_equal(before, np.random.get_state()[1])  # noqa: NPY002
    other = small(Interrupted(), seed=6)
    assert not np.array_equal(other.draws, again.draws)
    assert np.unique(again.draws[:, 0, :, 0]).size == 20  # ensembles share no stream


def test_advancing_in_parts_equals_advancing_at_once():
    target = WhitenedDensity(
        Interrupted(), np.ones(3), np.eye(3), np.full(3, -9.0), np.full(3, 9.0)
    )
    first = start(target, random_streams(0, 1)[0], 8, wide=False)
    kept = first.walkers.copy()
    at_once, stretch = advance(first, target, 30)
    middle, early = advance(first, target, 11)
    end, late = advance(middle, target, 19)
    np.testing.assert_array_equal(first.walkers, kept)  # snapshots are not written to
    np.testing.assert_array_equal(np.concatenate([early.draws, late.draws]), stretch.draws)
    np.testing.assert_array_equal(end.walkers, at_once.walkers)
    np.testing.assert_array_equal(early.tally + late.tally, stretch.tally)


def test_adapting_learns_centre_scatter_and_share():
    """A stretch of independent draws around (3, 0) with standard deviations (2, 0.5)."""
    target = WhitenedDensity(
        Interrupted(), np.ones(2), np.eye(2), np.full(2, -9.0), np.full(2, 9.0)
    )
    first = start(target, random_streams(0, 1)[0], 40, wide=False)
    rng = np.random.default_rng(0)
    draws = rng.standard_normal((100, 40, 2)) * [2.0, 0.5] + [3.0, 0.0]
    tally = np.array([[2000, 1800], [1000, 1000], [500, 100], [300, 50], [200, 50]])
    later = adapt(first, DrawBlock(draws, np.zeros((100, 40)), tally))
    frame = later.mixture.frames[1]
    np.testing.assert_allclose(frame.centre, [3.0, 0.0], atol=0.15)
    np.testing.assert_allclose(frame.factor @ frame.factor.T, np.diag([4.0, 0.25]), atol=0.3)
    assert later.mixture.weights[1].sum() > 0.8
    assert later.mixture.weights.sum() == pytest.approx(1.0)
    assert later.share == pytest.approx(0.85)
    poor = adapt(first, DrawBlock(draws, np.zeros((100, 40)), tally * [1, 0]))
    assert poor.share < 0.3


def test_acceptance_is_the_share_of_walkers_that_moved(uninterrupted):
    """No step is rejected into the same place, and none accepted without a move."""
    moved = (np.diff(uninterrupted.draws, axis=1) != 0.0).any(axis=3)
    # The first of the 120 kept steps is not in the differences.
    np.testing.assert_allclose(
        uninterrupted.acceptance, moved.mean(axis=(1, 2)), atol=1.0 / uninterrupted.steps
    )


def test_not_converged_is_said_with_reasons(uninterrupted):
    assert not uninterrupted.converged
    assert not uninterrupted.convergence.converged
    assert "effective sample size" in " ".join(uninterrupted.convergence.reasons)
    assert uninterrupted.steps == 120


def test_ensembles_that_settle_in_different_places_do_not_converge(monkeypatch):
    """Two modes 60 sd apart, an ensemble in each; the first never hears of the second mode."""

    def log_posterior(x):
        rest = -0.5 * np.square(x[:, 1:]).sum(axis=1)
        return rest - 0.5 * np.square(x[:, 0] - np.where(x[:, 0] > 30.0, 60.0, 0.0))

    def apart(target, random, walkers, *, wide):
        snapshot = start(target, random, walkers, wide=False)
        moved = snapshot.walkers + np.array([60.0 * wide, 0.0])
        return replace(snapshot, walkers=moved, log_posterior=target(moved))

    monkeypatch.setattr(sample_module, "start", apart)
    chains = sample_posterior(
        log_posterior, np.zeros(2), np.eye(2), seed=0, max_steps=300, names=("here", "there")
    )
    far = (chains.draws[..., 0] > 30.0).mean(axis=(1, 2))
    assert far[0] == 0.0
    assert far[1] > 0.3
    assert not chains.converged
    assert "ensembles disagree" in " ".join(chains.convergence.reasons)
    assert "(here;" in " ".join(chains.convergence.reasons)


def test_progress_is_told_after_every_block():
    seen = []
    small(Interrupted(), progress=seen.append)
    assert [report.steps for report in seen] == [0, 0, 20, 40, 60, 80, 100, 120]
    assert [report.burning for report in seen[:2]] == [True, False]
    assert seen[-1].max_steps == 120
    assert seen[-1].tau is not None


def test_rarely_accepted_proposals_lengthen_the_burn_in():
    """A curved, narrow density in 12 dimensions."""

    def log_posterior(x):
        across = (x[:, 1:] - 2.0 * x[:, :1] ** 2) / 0.05
        return -0.5 * (x[:, 0] ** 2 + np.square(across).sum(axis=1))

    covariance = np.diag([1.0] + [0.0025] * 11)
    chains = sample_posterior(
        log_posterior, np.zeros(12), covariance, seed=0, block=16, max_steps=50
    )
    assert chains.burn_in == 8 + 8 + 16 + 32 + 64 + 128 + 256
    assert not chains.converged


@pytest.mark.parametrize(("dimension", "steps"), [(35, 50), (83, 20)])
def test_many_walkers_take_shorter_blocks(dimension, steps):
    """Two rounds of half a block each: 3,600 draws, and no more than 50 steps."""
    log_posterior, mode, covariance = correlated(dimension)
    chains = sample_posterior(log_posterior, mode, covariance, seed=0, max_steps=1)
    assert chains.burn_in == steps


def test_nan_is_an_error_that_names_the_place():
    def log_posterior(x):
        values = -0.5 * np.square(x).sum(axis=1)
        values[x[:, 0] > 1.0] = np.nan
        return values

    with pytest.raises(SimulationError, match="log posterior is nan at"):
        sample_posterior(log_posterior, np.zeros(2), np.eye(2), seed=0)


def test_no_admissible_start():
    def log_posterior(x):
        return np.where((x == 0.0).all(axis=1), 0.0, -np.inf)

    with pytest.raises(SimulationError, match="no admissible start"):
        sample_posterior(log_posterior, np.zeros(2), np.eye(2), seed=0)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"seed": -1}, "seed"),
        ({"walkers": 11}, "even number >= 6"),
        ({"walkers": 4}, "even number >= 6"),
        ({"ensembles": 1}, "at least 2 independent"),
        ({"block": 2}, "block"),
        ({"max_steps": 0}, "max_steps"),
        ({"names": ("a",)}, "3 names"),
        ({"lower": np.full(3, 2.0)}, "inadmissible point"),
    ],
)
def test_bad_arguments(options, words):
    with pytest.raises(InputError, match=words):
        small(Interrupted(), **options)


def test_far_more_effective_draws_per_call_than_the_stretch_move():
    """Worst autocorrelation time in 12 dimensions; emcee's tau ~ 8 d for the stretch move."""
    dimension = 12

    def log_posterior(x):
        return -0.5 * np.square(x).sum(axis=1)

    chains = sample_posterior(log_posterior, np.zeros(dimension), np.eye(dimension), seed=0)
    sampler = emcee.EnsembleSampler(26, dimension, log_posterior, vectorize=True)
    random = np.random.RandomState(0)
    first = random.standard_normal((26, dimension))
    sampler.run_mcmc(emcee.State(first, random_state=random.get_state()), 3000)
    plain = autocorrelation_time(sampler.get_chain()[None]).max()
    assert chains.convergence.tau.max() < 2.5
    assert plain > 25.0 * chains.convergence.tau.max()


def test_records_are_frozen(uninterrupted):
    with pytest.raises(AttributeError):
        uninterrupted.seed = 1
    assert replace(uninterrupted, seed=1).seed == 1
