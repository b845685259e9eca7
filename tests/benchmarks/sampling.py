"""Peers of the sampler on one posterior: plain emcee, dynesty, NUTS; all in whitened coordinates.

u = L^-1 (theta - mode), L L^T the Laplace covariance: what every one of them would have to learn
first is given to it, and each starts where the posterior is.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import emcee
import numba
import numpy as np
from benchmarks.bundled import Array

from bayesimpact.inference.fit import Fit
from bayesimpact.inference.posterior import sample
from bayesimpact.inference.prior import LogUniform, Uniform
from bayesimpact.inference.sampling.convergence import (
    autocorrelation_time,
    effective_sizes,
    quiet_arviz,
)
from bayesimpact.inference.sampling.ensemble import WhitenedDensity, random_streams, start
from bayesimpact.inference.sampling.whiten import cholesky
from bayesimpact.model.exact.sensitivities.derivatives import grams
from bayesimpact.model.parameters import BASE_SLOTS

THIN = 10  # of emcee's steps; its autocorrelation times are hundreds
BOX = 6.0  # dynesty's prior reaches so many standard deviations to either side


@dataclass(frozen=True, eq=False)
class Sampled:
    """What a sampler made of the posterior, in SI units.

    Attributes
    ----------
    mean, sd : (d,) of the draws
    mean_error, sd_error : (d,) their Monte Carlo standard errors
    ess : (d,) bulk effective draws
    seconds : wall time, warm-up included, compilation not
    threads : that it could use; nutpie and dynesty ask for one point at a time, on one
    evaluations : of the log posterior (with NUTS: of it and its gradient)
    times : length in autocorrelation times of the slowest parameter, None where that has no meaning
    """

    mean: Array
    sd: Array
    mean_error: Array
    sd_error: Array
    ess: Array
    seconds: float
    threads: int
    evaluations: int
    times: float | None = None


def whitened(fit: Fit) -> WhitenedDensity:
    """The log posterior as a function of u."""
    target = fit.density
    bounds = np.array([(p.lower, p.upper) for p in target.oscillator.layout.parameters])
    lower = np.maximum(bounds[:, 0], target.priors.lower)
    upper = np.minimum(bounds[:, 1], target.priors.upper)
    return WhitenedDensity(target, fit.mode, cholesky(fit.covariance), lower, upper)


def moments(draws: Array) -> tuple[Array, Array, Array, Array, Array]:
    """The first five fields of `Sampled`, of draws (ensembles, steps, walkers, d).

    As in `bayesimpact.inference.sampling.convergence`: each ensemble one chain, its walkers end to
    end.
    """
    arviz, dimension = quiet_arviz(), draws.shape[-1]
    chains = draws.transpose(0, 2, 1, 3).reshape(len(draws), -1, dimension)
    flat = draws.reshape(-1, dimension)
    mean, sd, bulk = flat.mean(axis=0), flat.std(axis=0), effective_sizes(draws)[0]
    sizes = [
        np.array([float(arviz.ess(chains[..., j], method=method)) for j in range(dimension)])
        for method in ("mean", "sd")
    ]
    return mean, sd, sd / np.sqrt(sizes[0]), sd / np.sqrt(2.0 * sizes[1]), bulk


def in_theta(target: WhitenedDensity, u: Array) -> Array:
    """Draws (..., d) in parameters instead of u."""
    return target.theta(u.reshape(-1, u.shape[-1])).reshape(u.shape)


def ours(fit: Fit, seed: int) -> Sampled:
    """Our sampler as `bayesimpact sample` runs it."""
    began = time.perf_counter()
    chains = sample(fit, seed=seed).chains
    seconds = time.perf_counter() - began
    assert chains.converged, chains.convergence.reasons
    times = chains.convergence.steps / float(np.max(chains.convergence.tau))
    return Sampled(
        *moments(chains.draws), seconds, numba.get_num_threads(), chains.evaluations, times
    )


def plain_emcee(fit: Fit, seed: int, *, times: float = 50.0, limit: float = 240.0) -> Sampled:
    """Plain emcee: stretch moves, the compiled likelihood called once per half-ensemble.

    As many walkers as ours has, in one ensemble that starts from the Laplace Gaussian, and for that
    needs no burn-in; until `times` autocorrelation times or `limit` seconds.
    """
    target, (stream,) = whitened(fit), random_streams(seed, 1)
    dimension = fit.mode.size
    first = start(target, stream, max(32, 2 * dimension + 2), wide=False)
    sampler = emcee.EnsembleSampler(*first.walkers.shape, target, vectorize=True)
    state = emcee.State(first.walkers, log_prob=first.log_posterior, random_state=first.random)
    seconds, length, tau = 0.0, 0, np.inf
    while length < times * tau and seconds < limit:
        began = time.perf_counter()
        state = sampler.run_mcmc(state, 200, thin_by=THIN, skip_initial_state_check=True)
        seconds += time.perf_counter() - began
        length += 200 * THIN
        tau = float(autocorrelation_time(sampler.get_chain()[None]).max() * THIN)
    draws = in_theta(target, sampler.get_chain()[None])
    evaluations = length * first.walkers.shape[0]
    return Sampled(*moments(draws), seconds, numba.get_num_threads(), evaluations, length / tau)


def dynesty(fit: Fit, seed: int, *, live: int = 100, limit: int = 3_000_000) -> Sampled:
    """Nested sampling in a box of BOX standard deviations, with dynesty's own settings.

    live, limit : live points, and likelihoods after which to stop. The effective draws are Kish's,
    of the weights alone, an upper bound; Monte Carlo errors are those of resampled runs.
    """
    from dynesty import NestedSampler
    from dynesty.utils import resample_run

    target, dimension = whitened(fit), fit.mode.size
    prior, likelihood = quick_prior(fit), fit.density.likelihood

    def log_density(u: Array) -> float:
        theta = target.theta(u[None])
        if np.any((theta < target.lower) | (theta > target.upper)):
            return -1e300
        return float(likelihood(theta)[0]) + prior(theta[0])[0]

    def weighted(found: Any) -> tuple[Array, Array]:
        weights, theta = found.importance_weights(), target.theta(found.samples)
        mean = weights @ theta
        return mean, np.sqrt(weights @ (theta - mean) ** 2)

    rng = np.random.default_rng(seed)
    sampler = NestedSampler(
        log_density, lambda cube: BOX * (2.0 * cube - 1.0), dimension, nlive=live, rstate=rng
    )
    began = time.perf_counter()
    sampler.run_nested(print_progress=False, dlogz=0.1, maxcall=limit)
    seconds = time.perf_counter() - began
    found = sampler.results
    replicas = np.array([weighted(resample_run(found, rstate=rng)) for _ in range(50)])
    ess = np.full(dimension, 1.0 / np.sum(found.importance_weights() ** 2))
    calls = int(np.sum(found.ncall))
    return Sampled(*weighted(found), *replicas.std(axis=0), ess, seconds, 1, calls)


def quick_prior(fit: Fit) -> Callable[[Array], tuple[float, Array]]:
    """Log prior density and gradient at one theta (d,) inside the bounds.

    The package computes them for batches; one point at a time, which is what dynesty and NUTS ask
    for, its loop over priors would take longer than the likelihood.
    """
    priors, mode = fit.density.priors, fit.mode
    assert {type(prior) for prior in priors.parameters} <= {Uniform, LogUniform}
    inverse = np.array([isinstance(prior, LogUniform) for prior in priors.parameters])
    constant = float(priors.log_density(mode[None])[0] + np.sum(np.log(mode[inverse])))

    def function(theta: Array) -> tuple[float, Array]:
        gradient = np.zeros(theta.size)
        gradient[inverse] = -1.0 / theta[inverse]
        return constant - float(np.sum(np.log(theta[inverse]))), gradient

    return function


def with_gradient(fit: Fit) -> Callable[[Array], tuple[float, Array]]:
    """Log posterior and exact gradient at theta (d,), of a plain oscillator under white noise."""
    likelihood, o = fit.density.likelihood, fit.density.oscillator
    prior = quick_prior(fit)
    assert o.is_plain and likelihood.noise.is_white
    columns = np.ascontiguousarray(o.layout.columns[:, : len(BASE_SLOTS)])
    constants = np.ascontiguousarray(o.layout.constants[:, : len(BASE_SLOTS)])
    used, data = columns >= 0, (o.samples, o.starts, o.counts, o.intervals)
    noise, sizes, last = likelihood.sigma_columns, likelihood.sizes, len(BASE_SLOTS)

    def function(theta: Array) -> tuple[float, Array]:
        matrices, _ = grams(theta, columns, constants, o.campaign.mass, *data)
        sums, sigma = matrices[:, last, last], theta[noise]
        each = -sizes * np.log(sigma * np.sqrt(2 * np.pi)) - sums / (2 * sigma**2)
        value, gradient = prior(theta)
        pull = matrices[:, :last, last] / sigma[:, None] ** 2
        np.add.at(gradient, columns[used], pull[used])
        np.add.at(gradient, noise, sums / sigma**3 - sizes / sigma)
        return value + float(np.sum(each + likelihood.log_volume)), gradient

    return function


class Outside(ValueError):
    """A point of no density; NUTS then ends its trajectory."""

    is_recoverable = True


def nuts(fit: Fit, seed: int, *, draws: int = 1000, tune: int = 300, chains: int = 2) -> Sampled:
    """NUTS (nutpie) with our exact gradients, chain after chain; tuning included in the time."""
    import nutpie

    target, both, dimension = whitened(fit), with_gradient(fit), fit.mode.size
    calls = 0

    def log_density(u: Array) -> tuple[float, Array]:
        nonlocal calls
        calls += 1
        theta = target.theta(u[None])[0]
        if np.any((theta < target.lower) | (theta > target.upper)):
            raise Outside
        value, gradient = both(theta)
        if not np.isfinite(value):
            raise Outside
        return value, target.factor.T @ gradient

    model = nutpie.compiled_pyfunc.from_pyfunc(
        dimension,
        lambda: log_density,
        lambda seed1, seed2, chain: lambda u: {"u": np.asarray(u)},
        [np.dtype(np.float64)],
        [(dimension,)],
        ["u"],
    )
    began = time.perf_counter()
    trace = nutpie.sample(
        model, draws=draws, tune=tune, chains=chains, cores=1, seed=seed, progress_bar=False,
        save_warmup=False,
    )  # fmt: skip
    seconds = time.perf_counter() - began
    u = trace.posterior["u"].values[:, :, None, :]
    return Sampled(*moments(in_theta(target, u)), seconds, 1, calls)
