"""The search on published test functions, on a phase-locked misfit, and its own rules."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import FrozenInstanceError, fields, replace
from functools import cache

import numpy as np
import pytest
from landscapes import ackley, double_funnel, ellipsoid, rastrigin, rosenbrock, sphere

from bayesimpact.errors import InputError
from bayesimpact.inference import search
from bayesimpact.inference.search import Generation, SearchResult, metropolis_differential_evolution

Array = np.ndarray


def run(
    objective: Callable[[Array], Array], lower: float, upper: float, d: int, seed: int, **settings
) -> SearchResult:
    return metropolis_differential_evolution(
        objective,
        np.full(d, lower),
        np.full(d, upper),
        rng=np.random.default_rng(seed),
        **settings,
    )


# -- published test functions -----------------------------------------------------------------


@pytest.mark.parametrize("metropolis", [True, False], ids=["metropolis", "greedy"])
@pytest.mark.parametrize(
    ("objective", "lower", "upper", "d", "minimum"),
    [
        (rosenbrock, -5, 10, 10, 1.0),
        (rastrigin, -5.12, 5.12, 8, 0.0),
        (ackley, -30, 32, 16, 0.0),
        (ellipsoid, -5, 5, 12, 0.3),
        (sphere, -1, 3, 5, 0.0),
    ],
)
def test_every_seed_finds_the_minimum(
    objective: Callable[[Array], Array],
    lower: float,
    upper: float,
    d: int,
    minimum: float,
    metropolis: bool,
) -> None:
    for seed in range(4):
        result = run(objective, lower, upper, d, seed, metropolis=metropolis, tolerance=1e-6)
        # 40 seeds on the ellipsoid end at up to 8e-6; another machine's rounding is another seed.
        assert result.value < 1e-4
        assert np.abs(result.best - minimum).max() < 0.02
        assert result.value == pytest.approx(objective(result.best[None])[0], rel=1e-9)
        assert result.stopped == "converged"


def test_metropolis_crosses_between_funnels_where_greedy_selection_stays() -> None:
    """Measured over 40 seeds: 31 found the narrower funnel, 13 with greedy selection."""
    found = {
        metropolis: sum(
            run(double_funnel, -5, 5, 8, seed, metropolis=metropolis).value < 0.5
            for seed in range(12)
        )
        for metropolis in (True, False)
    }
    assert found[True] >= 7
    assert found[True] >= found[False] + 3


# -- a misfit like ours: a long decaying swing, side minima in k at every lost cycle ----------

TIMES = np.arange(0, 40, 0.04)
TRUTH = np.array([808.0, 0.01, -6e-3, 0.02])  # k, c, y0, v0
MASS = 0.5


def decay(theta: Array) -> Array:
    k, c, y0, v0 = (theta[:, i : i + 1] for i in range(4))
    decay = c / (2 * MASS)
    omega = np.sqrt(k / MASS - decay**2)
    phase = omega * TIMES
    return np.exp(-decay * TIMES) * (y0 * np.cos(phase) + (v0 + decay * y0) / omega * np.sin(phase))


@cache
def recorded() -> Array:
    noise = 1e-5 * np.random.default_rng(5).normal(size=len(TIMES))
    return decay(TRUTH[None])[0] + noise


def phase_locked(theta: Array) -> Array:
    """(N / 2) log of the sum of squares: the noise level profiled out, in nats."""
    return 0.5 * len(TIMES) * np.log(np.sum((decay(theta) - recorded()) ** 2, axis=1))


def test_the_misfit_has_many_side_minima() -> None:
    theta = np.tile(TRUTH, (3000, 1))
    theta[:, 0] = np.linspace(200, 3000, 3000)
    f = phase_locked(theta)
    assert np.sum((f[1:-1] < f[:-2]) & (f[1:-1] < f[2:])) > 200


@pytest.mark.parametrize("metropolis", [True, False], ids=["metropolis", "greedy"])
def test_a_phase_locked_misfit_is_solved(metropolis: bool) -> None:
    lower, upper = np.array([200, 0, -0.02, -0.5]), np.array([3000, 1, 0.02, 0.5])
    for seed in range(4):
        result = metropolis_differential_evolution(
            phase_locked,
            lower,
            upper,
            rng=np.random.default_rng(seed),
            evaluations=6000,
            metropolis=metropolis,
        )
        # The optimum lies d / 2 nats below the truth on average.
        assert result.value < phase_locked(TRUTH[None])[0]
        assert result.best[0] == pytest.approx(TRUTH[0], rel=1e-4)
        assert result.stopped == "converged"


# -- adaptation -------------------------------------------------------------------------------


def late_rate(result: SearchResult) -> float:
    """Mean CR in the last third of the generations."""
    return float(result.history.mean_cr[-result.generations // 3 :].mean())


def test_the_crossover_rate_adapts_to_the_objective() -> None:
    """Separable ripples want single components (low CR), a rotated valley whole vectors."""
    settings = {"tolerance": 1e-8}
    separable = [late_rate(run(rastrigin, -5.12, 5.12, 8, s, **settings)) for s in range(4)]
    rotated = [late_rate(run(ellipsoid, -5, 5, 8, s, **settings)) for s in range(2)]
    assert np.mean(separable) < 0.6
    assert min(rotated) > 0.85


def test_without_learning_the_profile_takes_longer(monkeypatch: pytest.MonkeyPatch) -> None:
    settings = {"tolerance": 1e-8, "metropolis": False}
    learned = run(ellipsoid, -5, 5, 12, 3, **settings)
    monkeypatch.setattr("bayesimpact.inference.evolution.learn", lambda memory, *success: memory)
    forgetful = run(ellipsoid, -5, 5, 12, 3, **settings)
    assert forgetful.history.mean_f.std() < 0.1
    assert forgetful.value > 1e3 * learned.value


# -- cooling ----------------------------------------------------------------------------------


def test_temperature_falls_from_the_first_standard_deviation_to_the_coldest() -> None:
    budget, d = 12_000, 6
    first: list[Array] = []

    def objective(x: Array) -> Array:
        f = 300 * rastrigin(x)
        first.append(f)
        return f

    result = run(objective, -5.12, 5.12, d, 2, evaluations=budget, coldest=0.5, tolerance=0.0)
    history = result.history
    # The evaluations at the beginning of every generation; the temperature belongs to them.
    before = np.concatenate([[len(first[0])], history.evaluations[:-1]]) / budget
    scheduled = np.std(first[0]) * (0.5 / np.std(first[0])) ** (before / 0.7)
    scheduled[before >= 0.7] = 0.0
    spread = np.concatenate([[np.inf], history.spread[:-1]])
    np.testing.assert_allclose(history.temperature, np.minimum(scheduled, spread), rtol=1e-9)
    assert (history.temperature[before < 0.7] == scheduled[before < 0.7]).sum() > 10
    assert (history.uphill[history.temperature == 0] == 0).all()
    assert history.uphill[before < 0.1].mean() > 0.1


def test_greedy_selection_never_ascent() -> None:
    history = run(rastrigin, -5.12, 5.12, 5, 1, metropolis=False).history
    assert (history.temperature == 0).all()
    assert (history.uphill == 0).all()


def test_without_cooling_nothing_converges(monkeypatch: pytest.MonkeyPatch) -> None:
    cooled = run(rastrigin, -5.12, 5.12, 6, 4, evaluations=9000)
    monkeypatch.setattr(search, "_cooled", lambda progress, hottest, coldest: hottest)
    hot = run(rastrigin, -5.12, 5.12, 6, 4, evaluations=9000)
    assert cooled.stopped == "converged"
    assert hot.stopped == "budget"
    assert hot.history.spread[-1] > 10 * cooled.history.spread[-1]


def test_a_lower_standard_deviation_than_the_coldest_temperature_is_no_trouble() -> None:
    result = run(lambda x: 1e-6 * sphere(x), -1, 1, 4, 0, tolerance=1e-12)
    assert result.history.temperature.max() <= 1e-6
    assert result.stopped == "converged"


# -- inadmissible points, bounds, stops --------------------------------------------------------


def test_inadmissible_points_are_avoided_whether_inf_or_nan() -> None:
    def objective(x: Array, mark: float) -> Array:
        f = sphere(x - 0.4)
        return np.where((x[:, 0] < 0.5) | (x.sum(axis=1) > 3.0), mark, f)

    with_inf = run(lambda x: objective(x, np.inf), -2, 2, 4, 7, tolerance=1e-9)
    with_nan = run(lambda x: objective(x, np.nan), -2, 2, 4, 7, tolerance=1e-9)
    assert with_inf.value == pytest.approx(0.01, abs=1e-5)  # on the edge of what is admissible
    assert with_inf.best[0] >= 0.5
    np.testing.assert_array_equal(with_inf.best, with_nan.best)
    assert not np.isnan(with_nan.values).any()
    assert np.isinf(with_nan.history.spread[0])
    assert 0 < with_nan.history.temperature[0] < 100  # of the admissible ones


def test_a_needle_of_admissible_points_is_found_and_nothing_is_said_when_there_is_none() -> None:
    def needle(x: Array) -> Array:
        return np.where(sphere(x - 0.5) < 0.09, sphere(x - 0.45), np.inf)

    assert run(needle, -1, 1, 3, 0, tolerance=1e-6).value < 1e-5
    nothing = run(lambda x: np.full(len(x), np.nan), -1, 1, 3, 0, evaluations=500)
    assert nothing.value == np.inf
    assert nothing.stopped == "budget"


def test_penalties_of_any_size_are_survived() -> None:
    with np.errstate(over="raise", invalid="raise", divide="raise"):
        result = run(lambda x: np.where(x[:, 0] > 0, 1e300, sphere(x)), -2, 2, 3, 0, tolerance=1e-6)
    assert result.value < 1e-5
    assert 1e290 < result.history.temperature[0] < 1e300


def test_a_minimum_on_the_bounds_is_reached_and_bounds_are_kept() -> None:
    lower, upper = np.array([0.0, -3e-3, 100.0]), np.array([5.0, 1e-3, 900.0])
    seen: list[Array] = []

    def objective(x: Array) -> Array:
        seen.append(x.copy())
        return ((x - [0.0, 1e-3, 500.0]) / (upper - lower)) @ np.array([1.0, -1.0, 0.0]) + (
            x[:, 2] - 500.0
        ) ** 2

    result = metropolis_differential_evolution(
        objective, lower, upper, rng=np.random.default_rng(1), tolerance=1e-9
    )
    every = np.concatenate(seen)
    assert (every >= lower).all()
    assert (every <= upper).all()
    np.testing.assert_allclose(result.best, [0.0, 1e-3, 500.0], rtol=1e-3, atol=1e-6)
    at_edge = (every == lower) | (every == upper)
    assert at_edge.mean() < 0.01  # approached, never piled up


def test_budget_is_kept_and_evaluations_are_counted() -> None:
    calls: list[int] = []

    def objective(x: Array) -> Array:
        calls.append(len(x))
        return rosenbrock(x)

    result = run(objective, -5, 10, 5, 0, evaluations=1234, tolerance=0.0)
    assert result.stopped == "budget"
    assert 1234 - 45 < result.evaluations == sum(calls) <= 1234
    assert result.generations == len(calls) - 1 == len(result.history.best)
    assert calls[0] == 24
    assert sorted(calls, reverse=True) == calls
    assert len(result.population) == search.FEWEST


def test_the_stop_is_on_the_absolute_standard_deviation() -> None:
    def shifted(x: Array) -> Array:
        return sphere(x) - 31_794.0

    result = run(shifted, -3, 5, 6, 0, tolerance=0.1)
    assert result.stopped == "converged"
    assert np.std(result.values) < 0.1
    assert (result.history.spread[:-1] >= 0.1).all()
    assert result.value + 31_794.0 < 0.1  # a stop relative to |f| would be content with hundreds
    flat = run(lambda x: np.full(len(x), 4.0), 0, 1, 3, 0)
    assert (flat.stopped, flat.generations, flat.value) == ("converged", 0, 4.0)


def test_the_best_value_is_never_lost() -> None:
    lowest: list[float] = []

    def objective(x: Array) -> Array:
        f = 50 * rastrigin(x)
        lowest.append(float(f.min()))
        return f

    result = run(objective, -5.12, 5.12, 6, 8, evaluations=6000)
    np.testing.assert_array_equal(result.history.best, np.minimum.accumulate(lowest)[1:])
    assert result.value == min(lowest)
    assert result.history.uphill.max() > 0.3  # although much was accepted uphill


# -- reproducibility, records, arguments ------------------------------------------------------


def test_same_seed_same_search_and_no_global_state() -> None:
    np.random.seed(1)  # noqa: NPY002
    one = run(ackley, -30, 32, 6, 11, evaluations=3000)
    np.random.seed(2)  # noqa: NPY002
    two = run(ackley, -30, 32, 6, 11, evaluations=3000)
    other = run(ackley, -30, 32, 6, 12, evaluations=3000)
    np.testing.assert_array_equal(one.population, two.population)
    for field in fields(one.history):
        np.testing.assert_array_equal(
            getattr(one.history, field.name), getattr(two.history, field.name)
        )
    assert not np.array_equal(one.best, other.best)


def test_callback_and_history_say_the_same() -> None:
    told: list[Generation] = []
    result = run(rastrigin, -5.12, 5.12, 5, 0, evaluations=2000, callback=told.append)
    assert len(told) == result.generations > 20
    for field in fields(Generation):
        expected = [getattr(generation, field.name) for generation in told]
        np.testing.assert_array_equal(getattr(result.history, field.name), expected)
    last = told[-1]
    assert last.best == result.value == result.values.min()
    assert last.median == np.median(result.values)
    assert last.evaluations == result.evaluations
    assert last.spread == pytest.approx(np.std(result.values))


def test_results_are_frozen() -> None:
    result = run(sphere, -1, 1, 3, 0, evaluations=300)
    for array in (result.best, result.population, result.values, result.history.spread):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    with pytest.raises(FrozenInstanceError):
        result.value = 0.0  # type: ignore[misc]
    assert replace(result, value=1.0).value == 1.0


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"lower": [0.0, 1.0]}, "bounds"),
        ({"lower": [], "upper": []}, "bounds"),
        ({"lower": [[0.0] * 3], "upper": [[1.0] * 3]}, "bounds"),
        ({"lower": [0.0, 1.0, 0.0]}, r"bounds\[1\]"),
        ({"upper": [1.0, 1.0, np.inf]}, r"bounds\[2\]"),
        ({"lower": [np.nan, 0.0, 0.0]}, r"bounds\[0\]"),
        ({"lower": [-1e308] * 3, "upper": [1e308] * 3}, r"bounds\[0\]"),
        ({"population": 5}, "population"),
        ({"population": 20.5}, "population"),
        ({"evaluations": 10}, "evaluations"),
        ({"evaluations": 1e4}, "evaluations"),
        ({"population": 600, "evaluations": 599}, "evaluations"),
        ({"tolerance": -1.0}, "tolerance"),
        ({"tolerance": np.nan}, "tolerance"),
        ({"coldest": 0.0}, "coldest"),
        ({"coldest": np.inf}, "coldest"),
        ({"objective": lambda x: x}, "objective"),
        ({"objective": lambda x: np.full(len(x), -np.inf)}, "objective"),
    ],
)
def test_what_cannot_be_used_is_refused(settings: dict[str, object], message: str) -> None:
    arguments = {"objective": sphere, "lower": [0.0] * 3, "upper": [1.0] * 3, **settings}
    with pytest.raises(InputError, match=message):
        metropolis_differential_evolution(**arguments, rng=np.random.default_rng(0))
