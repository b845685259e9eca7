"""The diagnostics know truth on processes with known autocorrelation."""

from __future__ import annotations

import emcee
import numpy as np
import pytest

from bayesimpact.inference.sampling.convergence import (
    assess,
    autocorrelation_time,
    effective_sizes,
    split_rhat,
)
from bayesimpact.inference.sampling.moves import FIRST_WEIGHTS, Frame, Mixture, move_set


def autoregressive(rho, *, ensembles=2, steps=600, walkers=16, seed=0):
    """Unit-variance AR(1) chains of every rho, (ensembles, steps, walkers, len(rho))."""
    rng = np.random.default_rng(seed)
    rho = np.asarray(rho)
    noise = rng.standard_normal((steps, ensembles, walkers, rho.size))
    draws = np.empty_like(noise)
    draws[0] = noise[0]
    for t in range(1, steps):
        draws[t] = rho * draws[t - 1] + np.sqrt(1.0 - rho**2) * noise[t]
    return draws.transpose(1, 0, 2, 3)


def test_time_of_an_autoregressive_process():
    """tau = (1 + rho)/(1 - rho); Sokal's standard error is tau sqrt(2 (2 M + 1)/N), M = 5 tau."""
    rho = np.array([0.0, 0.5, 0.8, 0.9])
    truth = (1.0 + rho) / (1.0 - rho)
    draws = autoregressive(rho, steps=2000)
    error = truth * np.sqrt(2.0 * (10.0 * truth + 1.0) / (2000 * 32))
    assert (np.abs(autocorrelation_time(draws) - truth) < 4.0 * error + 0.01 * truth).all()


def test_time_agrees_with_emcee_on_a_mixed_chain():
    draws = autoregressive([0.3, 0.8], ensembles=1, steps=4000)
    reference = emcee.autocorr.integrated_time(draws[0], quiet=True)
    np.testing.assert_allclose(autocorrelation_time(draws), reference, rtol=0.03)


def test_a_stuck_walker_lengthens_the_time_and_is_named():
    draws = autoregressive([0.5, 0.5])
    draws[1, :, 3] = 2.0
    assert (autocorrelation_time(draws) > 6.0).all()
    record = assess(draws)
    assert not record.converged
    assert any("1 of 32 walkers never moved" in reason for reason in record.reasons)


def test_nothing_moved():
    record = assess(np.ones((2, 100, 8, 1)))
    assert np.isinf(record.tau).all()
    assert not record.converged


@pytest.mark.parametrize("rho", [0.2, 0.7])
def test_effective_size_of_an_autoregressive_process(rho):
    draws = autoregressive([rho] * 8, steps=1000)
    truth = 2 * 1000 * 16 * (1.0 - rho) / (1.0 + rho)
    bulk, tail = effective_sizes(draws)
    assert bulk.mean() == pytest.approx(truth, rel=0.1)
    assert (tail > 0.5 * truth).all()


@pytest.mark.parametrize(("share", "steps"), [(0.8, 150), (0.2, 300)])
def test_effective_size_is_unbiased_for_interacting_walkers(share, steps):
    """ESS from one run against the error of the mean over replicated runs of the real move set."""
    dimension, walkers, replicates = 10, 22, 30
    frame = Frame(np.zeros(dimension), np.eye(dimension))
    mixture = Mixture((frame,), np.array([FIRST_WEIGHTS]))
    means, claims = [], []
    for k in range(replicates):
        random = np.random.RandomState(k)
        sampler = emcee.EnsembleSampler(
            walkers,
            dimension,
            lambda x: -0.5 * np.square(x).sum(axis=1),
            moves=move_set(mixture, share),
            vectorize=True,
        )
        start = random.standard_normal((walkers, dimension))
        state = emcee.State(start, random_state=random.get_state())
        sampler.run_mcmc(state, steps, skip_initial_state_check=True)
        chain = sampler.get_chain()
        means.append(chain.mean(axis=(0, 1)))
        if k % 3 == 0:
            claims.append(effective_sizes(chain[None])[0].mean())
    truth = 1.0 / np.mean(np.square(means))  # relative error sqrt(2/300) = 8 %
    assert np.mean(claims) == pytest.approx(truth, rel=4.0 * np.sqrt(2.0 / 300.0))


def test_rhat_sees_a_shifted_ensemble_and_a_drift_in_time():
    draws = autoregressive([0.0, 0.0, 0.0])
    assert (split_rhat(draws) < 1.005).all()
    draws[1, :, :, 0] += 0.5
    draws[..., 1] += np.linspace(0.0, 1.0, draws.shape[1])[:, None]
    rhat = split_rhat(draws)
    assert rhat[0] > 1.02
    assert rhat[1] > 1.02
    assert rhat[2] < 1.005


def test_rhat_needs_two_ensembles():
    record = assess(autoregressive([0.0], ensembles=1))
    assert np.isnan(record.rhat).all()
    assert not record.converged
    assert "single ensemble" in " ".join(record.reasons)


def test_a_good_run_has_no_reasons():
    record = assess(autoregressive([0.0, 0.5]), names=("c1", "k1"))
    assert record.converged
    assert record.reasons == ()
    assert (record.steps, record.walkers, record.ensembles) == (600, 16, 2)


@pytest.mark.parametrize(
    ("draws", "options", "words"),
    [
        (autoregressive([0.0, 0.9]), {}, ["shorter than 50 autocorrelation times", "k1; 1 of 2"]),
        (autoregressive([0.0, 0.0]), {"target_ess": 1e6}, ["bulk effective", "tail effective"]),
        (
            autoregressive([0.0, 0.0]) + np.array([0.0, 0.6]) * np.arange(2)[:, None, None, None],
            {},
            ["ensembles disagree", "k1; 1 of 2"],
        ),
    ],
)
def test_every_demand_fails_in_words(draws, options, words):
    record = assess(draws, names=("c1", "k1"), **options)
    assert not record.converged
    for word in words:
        assert word in " ".join(record.reasons)


def test_thinning_counts_steps_of_the_sampler():
    record = assess(autoregressive([0.5])[:, ::4], thin=4)
    assert record.steps == 600
    assert record.tau[0] == pytest.approx(4.0 * (1.0 + 0.5**4) / (1.0 - 0.5**4), rel=0.15)


def test_draws_that_are_not_finite_do_not_converge():
    draws = autoregressive([0.0, 0.0])
    draws[0, 3, 2, 0] = np.nan
    record = assess(draws)
    assert not record.converged
