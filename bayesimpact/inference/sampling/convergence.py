"""Has an ensemble run converged? Autocorrelation time, effective sample size, agreement.

Walkers of one ensemble are not independent chains: stretch and differential-evolution moves build
a proposal for one walker from the others. So

- the autocorrelation time averages the autocovariance over all walkers, about the mean of all
  ensembles: a walker that is stuck, or an ensemble that sits elsewhere, lengthens it;
- ESS gets every ensemble as one chain, its walkers' histories laid end to end. Correlation
  between walkers at different steps is not in it; on Gaussians the replicated error of the mean
  agrees with it within 20 % for every move used here
  (tests/inference/sampling/test_convergence.py);
- R-hat compares independent ensembles with one another, and the first half of the steps with the
  second: an ensemble's draws are laid out step by step, so that the split is a split in time.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.short_repr import short_repr

Array = NDArray[np.float64]

TAIL = (0.05, 0.95)  # quantiles of the tail ESS: the ends of the reported 90 % intervals


@dataclass(frozen=True, eq=False)
class ConvergenceRecord:
    """What a run's draws say about its convergence.

    Attributes
    ----------
    names : d parameters
    tau : (d,) integrated autocorrelation time, steps
    ess_bulk, ess_tail : (d,) effective number of draws for the centre, and for the worse of the
        5 % and 95 % quantiles (Vehtari et al. 2021)
    rhat : (d,) rank-normalised split R-hat between ensembles
    ensembles, steps, walkers, thin : of the draws looked at; `steps` counts steps of the sampler
    converged : no reason against it
    reasons : in words, what speaks against convergence; empty when converged
    """

    names: tuple[str, ...]
    tau: Array
    ess_bulk: Array
    ess_tail: Array
    rhat: Array
    ensembles: int
    steps: int
    walkers: int
    thin: int
    converged: bool
    reasons: tuple[str, ...]

    __repr__ = short_repr


def quiet_arviz() -> ModuleType:
    """The arviz module, imported on first use and without its announcement of version 1."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FutureWarning)
        import arviz
    return arviz


def autocorrelation_time(draws: Array, window: float = 5.0) -> Array:
    """Integrated autocorrelation time 1 + 2 sum(rho_t) of every parameter, in stored steps.

    Sokal's window (Sokal 1997, section 3; Foreman-Mackey et al. 2013): the smallest M >= window
    tau(M). The autocovariance is averaged over walkers and ensembles, about their common mean.

    Parameters
    ----------
    draws : (ensembles, steps, walkers, d)
    window : c in M >= c tau

    Returns
    -------
    (d,), >= 1 for a chain that does not anticorrelate; inf where nothing moved
    """
    steps = draws.shape[1]
    size = 1 << (2 * steps - 1).bit_length()
    times = np.empty(draws.shape[3])
    for j in range(draws.shape[3]):
        series = draws[..., j] - draws[..., j].mean()
        transform = np.fft.rfft(series, size, axis=1)
        power = (transform.real**2 + transform.imag**2).mean(axis=(0, 2))
        covariance = np.fft.irfft(power, size)[:steps]
        if not (covariance[0] > 0.0 and np.ptp(draws[..., j], axis=1).max() > 0.0):
            times[j] = np.inf
            continue
        sums = 2.0 * np.cumsum(covariance / covariance[0]) - 1.0
        inside = np.arange(steps) < window * sums
        times[j] = sums[steps - 1 if inside.all() else int(np.argmin(inside))]
    return times


def split_rhat(draws: Array) -> Array:
    """Rank-normalised split R-hat between ensembles, (ensembles, steps, walkers, d) -> (d,).

    Vehtari et al. 2021, Bayesian Analysis 16:667; split in time. NaN with fewer than 2 ensembles:
    halves of one ensemble are no independent evidence.
    """
    if draws.shape[0] < 2:
        return np.full(draws.shape[3], np.nan)
    chains = draws.reshape(draws.shape[0], -1, draws.shape[3])
    arviz = quiet_arviz()
    with np.errstate(all="ignore"):  # 0/0 where nothing moved: the NaN is the answer
        return np.array([float(arviz.rhat(chains[..., j])) for j in range(draws.shape[3])])


def effective_sizes(draws: Array) -> tuple[Array, Array]:
    """Bulk and tail ESS, (ensembles, steps, walkers, d) -> (d,), (d,).

    Vehtari et al. 2021, with every ensemble as one chain of its walkers' histories end to end.
    """
    ensembles, _, _, dimension = draws.shape
    arviz = quiet_arviz()
    bulk, tail = np.empty(dimension), np.empty(dimension)
    with np.errstate(all="ignore"):
        for j in range(dimension):
            chains = draws[..., j].transpose(0, 2, 1).reshape(ensembles, -1)
            bulk[j] = float(arviz.ess(chains, method="bulk"))
            tail[j] = float(arviz.ess(chains, method="tail", prob=TAIL))
    return bulk, tail


def assess(
    draws: Array,
    *,
    thin: int = 1,
    target_ess: float = 1000.0,
    min_times: float = 50.0,
    max_rhat: float = 1.01,
    names: Sequence[str] | None = None,
) -> ConvergenceRecord:
    """Judges the kept draws of all ensembles.

    Converged means: more than `min_times` autocorrelation times of every parameter, bulk and tail
    ESS of every parameter at least `target_ess`, R-hat of every parameter below `max_rhat` between
    at least two independent ensembles, and no walker that never moved.

    Parameters
    ----------
    draws : (ensembles, stored steps, walkers, d)
    thin : sampler steps per stored step
    target_ess, min_times, max_rhat : limits
    names : d parameter names for the reasons; numbered when None
    """
    ensembles, stored, walkers, dimension = draws.shape
    names = tuple(names) if names is not None else tuple(f"parameter {j}" for j in range(dimension))
    tau = autocorrelation_time(draws) * thin
    bulk, tail = effective_sizes(draws)
    rhat = split_rhat(draws)
    reasons = []

    def demand(satisfied: NDArray[np.bool_], worst: int, text: str) -> None:
        # Comparisons with NaN are False, so what could not be computed counts as not satisfied.
        if not satisfied.all():
            failed = int((~satisfied).sum())
            reasons.append(text + f" ({names[worst]}; {failed} of {dimension} parameters)")

    worst = int(np.argmax(np.nan_to_num(tau, nan=np.inf)))
    demand(
        stored * thin > min_times * tau,
        worst,
        f"the run of {stored * thin} steps is shorter than {min_times:g} autocorrelation times of "
        f"{tau[worst]:.3g} steps",
    )
    for label, size in (("bulk", bulk), ("tail", tail)):
        worst = int(np.argmin(np.nan_to_num(size, nan=-np.inf)))
        demand(
            size >= target_ess,
            worst,
            f"the {label} effective sample size is {size[worst]:.0f}, below {target_ess:g}",
        )
    if ensembles < 2:
        reasons.append("a single ensemble cannot show that independent starts agree")
    else:
        worst = int(np.argmax(np.nan_to_num(rhat, nan=np.inf)))
        demand(
            rhat < max_rhat,
            worst,
            f"independent ensembles disagree: R-hat is {rhat[worst]:.3f}, not below {max_rhat:g}",
        )
    stuck = int((np.ptp(draws, axis=1) == 0.0).all(axis=2).sum())
    if stuck:
        reasons.append(f"{stuck} of {ensembles * walkers} walkers never moved")
    return ConvergenceRecord(
        names,
        tau,
        bulk,
        tail,
        rhat,
        ensembles,
        stored * thin,
        walkers,
        thin,
        not reasons,
        tuple(reasons),
    )
