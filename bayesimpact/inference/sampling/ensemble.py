"""One ensemble of walkers: where it starts, how it advances, how its proposal adapts.

Everything here works in whitened coordinates u = L^-1 (theta - mode), L L^T the Laplace
covariance: the parameters of an impact oscillator differ by 1e9 in size. A `Snapshot` holds all
that the future of an ensemble depends on; `advance` maps a snapshot to a later one and is a pure
function of it, which is what makes resuming exact.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import emcee
import numpy as np
from numpy.typing import NDArray

from bayesimpact.errors import SimulationError
from bayesimpact.inference.sampling.moves import (
    FIRST_WEIGHTS,
    MOVE_NAMES,
    SHAPES,
    Frame,
    Mixture,
    move_set,
)
from bayesimpact.inference.sampling.whiten import cholesky, transform

Array = NDArray[np.float64]

_FIRST_SHARE = 0.6  # of independence proposals, before their acceptance is known
_START_TRIES = 200


@dataclass(frozen=True, eq=False)
class WhitenedDensity:
    """The log posterior as a function of whitened coordinates.

    Attributes
    ----------
    function : (n, d) parameters -> (n,) log posterior, -inf where inadmissible
    mode : (d,)
    factor : (d, d) lower, of the Laplace covariance
    lower, upper : (d,) bounds; outside the function is not called
    """

    function: Callable[[Array], Array]
    mode: Array
    factor: Array
    lower: Array
    upper: Array

    def theta(self, u: Array) -> Array:
        """Parameters of whitened coordinates, (n, d) -> (n, d)."""
        return self.mode + transform(u, self.factor)

    def __call__(self, u: Array) -> Array:
        """Log posterior, (n, d) -> (n,).

        Raises
        ------
        SimulationError : the function returned NaN or +inf
        """
        theta = self.theta(u)
        inside = ((theta >= self.lower) & (theta <= self.upper)).all(axis=1)
        values = np.full(len(u), -np.inf)
        if inside.any():
            values[inside] = self.function(theta[inside])
        wrong = np.isnan(values) | (values == np.inf)
        if wrong.any():
            first = int(np.argmax(wrong))
            raise SimulationError(
                f"the log posterior is {values[first]} at {theta[first].tolist()}; "
                "it must be finite, or -inf where inadmissible"
            )
        return values


@dataclass(frozen=True, eq=False)
class Snapshot:
    """All that the future of one ensemble depends on.

    Attributes
    ----------
    walkers : (W, d) whitened positions
    log_posterior : (W,)
    random : state of a `numpy.random.RandomState`, as its get_state() gives it
    mixture : independence proposal: the Laplace frame, then the one learnt in the burn-in
    share : share of independence proposals
    """

    walkers: Array
    log_posterior: Array
    random: tuple[Any, ...]
    mixture: Mixture
    share: float


@dataclass(frozen=True, eq=False)
class DrawBlock:
    """The draws between two snapshots.

    Attributes
    ----------
    draws : (steps, W, d) whitened
    log_posterior : (steps, W)
    tally : (moves, 2) walkers proposed and accepted, in the order of `MOVE_NAMES`
    """

    draws: Array
    log_posterior: Array
    tally: NDArray[np.int64]


def random_streams(seed: int, count: int) -> list[np.random.RandomState]:
    """Independent streams, one for every ensemble; the global state is not touched."""
    children = np.random.SeedSequence(seed).spawn(count)
    return [np.random.RandomState(np.random.MT19937(child)) for child in children]


def start(
    target: WhitenedDensity, random: np.random.RandomState, walkers: int, *, wide: bool
) -> Snapshot:
    """A feasible ensemble around the mode.

    Parameters
    ----------
    target : whose finite values make a walker feasible
    random : stream of this ensemble; its state goes into the snapshot
    walkers : W
    wide : Student-t with 5 degrees of freedom at 1.5 times the Laplace scale, instead of the
        Laplace Gaussian

    Raises
    ------
    SimulationError : no feasible position was found for some walker
    """
    dimension = len(target.mode)
    u = np.empty((walkers, dimension))
    values = np.full(walkers, -np.inf)
    for attempt in range(_START_TRIES):
        missing = np.isneginf(values)
        count = int(missing.sum())
        if not count:
            break
        # Nearer and nearer to the mode, should the admissible region be narrow.
        scale = (1.5 if wide else 1.0) * 0.97 ** max(0, attempt - 20)
        drawn = scale * random.standard_normal((count, dimension))
        if wide:
            drawn *= np.sqrt(5.0 / random.chisquare(5.0, size=count))[:, None]
        u[missing] = drawn
        values[missing] = target(drawn)
    if np.isneginf(values).any():
        raise SimulationError(
            f"{int(np.isneginf(values).sum())} of {walkers} walkers found no admissible start "
            f"near the mode in {_START_TRIES} tries"
        )
    frame = Frame(np.zeros(dimension), np.eye(dimension))
    weights = np.array([FIRST_WEIGHTS, np.zeros(len(SHAPES))])
    state: Any = random.get_state(legacy=True)  # the tuple that emcee keeps
    mixture = Mixture((frame, frame), weights)
    return Snapshot(u, values, state, mixture, _FIRST_SHARE)


def advance(snapshot: Snapshot, target: WhitenedDensity, steps: int) -> tuple[Snapshot, DrawBlock]:
    """Runs emcee for some steps with the snapshot's frozen moves.

    Advancing by a + b steps equals advancing by a, then by b, bit for bit.
    """
    moves = move_set(snapshot.mixture, snapshot.share)
    sampler = emcee.EnsembleSampler(*snapshot.walkers.shape, target, moves=moves, vectorize=True)
    # emcee's wrapper prints on any exception, an interrupt included; the bare function does not.
    sampler.log_prob_fn = target
    # emcee ignores an invalid random state silently; this one raises.
    np.random.RandomState(0).set_state(snapshot.random)
    # run_mcmc copies what it is given, so that the snapshot stays as it is.
    state = emcee.State(
        snapshot.walkers, log_prob=snapshot.log_posterior, random_state=snapshot.random
    )
    end = sampler.run_mcmc(state, steps, skip_initial_state_check=True)
    tally = np.array([(move.proposed, move.accepted) for move, _ in moves], dtype=np.int64)
    later = replace(
        snapshot,
        walkers=end.coords,
        log_posterior=end.log_prob,
        random=sampler.random_state,
    )
    return later, DrawBlock(sampler.get_chain(), sampler.get_log_prob(), tally)


def acceptance(tally: NDArray[np.int64]) -> float:
    """Accepted share of independent proposals; where there were none, one half of two."""
    proposed, accepted = tally[MOVE_NAMES.index("independence")]
    return float((accepted + 1.0) / (proposed + 2.0))


def adapt(snapshot: Snapshot, stretch: DrawBlock) -> Snapshot:
    """Learns the independence proposal and its share from a stretch of burn-in.

    The second frame becomes the mean and covariance of the last three quarters of the stretch,
    shrunk towards the Laplace covariance as far as draws are few; the component weights are fitted
    (EM) to walkers that were left out of that covariance. Only ever called before the kept part.
    """
    draws = stretch.draws[len(stretch.draws) // 4 :]
    walkers, dimension = snapshot.walkers.shape
    distinct = walkers + 0.75 * float(stretch.tally[:, 1].sum())
    trust = distinct / (distinct + 4.0 * dimension)

    def learn(points: Array) -> Frame:
        centre = points.mean(axis=0)
        covariance = np.einsum("ni,nj->ij", points - centre, points - centre) / len(points)
        factor = cholesky(trust * covariance + (1.0 - trust) * np.eye(dimension))
        return Frame(trust * centre, factor)

    held_out = walkers // 3
    laplace = snapshot.mixture.frames[0]
    trial = Mixture(
        (laplace, learn(draws[:, held_out:].reshape(-1, dimension))), snapshot.mixture.weights
    )
    fitted = trial.reweighted(draws[:, :held_out].reshape(-1, dimension))
    mixture = Mixture((laplace, learn(draws.reshape(-1, dimension))), fitted.weights)
    share = 0.25 + 0.6 * min(1.0, acceptance(stretch.tally) / 0.3)
    return replace(snapshot, mixture=mixture, share=share)


def pack(snapshots: list[Snapshot]) -> dict[str, NDArray[Any]]:
    """Snapshots of all ensembles as plain arrays, for a file."""
    return {
        "walkers": np.stack([s.walkers for s in snapshots]),
        "end_log_posterior": np.stack([s.log_posterior for s in snapshots]),
        "random_keys": np.stack([s.random[1] for s in snapshots]),
        "random_position": np.array([[s.random[2], s.random[3]] for s in snapshots]),
        "random_gauss": np.array([s.random[4] for s in snapshots]),
        "centres": np.stack([s.mixture.frames[1].centre for s in snapshots]),
        "factors": np.stack([s.mixture.frames[1].factor for s in snapshots]),
        "weights": np.stack([s.mixture.weights for s in snapshots]),
        "shares": np.array([s.share for s in snapshots]),
    }


def unpack(arrays: dict[str, NDArray[Any]]) -> list[Snapshot]:
    """The snapshots that `pack` wrote, bit for bit."""
    snapshots = []
    for k, walkers in enumerate(arrays["walkers"]):
        position, has_gauss = (int(value) for value in arrays["random_position"][k])
        random = (
            "MT19937",
            arrays["random_keys"][k],
            position,
            has_gauss,
            float(arrays["random_gauss"][k]),
        )
        dimension = walkers.shape[1]
        frames = (
            Frame(np.zeros(dimension), np.eye(dimension)),
            Frame(arrays["centres"][k], arrays["factors"][k]),
        )
        snapshots.append(
            Snapshot(
                walkers,
                arrays["end_log_posterior"][k],
                random,
                Mixture(frames, arrays["weights"][k]),
                float(arrays["shares"][k]),
            )
        )
    return snapshots
