"""Every move leaves known distributions unchanged; wrong moves are caught by the same check.

Chains start from exact draws, so that every later ensemble is one too if the move is right. The
test statistic is averaged over steps, walkers and parameters; its standard error comes from
independent replicates.
"""

from __future__ import annotations

import emcee
import numpy as np
import pytest
from emcee.moves import DEMove, DESnookerMove, MHMove, StretchMove
from scipy import stats
from scipy.special import digamma, polygamma

from bayesimpact.inference.sampling.moves import (
    FIRST_WEIGHTS,
    MOVE_NAMES,
    SHAPES,
    CrankNicolsonMove,
    Frame,
    IndependenceMove,
    Mixture,
    log_student,
    move_set,
)
from bayesimpact.inference.sampling.whiten import cholesky, invert_lower

REPLICATES = 12
LIMIT = 4.0  # standard errors


def laplace_mixture(dimension, factor=None, centre=None):
    factor = np.eye(dimension) if factor is None else factor
    frame = Frame(np.zeros(dimension) if centre is None else centre, factor)
    return Mixture((frame,), np.array([FIRST_WEIGHTS]))


def run(log_density, start, moves, steps, seed):
    """(steps, walkers, d) of one chain that starts at `start`."""
    sampler = emcee.EnsembleSampler(*start.shape, log_density, moves=moves, vectorize=True)
    random = np.random.RandomState(seed)
    state = emcee.State(start.copy(), random_state=random.get_state())
    sampler.run_mcmc(state, steps, skip_initial_state_check=True)
    return sampler.get_chain()


def excess(statistic, log_density, draw, make_moves, *, walkers, steps, replicates=REPLICATES):
    """Mean and standard error over replicates of statistic(chain), which the truth makes zero."""
    values = []
    for k in range(replicates):
        start = draw(np.random.default_rng([7, k]), walkers)
        chain = run(log_density, start, make_moves(), steps, 100 + k)
        values.append(statistic(chain[steps // 4 :]))
    return np.mean(values, axis=0), np.std(values, axis=0, ddof=1) / np.sqrt(replicates)


def gaussian(dimension, correlated):
    """Factor, log density and sampler of a Gaussian; sizes 1e-4 to 1e4 when correlated."""
    factor = np.eye(dimension)
    if correlated:
        rng = np.random.default_rng(dimension)
        basis = np.linalg.qr(rng.standard_normal((dimension, dimension)))[0]
        correlation = basis * np.geomspace(1.0, 1e3, dimension) @ basis.T
        sizes = np.geomspace(1e-4, 1e4, dimension)
        factor = cholesky(correlation * sizes * sizes[:, None])
    inverse = invert_lower(factor)

    def log_density(x):
        return -0.5 * np.square(x @ inverse.T).sum(axis=1)

    def draw(rng, count):
        return rng.standard_normal((count, dimension)) @ factor.T

    def variance_excess(chain):
        return np.mean(np.square(chain @ inverse.T)) - 1.0

    return factor, log_density, draw, variance_excess


MOVES = {
    "independence": lambda d, factor: [(IndependenceMove(laplace_mixture(d, factor)), 1.0)],
    "crank_nicolson": lambda d, factor: [(CrankNicolsonMove(Frame(np.zeros(d), factor)), 1.0)],
    "de": lambda d, factor: [(DEMove(), 0.8), (DEMove(gamma0=1.0), 0.2)],
    "stretch": lambda d, factor: [(StretchMove(), 1.0)],
    "mixture of all": lambda d, factor: move_set(laplace_mixture(d, factor), 0.5),
}


@pytest.mark.parametrize("dimension", [7, 25, 40])
@pytest.mark.parametrize("correlated", [False, True], ids=["iid", "correlated"])
@pytest.mark.parametrize("name", MOVES)
def test_variance_ratio_is_one(name, correlated, dimension):
    factor, log_density, draw, variance_excess = gaussian(dimension, correlated)
    mean, error = excess(
        variance_excess,
        log_density,
        draw,
        lambda: MOVES[name](dimension, factor),
        walkers=max(96, 4 * dimension + 4),
        steps=60,
    )
    assert error < 0.02
    assert abs(mean) < LIMIT * error


class NoHastingsFactor(IndependenceMove):
    def _propose(self, walkers, random):
        proposed, factors = super()._propose(walkers, random)
        return proposed, np.zeros_like(factors)


class WeakCrankNicolson(CrankNicolsonMove):
    def _propose(self, walkers, random):
        proposed, factors = super()._propose(walkers, random)
        return proposed, 0.8 * factors


WRONG = {
    "no Hastings factor": lambda d: [(NoHastingsFactor(laplace_mixture(d)), 1.0)],
    "wrong reference": lambda d: [(WeakCrankNicolson(Frame(np.zeros(d), np.eye(d))), 1.0)],
    "snooker of emcee 3.1.6": lambda d: [(DESnookerMove(), 0.5), (DEMove(), 0.5)],
}


@pytest.mark.parametrize("dimension", [7, 25])
@pytest.mark.parametrize("name", WRONG)
def test_the_check_catches_wrong_moves(name, dimension):
    _, log_density, draw, variance_excess = gaussian(dimension, False)
    walkers = 8 * (dimension // 2 + 1)
    mean, error = excess(
        variance_excess,
        log_density,
        draw,
        lambda: WRONG[name](dimension),
        walkers=walkers,
        steps=60,
    )
    assert abs(mean) > 2.0 * LIMIT * error


def log_gamma(shape):
    """Independent logarithms of gamma variates, in units of the Laplace sd around the mode."""

    def log_density(u):
        y = u / np.sqrt(shape)
        return shape * (y - np.expm1(y)).sum(axis=1)

    def draw(rng, size):
        return (np.log(rng.gamma(shape, size=size)) - np.log(shape)) * np.sqrt(shape)

    mean = (digamma(shape) - np.log(shape)) * np.sqrt(shape)
    variance = polygamma(1, shape) * shape
    return log_density, draw, mean, variance


def skewed_excess(make_moves, dimension):
    """Excess of mean, variance and skewness, with their standard errors, (3,) each."""
    log_density, draw, truth, variance = log_gamma(8.0)

    def moments(chain):
        centred = (chain - truth) / np.sqrt(variance)
        skewness = polygamma(2, 8.0) / polygamma(1, 8.0) ** 1.5
        return centred.mean(), np.mean(centred**2) - 1.0, np.mean(centred**3) - skewness

    def start(rng, count):
        return draw(rng, (count, dimension))

    walkers = max(64, 4 * dimension + 4)
    return excess(moments, log_density, start, make_moves, walkers=walkers, steps=60)


@pytest.mark.parametrize("dimension", [7, 25])
@pytest.mark.parametrize("name", ["independence", "crank_nicolson", "mixture of all"])
def test_skewed_posterior_where_the_proposal_is_wrong(name, dimension):
    mean, error = skewed_excess(lambda: MOVES[name](dimension, np.eye(dimension)), dimension)
    assert (error < [0.02, 0.03, 0.15]).all()
    assert (np.abs(mean) < LIMIT * error).all()


@pytest.mark.parametrize("name", ["no Hastings factor", "wrong reference"])
def test_the_skewed_check_catches_wrong_moves(name):
    mean, error = skewed_excess(lambda: WRONG[name](7), 7)
    assert (np.abs(mean) > 2.0 * LIMIT * error).any()


@pytest.mark.parametrize("name", ["independence", "crank_nicolson", "mixture of all"])
def test_banana(name):
    """x0 ~ N(0, 1), x1 given x0 ~ N((x0^2 - 1)/2, 1/4), the rest standard normal."""
    dimension = 5

    def log_density(x):
        rest = np.square(x[:, 2:]).sum(axis=1)
        return -0.5 * (x[:, 0] ** 2 + (2.0 * x[:, 1] - x[:, 0] ** 2 + 1.0) ** 2 + rest)

    def draw(rng, count):
        x = rng.standard_normal((count, dimension))
        x[:, 1] = 0.5 * (x[:, 0] ** 2 - 1.0 + x[:, 1])
        return x

    def moments(chain):  # E[x0^2 x1] = (E[x0^4] - E[x0^2])/2 = 1 and var(x1) = 1/2 + 1/4
        x0, x1 = chain[..., 0], chain[..., 1]
        return np.mean(x0**2 * x1) - 1.0, np.mean(x1**2) - 0.75

    mean, error = excess(
        moments,
        log_density,
        draw,
        lambda: MOVES[name](dimension, np.eye(dimension)),
        walkers=20,
        steps=400,
    )
    assert (error < 0.2).all()
    assert (np.abs(mean) < LIMIT * error).all()


def two_modes(dimension, distance, share):
    """Log density and draws of share N(0, I) + (1 - share) N(distance e0, I)."""

    def log_density(x):
        rest = -0.5 * np.square(x[:, 1:]).sum(axis=1)
        near = np.log(share) - 0.5 * x[:, 0] ** 2
        far = np.log1p(-share) - 0.5 * (x[:, 0] - distance) ** 2
        return rest + np.logaddexp(near, far)

    def draw(rng, count):
        x = rng.standard_normal((count, dimension))
        x[:, 0] += distance * (rng.random(count) > share)
        return x

    return log_density, draw


def test_two_modes_keep_their_shares_although_the_proposal_knows_one():
    """Walkers start in the wrong proportion: jumps between the modes must mend it."""
    dimension, distance, share = 7, 8.0, 0.3
    log_density, _ = two_modes(dimension, distance, share)
    _, wrong = two_modes(dimension, distance, 0.8)
    shares = []
    for k in range(REPLICATES):
        start = wrong(np.random.default_rng([3, k]), 32)
        moves = move_set(laplace_mixture(dimension), 0.4)
        chain = run(log_density, start, moves, 1200, k)[400:]
        shares.append(np.mean(chain[..., 0] < distance / 2.0))
    error = np.std(shares, ddof=1) / np.sqrt(REPLICATES)
    assert error < 0.03
    assert abs(np.mean(shares) - share) < LIMIT * error


def test_student_density_against_scipy():
    factor = np.tril(np.random.default_rng(1).standard_normal((3, 3))) + 2.0 * np.eye(3)
    points = np.random.default_rng(2).standard_normal((10, 3)) * 3.0
    frame = Frame(np.array([1.0, -2.0, 0.5]), factor)
    for scale, dof in (*SHAPES, (1.7, 2.5)):
        matrix = factor @ factor.T * scale**2
        if np.isinf(dof):
            truth = stats.multivariate_normal(frame.centre, matrix).logpdf(points)
        else:
            truth = stats.multivariate_t(frame.centre, matrix, df=dof).logpdf(points)
        mine = log_student(frame.distance2(points), 3, scale, dof) - frame.log_det
        np.testing.assert_allclose(mine, truth, rtol=1e-12)


def two_frames():
    rng = np.random.default_rng(4)
    factor = np.tril(rng.standard_normal((2, 2))) + 2.0 * np.eye(2)
    frames = (Frame(np.zeros(2), np.eye(2)), Frame(np.array([3.0, 1.0]), factor))
    weights = np.array([FIRST_WEIGHTS, FIRST_WEIGHTS]) * [[0.3], [0.7]]
    return Mixture(frames, weights)


def test_mixture_density_is_normalised_and_matches_its_draws():
    """Importance weights p/q of the draws average to one; wrong draws would not."""
    mixture = two_frames()
    points = mixture.draw(np.random.RandomState(0), 40_000)
    target = stats.multivariate_normal([1.0, 0.5], [[1.5, 0.4], [0.4, 1.0]])
    ratio = np.exp(target.logpdf(points) - mixture.log_density(points))
    assert abs(ratio.mean() - 1.0) < LIMIT * ratio.std() / np.sqrt(ratio.size)
    assert ratio.std() / np.sqrt(ratio.size) < 0.01
    inside = (np.abs(points) < 1.0).all(axis=1)
    grid = np.linspace(-1.0, 1.0, 201)
    cells = np.stack(np.meshgrid(grid, grid), axis=-1).reshape(-1, 2)
    values = np.exp(mixture.log_density(cells)).reshape(201, 201)
    probability = np.trapezoid(np.trapezoid(values, grid), grid)
    assert abs(inside.mean() - probability) < LIMIT * np.sqrt(probability / inside.size)


def test_weights_follow_the_points():
    mixture = two_frames()
    rng = np.random.default_rng(5)
    near = rng.standard_normal((4000, 2))
    fitted = mixture.reweighted(near, heavy=0.1)
    assert fitted.weights.sum() == pytest.approx(1.0)
    assert fitted.weights[0].sum() > 0.85
    np.testing.assert_array_less(0.0499, fitted.weights[:, -1])
    assert fitted.log_density(near).mean() > mixture.log_density(near).mean()


def test_tally_counts_every_walker_and_every_acceptance():
    _, log_density, draw, _ = gaussian(3, False)
    moves = move_set(laplace_mixture(3), 0.5)
    start = draw(np.random.default_rng(0), 10)
    sampler = emcee.EnsembleSampler(10, 3, log_density, moves=moves, vectorize=True)
    state = emcee.State(start, random_state=np.random.RandomState(1).get_state())
    sampler.run_mcmc(state, 200)
    assert [move.name for move, _ in moves] == list(MOVE_NAMES)
    assert sum(move.proposed for move, _ in moves) == 2000
    assert sum(move.accepted for move, _ in moves) == sampler.backend.accepted.sum()
    assert moves[0][0].proposed == pytest.approx(1000, abs=300)


def test_nothing_touches_the_global_random_state():
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    _, log_density, draw, _ = gaussian(3, False)
    run(log_density, draw(np.random.default_rng(0), 10), move_set(laplace_mixture(3), 0.5), 20, 0)
    np.testing.assert_array_equal(before, np.random.get_state()[1])  # noqa: NPY002


def test_moves_are_emcee_moves():
    assert issubclass(IndependenceMove, MHMove)
    assert issubclass(CrankNicolsonMove, MHMove)
