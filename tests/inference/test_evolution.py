"""Every operator of the differential evolution against its definition."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from bayesimpact.errors import InputError
from bayesimpact.inference.evolution import (
    ARCHIVE,
    LEADERS,
    MEMORY,
    Box,
    Memory,
    SearchState,
    accept,
    cross,
    draw_factors,
    evaluate,
    learn,
    mutate,
    shrink,
)

UNIT = Box(np.zeros(3), np.ones(3))


def memory(f: float = 0.5, cr: float = 0.5) -> Memory:
    return Memory(np.full(MEMORY, f), np.full(MEMORY, cr))


# -- bounds -----------------------------------------------------------------------------------


def test_reflection_keeps_what_is_inside_and_mirrors_the_rest() -> None:
    box = Box(np.array([-1.0, 100.0]), np.array([1.0, 104.0]))
    inside = np.array([[-1.0, 104.0], [0.1, 101.7], [1.0, 100.0]])
    np.testing.assert_array_equal(box.reflect(inside), inside)
    outside = np.array([[1.25, 99.0], [-1.5, 105.5], [5.5, 114.0]])  # the last: more than once
    np.testing.assert_allclose(box.reflect(outside), [[0.75, 101.0], [-0.5, 102.5], [0.5, 102.0]])


def test_a_walk_with_folding_stays_uniform_to_the_edges() -> None:
    rng = np.random.default_rng(1)
    x = rng.random((4000, 3))
    for _ in range(60):
        x = UNIT.reflect(x + 0.3 * rng.normal(size=x.shape))
    assert ((x >= 0) & (x <= 1)).all()
    share = np.histogram(x, bins=np.linspace(0, 1, 41))[0] / x.size
    assert np.abs(share * 40 - 1).max() < 5 * np.sqrt(40 / x.size)  # clipping puts 8 x at an edge


def test_latin_hypercube_has_one_point_in_every_slice() -> None:
    box = Box(np.array([-2.0, 1e3]), np.array([2.0, 1.5e3]))
    x = box.latin_hypercube(50, np.random.default_rng(2))
    slices = np.floor((x - box.lower) / (box.upper - box.lower) * 50).astype(int)
    for axis in range(2):
        assert sorted(slices[:, axis]) == list(range(50))
    assert np.abs(np.corrcoef(slices.T)[0, 1]) < 5 / np.sqrt(50)  # axes shuffled apart


# -- factors ----------------------------------------------------------------------------------


@pytest.mark.parametrize("location", [0.05, 0.5, 0.9])
def test_factors_follow_cauchy_and_normal(location: float) -> None:
    n = 20_000
    factor, rate = draw_factors(memory(location, location), n, np.random.default_rng(3))
    cauchy, normal = stats.cauchy(location, 0.1), stats.norm(location, 0.1)
    above_zero = cauchy.sf(0)
    for t in (0.02, 0.2, 0.5, 0.8, 0.99):
        expected = (cauchy.cdf(t) - cauchy.cdf(0)) / above_zero
        assert np.mean(factor <= t) == pytest.approx(expected, abs=4.5 * 0.5 / np.sqrt(n))
        assert np.mean(rate <= t) == pytest.approx(normal.cdf(t), abs=4.5 * 0.5 / np.sqrt(n))
    assert factor.min() > 0
    assert factor.max() == 1
    assert rate.min() >= 0
    assert rate.max() <= 1


def test_factors_come_from_all_slots_in_pairs() -> None:
    f = np.linspace(0.1, 0.9, MEMORY)
    factor, rate = draw_factors(Memory(f, f), 20_000, np.random.default_rng(4))
    middle = (factor > 0.05) & (factor < 0.95)
    assert np.corrcoef(factor[middle], rate[middle])[0, 1] > 0.5
    assert len(np.unique(np.round(rate, 1))) == 11


def test_a_terminal_rate_gives_zero() -> None:
    _, rate = draw_factors(memory(cr=np.nan), 100, np.random.default_rng(5))
    np.testing.assert_array_equal(rate, 0.0)


# -- mutation ---------------------------------------------------------------------------------


def coefficients(n: int, a: int, pull: float, repeats: int) -> tuple[np.ndarray, np.ndarray]:
    """Weights (repeats, n, n + a) of all points in the mutants of unit vectors."""
    every = np.eye(n + a)
    f = np.arange(n)[::-1].astype(float)  # the last individuals are the best
    factor = np.linspace(0.2, 0.9, n)
    rng = np.random.default_rng(6)
    drawn = [mutate(every[:n], f, every[n:], factor, pull, rng) for _ in range(repeats)]
    return np.array(drawn), factor


def test_mutation_is_current_to_pbest_with_archive() -> None:
    n, a = 40, 15
    weights, factor = coefficients(n, a, 1.0, 300)
    own = np.arange(n)
    rest = weights.copy()
    rest[:, own, own] -= 1 - factor
    rest /= factor[:, None]  # now +1 at pbest, +1 at r1, -1 at r2 (which may coincide)
    np.testing.assert_allclose(rest.sum(axis=2), 1.0, atol=1e-12)
    counts = np.round(rest).astype(int)
    np.testing.assert_allclose(rest, counts, atol=1e-9)
    minus = counts == -1
    assert minus[:, :, n:].any(axis=(0, 1)).all()  # r2 comes from the archive too
    assert (counts[:, :, n:] <= 0).all()  # and nothing else does
    leaders = max(2, round(LEADERS * n))
    best = np.zeros(n + a, dtype=bool)
    best[n - leaders : n] = True
    assert (counts[:, :, best].sum(axis=2) >= 0).all()
    doubles = counts == 2  # pbest equal to r1
    assert best[np.nonzero(doubles)[2]].all()


def test_partners_are_uniform_and_never_the_individual_itself() -> None:
    n, a, repeats = 12, 5, 4000
    weights, factor = coefficients(n, a, 0.0, repeats)  # without the pull: x + F (r1 - r2)
    own = np.arange(n)
    weights[:, own, own] -= 1
    steps = weights / factor[:, None]
    np.testing.assert_allclose(np.abs(steps).sum(axis=2), 2.0, atol=1e-9)  # r1 is never r2
    first, second = steps > 0.5, steps < -0.5
    assert not first[:, own, own].any()
    assert not second[:, own, own].any()
    assert not first[:, :, n:].any()
    for chosen, chance in ((first[:, :, :n], 1 / (n - 1)), (second, 1 / (n + a - 1))):
        share = chosen.mean(axis=0)
        off = ~np.eye(n, share.shape[1], dtype=bool)
        np.testing.assert_allclose(
            share[off], chance, atol=4.5 * np.sqrt(chance / repeats), err_msg="not uniform"
        )


def test_crossover_takes_the_rate_and_at_least_one_component() -> None:
    n, d = 6000, 5
    rate = np.repeat([0.0, 0.4, 1.0], n // 3)
    x, mutant = np.zeros((n, d)), np.ones((n, d))
    taken = cross(x, mutant, rate, np.random.default_rng(7)).reshape(3, n // 3, d)
    np.testing.assert_array_equal(taken[0].sum(axis=1), 1)
    np.testing.assert_array_equal(taken[2].sum(axis=1), d)
    # One component for certain, the other d - 1 with the rate; every component alike.
    share = taken[1].mean(axis=0)
    np.testing.assert_allclose(share, (1 + (d - 1) * 0.4) / d, atol=4.5 * 0.5 / np.sqrt(n / 3))
    np.testing.assert_allclose(taken[0].mean(axis=0), 1 / d, atol=4.5 * 0.4 / np.sqrt(n / 3))


# -- selection --------------------------------------------------------------------------------


@pytest.mark.parametrize("temperature", [0.5, 3.0])
def test_a_rise_is_accepted_with_the_metropolis_probability(temperature: float) -> None:
    n, rise = 40_000, 1.5
    f = np.full(n, 7.0)
    accepted = accept(f, f + rise, temperature, np.random.default_rng(8))
    chance = np.exp(-rise / temperature)
    assert np.mean(accepted) == pytest.approx(chance, abs=4.5 * 0.5 / np.sqrt(n))


def test_selection_is_greedy_downhill_and_at_temperature_zero() -> None:
    f = np.array([3.0, 3.0, 3.0, np.inf, np.inf, 1.0])
    f_trial = np.array([2.0, 3.0, 3.1, 5.0, np.inf, 1.0])
    for _ in range(20):
        accepted = accept(f, f_trial, 0.0, np.random.default_rng(9))
        assert accepted.tolist() == [True, True, False, True, True, True]


def test_the_incumbent_yields_to_nothing_worse_and_nobody_to_the_inadmissible() -> None:
    f = np.array([3.0, 1.0, 3.0])
    for seed in range(50):
        rng = np.random.default_rng(seed)
        assert accept(f, f + 1e-9, 1e9, rng).tolist() == [True, False, True]
        assert accept(f, np.full(3, np.inf), 1e300, rng).tolist() == [False] * 3


# -- learning ---------------------------------------------------------------------------------


def test_memory_takes_lehmer_means_weighted_by_the_gain() -> None:
    factor, rate, gain = np.array([0.2, 0.8]), np.array([0.1, 0.9]), np.array([1.0, 3.0])
    after = learn(memory(), factor, rate, gain)
    assert after.f[0] == pytest.approx((0.04 + 3 * 0.64) / (0.2 + 3 * 0.8))
    assert after.cr[0] == pytest.approx((0.01 + 3 * 0.81) / (0.1 + 3 * 0.9))
    np.testing.assert_array_equal(after.f[1:], 0.5)
    assert after.slot == 1


def test_memory_slots_are_written_in_turn_and_only_after_success() -> None:
    one = np.array([0.7])
    state = memory()
    assert learn(state, one[:0], one[:0], one[:0]) is state
    for _ in range(MEMORY + 1):
        state = learn(state, one, one, one)
    assert state.slot == 1
    np.testing.assert_allclose(state.f, 0.7)


def test_infinite_gains_count_like_the_largest_finite_one() -> None:
    factor = np.array([0.2, 0.8])
    mixed = learn(memory(), factor, factor, np.array([np.inf, 2.0]))
    equal = learn(memory(), factor, factor, np.array([2.0, 2.0]))
    assert mixed.f[0] == equal.f[0]
    assert np.isfinite(learn(memory(), factor, factor, np.array([np.inf, np.inf])).f).all()


def test_a_slot_whose_rates_were_all_zero_stays_terminal() -> None:
    none, some = np.zeros(2), np.full(2, 0.5)
    ended = learn(memory(), some, none, np.ones(2))
    assert np.isnan(ended.cr[0])
    for _ in range(MEMORY):
        ended = learn(ended, some, some, np.ones(2))
    assert np.isnan(ended.cr).tolist() == [True] + [False] * (MEMORY - 1)


def test_shrinking_keeps_the_best_and_thins_the_archive() -> None:
    x = np.arange(10.0)[:, None]
    state = SearchState(x, np.array([5, 0, 3, 9, 8, 1, 7, 2, 6, 4.0]), np.zeros((40, 1)), memory())
    after = shrink(state, 4, np.random.default_rng(10))
    assert sorted(after.f) == [0, 1, 2, 3]
    np.testing.assert_array_equal(np.sort(after.x[:, 0]), [1, 2, 5, 7])
    assert len(after.archive) == round(ARCHIVE * 4)
    same = shrink(state, 10, np.random.default_rng(10))
    np.testing.assert_array_equal(same.x, x)


# -- objective --------------------------------------------------------------------------------


def test_objective_may_mark_points_and_spoil_its_argument() -> None:
    def objective(x: np.ndarray) -> np.ndarray:
        values = np.where(x[:, 0] < 0.3, np.nan, np.where(x[:, 0] > 0.6, np.inf, x[:, 0]))
        x[:] = -7
        return values

    x = np.array([[0.1], [0.5], [0.9]])
    assert evaluate(objective, x).tolist() == [np.inf, 0.5, np.inf]
    np.testing.assert_array_equal(x, [[0.1], [0.5], [0.9]])


def test_wrong_answers_of_the_objective_are_refused() -> None:
    x = np.zeros((4, 3))
    for bad in (lambda x: 0.0, lambda x: x, lambda x: np.zeros(3)):
        with pytest.raises(InputError, match="shape"):
            evaluate(bad, x)
    with pytest.raises(InputError, match="-inf"):
        evaluate(lambda x: np.array([0.0, -np.inf, 1.0, 2.0]), x)
