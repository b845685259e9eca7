"""Posterior by emcee: independent ensembles that stop by themselves, saved in blocks.

A run is a burn-in of a few rounds, after each of which every ensemble adapts its own proposal,
and a kept part with frozen moves, looked at after growing numbers of blocks until the demands of
`bayesimpact.inference.sampling.convergence` are met or the allowance of steps is used up.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from math import ceil, isfinite
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.lock import locked
from bayesimpact.data.short_repr import short_repr
from bayesimpact.errors import InputError
from bayesimpact.inference.sampling.chainfile import ChainFolder
from bayesimpact.inference.sampling.convergence import (
    ConvergenceRecord,
    assess,
    autocorrelation_time,
)
from bayesimpact.inference.sampling.ensemble import (
    WhitenedDensity,
    pack,
    random_streams,
    start,
    unpack,
)
from bayesimpact.inference.sampling.moves import MOVE_NAMES
from bayesimpact.inference.sampling.run import Run
from bayesimpact.inference.sampling.whiten import cholesky, invert_lower, transform

Array = NDArray[np.float64]

_FORMAT = 1
_BLOCK_STEPS, _BLOCK_DRAWS, _LEAST_BLOCK = 50, 3600, 8
_QUICK_WALKERS = 64  # looked at first, for a full assessment takes longer


@dataclass(frozen=True)
class Progress:
    """Where a run is, handed to the progress callback after every block.

    Attributes
    ----------
    burning : still in the burn-in
    steps, max_steps : kept steps of every ensemble so far, and their allowance
    tau : autocorrelation time of the slowest parameter when last looked at, steps
    ess : effective draws of that parameter then
    """

    burning: bool
    steps: int
    max_steps: int
    tau: float | None
    ess: float | None


@dataclass(frozen=True, eq=False)
class Chains:
    """Draws from the posterior, after burn-in.

    Attributes
    ----------
    draws : (ensembles, stored steps, walkers, d) parameters; the burn-in and the discarded steps
        are not in it
    log_posterior : (ensembles, stored steps, walkers)
    converged, convergence : the verdict on exactly these draws, and what it rests on
    acceptance : (ensembles,) accepted share of all proposals in the kept part
    move_acceptance : the same per move; NaN for a move never drawn
    steps : kept steps of every ensemble, `discarded` among them
    burn_in : steps before, in which the proposals adapted
    discarded : kept steps left out of `draws` at their beginning, while the start was forgotten
    thin : steps per stored step
    evaluations : walkers times steps of all ensembles, burn-in included
    seconds : wall time of this call
    seed : of the run
    """

    draws: Array
    log_posterior: Array
    converged: bool
    convergence: ConvergenceRecord
    acceptance: Array
    move_acceptance: Mapping[str, Array]
    steps: int
    burn_in: int
    discarded: int
    thin: int
    evaluations: int
    seconds: float
    seed: int

    __repr__ = short_repr

    @property
    def flat(self) -> Array:
        """All draws, (ensembles x stored steps x walkers, d)."""
        return self.draws.reshape(-1, self.draws.shape[-1])


def _look(
    run: Run, target_ess: float, names: Sequence[str] | None, final: bool
) -> tuple[ConvergenceRecord | None, int, float, float]:
    """Record (None while it is too early), stored steps to discard, worst time and ESS."""
    trace = run.trace
    draws, _ = trace.arrays()
    ensembles, stored, walkers, _ = draws.shape
    some = draws[:, :, :: max(1, walkers // _QUICK_WALKERS)]
    tau = float((autocorrelation_time(some) * trace.thin).max())
    ess = ensembles * walkers * trace.steps / max(tau, trace.thin)
    forget = 10.0 * tau - run.burn_in  # steps; ten times the memory, burn-in included
    half = stored // 2
    cut = min(half, max(0, ceil(forget / trace.thin))) if isfinite(tau) else half
    if not final and ((stored - cut) * trace.thin <= 50.0 * tau or ess < target_ess):
        return None, cut, tau, ess
    record = assess(draws[:, cut:], thin=trace.thin, target_ess=target_ess, names=names)
    if not record.converged and cut < half:
        later = assess(draws[:, half:], thin=trace.thin, target_ess=target_ess, names=names)
        if later.converged:
            record, cut = later, half
    return record, cut, tau, ess


def sample_posterior(
    log_posterior: Callable[[Array], Array],
    mode: Array,
    covariance: Array,
    *,
    seed: int,
    walkers: int | None = None,
    ensembles: int = 2,
    block: int | None = None,
    max_steps: int = 20_000,
    target_ess: float = 2000.0,
    folder: Path | None = None,
    resume: bool = False,
    fingerprint: str | Mapping[str, str] = "",
    lower: Array | None = None,
    upper: Array | None = None,
    names: Sequence[str] | None = None,
    progress: Callable[[Progress], None] | None = None,
    tell: Callable[[str], None] | None = None,
) -> Chains:
    """Samples a posterior from its mode and curvature until independent ensembles agree.

    The first ensemble starts from the Laplace Gaussian, the others from a Student-t half as wide
    again; each has its own random stream and its own proposal. Burn-in: two rounds of block/2 steps
    where independence proposals are mostly accepted, else a third of block steps, and where they
    are rarely accepted four more, each twice as long as the last. Kept: all further steps, but for
    the first 10 autocorrelation times of the whole run (burn-in included), or the first half
    should only the second half pass.

    Parameters
    ----------
    log_posterior : (n, d) parameters -> (n,), -inf where inadmissible, never NaN; the value of a
        row must not depend on the other rows
    mode : (d,), of finite log posterior
    covariance : (d, d), Laplace approximation at the mode, positive definite
    seed : of all random numbers; same seed, same chain, whatever the number of threads
    walkers : of every ensemble, even and >= 2 d; None: max(32, 2 d + 2)
    ensembles : independent ones, >= 2
    block : steps between two savings, and of the burn-in's rounds; None: 50, or as many as make
        about 3,600 draws of an ensemble
    max_steps : allowance of kept steps of every ensemble, rounded up to whole blocks
    target_ess : bulk and tail effective sample size demanded of every parameter
    folder : where the run is saved after every block; None: nowhere
    resume : go on from what `folder` holds (from the start when it holds nothing yet); the saved
        mode and covariance are used. `max_steps`, `target_ess` and `names` may differ
    fingerprint : of data, model and priors, one text or several by what they stand for; a saved run
        with another one is refused, naming the one that differs
    lower, upper : (d,) bounds of the parameters; inadmissible outside
    names : d parameter names, for the words of the verdict
    progress : called after every block
    tell : called with a line when saved blocks cannot be used and are sampled anew

    Raises
    ------
    InputError : an argument cannot be used, the saved run is of another posterior, or another
        process is at work in `folder`
    SimulationError : the log posterior gave NaN, or no admissible start was found

    A KeyboardInterrupt passes through; what was saved stays usable.
    """
    began = time.perf_counter()
    mode = np.asarray(mode, dtype=np.float64)
    dimension = mode.size
    if walkers is None:
        walkers = max(32, 2 * dimension + 2)
    if block is None:
        block = max(_LEAST_BLOCK, min(_BLOCK_STEPS, _BLOCK_DRAWS // max(walkers, 1)))
    _check(seed, walkers, ensembles, block, max_steps, dimension, names)
    bounds = [
        np.full(dimension, default) if bound is None else np.asarray(bound, dtype=np.float64)
        for bound, default in ((lower, -np.inf), (upper, np.inf))
    ]
    settings = {
        "format": _FORMAT,
        "fingerprint": fingerprint if isinstance(fingerprint, str) else dict(fingerprint),
        "seed": seed,
        "walkers": walkers,
        "ensembles": ensembles,
        "block": block,
        "dimension": dimension,
        "lower": [repr(float(value)) for value in bounds[0]],
        "upper": [repr(float(value)) for value in bounds[1]],
    }
    target = WhitenedDensity(log_posterior, mode, cholesky(covariance), bounds[0], bounds[1])
    with ExitStack() as held:
        files = None
        if folder is not None:
            Path(folder).mkdir(parents=True, exist_ok=True)
            held.enter_context(locked(Path(folder)))
            files = ChainFolder(folder)
        if resume and files is not None and files.started():
            run = _resumed(files, settings, target, block)
            if files.dropped and tell is not None:
                tell(files.dropped)
        else:
            run = _begun(files, settings, target, seed)
        record, cut = _until_converged(run, files, max_steps, target_ess, names, progress)
    return _chains(run, record, cut, seed, time.perf_counter() - began)


def _until_converged(
    run: Run,
    files: ChainFolder | None,
    max_steps: int,
    target_ess: float,
    names: Sequence[str] | None,
    progress: Callable[[Progress], None] | None,
) -> tuple[ConvergenceRecord, int]:
    """Runs block after block; the verdict and the stored steps to discard."""
    tau = ess = None
    while True:
        final = run.trace.steps >= max_steps
        if final or run.due():
            record, cut, tau, ess = _look(run, target_ess, names, final)
            if record is not None and (final or record.converged):
                return record, cut
        content = run.next_block()
        if files is not None:
            files.add(run.index - 1, content)
        if progress is not None:
            progress(Progress(run.burning, run.trace.steps, max_steps, tau, ess))


def _check(
    seed: int,
    walkers: int,
    ensembles: int,
    block: int,
    max_steps: int,
    dimension: int,
    names: Sequence[str] | None,
) -> None:
    demands = (
        ("seed", seed, seed >= 0, "an integer >= 0"),
        (
            "walkers",
            walkers,
            walkers % 2 == 0 and walkers >= max(4, 2 * dimension),
            f"an even number >= {max(4, 2 * dimension)} for {dimension} parameters",
        ),
        ("ensembles", ensembles, ensembles >= 2, "at least 2 independent ensembles"),
        ("block", block, block >= _LEAST_BLOCK, f"at least {_LEAST_BLOCK} steps"),
        ("max_steps", max_steps, max_steps >= 1, "at least 1 step"),
        ("names", names, names is None or len(names) == dimension, f"{dimension} names"),
    )
    for name, found, satisfied, accepted in demands:
        if not satisfied:
            raise InputError(name, repr(found), accepted)


def _begun(
    files: ChainFolder | None, settings: Mapping[str, Any], target: WhitenedDensity, seed: int
) -> Run:
    if not np.isfinite(target(np.zeros((1, target.mode.size)))[0]):
        raise InputError("mode", "an inadmissible point", "a point of finite log posterior")
    streams = random_streams(seed, settings["ensembles"])
    snapshots = [
        start(target, stream, settings["walkers"], wide=k > 0) for k, stream in enumerate(streams)
    ]
    if files is not None:
        files.begin(settings, {"mode": target.mode, "factor": target.factor, **pack(snapshots)})
    return Run(target, snapshots, settings["block"])


def _resumed(
    files: ChainFolder, settings: Mapping[str, Any], asked: WhitenedDensity, block: int
) -> Run:
    """The saved run, with the mode and factor that it began with: those asked for may differ in
    the last bits when they were computed with another number of threads."""
    saved = files.start(settings)
    missing = {"mode", "factor"} - saved.keys()
    if missing or saved["mode"].shape != asked.mode.shape:
        accepted = "a run of the same posterior; or start anew without resuming"
        raise InputError(str(files.folder), "a start that holds no mode of this size", accepted)
    shift = transform((asked.mode - saved["mode"])[None], invert_lower(saved["factor"]))
    if np.abs(shift).max() > 0.01:
        raise InputError(
            str(files.folder),
            f"a saved run whose mode is {np.abs(shift).max():.3g} standard deviations away",
            "a run of the same posterior; or start anew without resuming",
        )
    target = WhitenedDensity(
        asked.function, saved["mode"], saved["factor"], asked.lower, asked.upper
    )
    run = Run(target, unpack(saved), block)
    for content in files.blocks():
        try:
            run.load(content)
        except (KeyError, ValueError, IndexError, TypeError):
            files.refuse(run.index, "of another make")
            return _resumed(files, settings, asked, block)
    for snapshot in run.snapshots:
        now = target(snapshot.walkers)
        if not np.allclose(now, snapshot.log_posterior, rtol=1e-9, atol=1e-6):
            raise InputError(
                str(files.folder),
                "a saved run of another posterior: its walkers have other values now",
                "a run of the same posterior; or start anew without resuming",
            )
    return run


def _chains(run: Run, record: ConvergenceRecord, cut: int, seed: int, seconds: float) -> Chains:
    draws, values = run.trace.arrays()
    draws = draws[:, cut:]
    shape = draws.shape
    theta = run.target.theta(draws.reshape(-1, shape[-1])).reshape(shape)
    with np.errstate(invalid="ignore"):
        shares = run.tally[..., 1] / run.tally[..., 0]
    per_step = shape[0] * shape[2]
    return Chains(
        draws=theta,
        log_posterior=values[:, cut:],
        converged=record.converged,
        convergence=record,
        acceptance=run.tally[..., 1].sum(axis=1) / run.tally[..., 0].sum(axis=1),
        move_acceptance={name: shares[:, k] for k, name in enumerate(MOVE_NAMES)},
        steps=run.trace.steps,
        burn_in=run.burn_in,
        discarded=cut * run.trace.thin,
        thin=run.trace.thin,
        evaluations=per_step * (run.trace.steps + run.burn_in),
        seconds=seconds,
        seed=seed,
    )
