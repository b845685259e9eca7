"""Drifts and steps that were planted are found, and none where nothing changes; populations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import integrate, stats

from bayesimpact.fleet.population import population
from bayesimpact.fleet.trend import FALSE_ALARM, Trend, find_trend

pytestmark = pytest.mark.long

NAMES = ("g", "date")
GAP, ERROR = 1.1e-3, 2e-6


@pytest.fixture(autouse=True)
def fewer_permutations(monkeypatch: pytest.MonkeyPatch) -> None:
    """The p-value of a permutation test is exact for any number of them."""
    monkeypatch.setattr("bayesimpact.fleet.trend.PERMUTATIONS", 1000)


def fleet(
    seed: int, sessions: int = 12, drift: float = 0.0, step: float = 0.0, scatter: float = 0.0
) -> Trend | None:
    """Sessions a week apart; `drift` per session, `step` in the middle, in standard errors."""
    rng = np.random.default_rng(seed)
    t = 7.0 * np.arange(sessions)
    errors = ERROR * rng.uniform(0.7, 1.4, sessions)
    shift = drift * np.arange(sessions) + step * (np.arange(sessions) >= sessions // 2)
    x = GAP + ERROR * shift + np.hypot(errors, scatter * ERROR) * rng.standard_normal(sessions)
    return find_trend(NAMES, t, x, errors, rng=rng)


def test_a_drift_of_one_standard_error_a_session_is_found() -> None:
    found = [fleet(seed, drift=1.0) for seed in range(40)]
    assert sum(f is not None and f.kind == "drift" for f in found) >= 38
    z = [(f.amount - ERROR / 7.0) / f.error for f in found if f is not None and f.kind == "drift"]
    assert np.mean(np.abs(z) < 1.645) > stats.binom.ppf(1e-3, 40, 0.9) / 40


def test_a_step_is_found_where_it_is() -> None:
    found = [fleet(seed, step=6.0) for seed in range(40)]
    assert sum(f is not None and f.kind == "step" for f in found) >= 38
    for f in found:
        if f is not None and f.kind == "step":
            assert abs(f.place[0] - 35.0) <= 7.0 and f.place[1] == f.place[0] + 7.0
            assert f.amount == pytest.approx(6.0 * ERROR, abs=5 * f.error)
    assert sum(f is not None and f.place == (35.0, 42.0) for f in found) >= 34


@pytest.mark.parametrize("scatter", [0.0, 3.0])
def test_nothing_is_invented_where_nothing_changes(scatter: float) -> None:
    """Neither where sessions scatter more than their errors say."""
    alarms = sum(fleet(seed, scatter=scatter) is not None for seed in range(200))
    assert alarms <= stats.binom.ppf(1 - 1e-3, 200, FALSE_ALARM)


def test_too_few_sessions_or_one_date_tell_nothing() -> None:
    assert fleet(0, sessions=5, drift=30.0) is None
    t, x = np.zeros(10), np.arange(10.0)
    assert find_trend(NAMES, t, x, np.full(10, 0.1), rng=np.random.default_rng(0)) is None


def test_a_condition_has_no_steps() -> None:
    rng = np.random.default_rng(0)
    t = rng.uniform(15, 30, 20)
    x = 800.0 - 0.5 * t + 0.3 * rng.standard_normal(20)
    found = find_trend(("k1", "temperature_c"), t, x, np.full(20, 0.3), rng=rng, steps=False)
    assert found is not None and found.kind == "drift"
    assert found.ci90[0] < -0.5 < found.ci90[1]


def test_the_population_against_a_grid_of_two_dimensions() -> None:
    rng = np.random.default_rng(3)
    s = rng.uniform(0.5, 2.0, 6)
    x = 10.0 + np.hypot(s, 1.0) * rng.standard_normal(6)
    found = population("k1", x, s)
    assert found is not None and found.campaigns == 6
    scale = np.std(x) + np.median(s)
    mu, tau = np.linspace(-20.0, 40.0, 1201), np.linspace(0.0, 60.0, 1201)[:, None]
    density = 1.0 / (1.0 + (tau / scale) ** 2)
    for estimate, error in zip(x, s, strict=True):
        density = density * stats.norm.pdf(estimate, mu, np.hypot(error, tau))
    mass = integrate.cumulative_trapezoid(integrate.trapezoid(density, dx=0.05, axis=0), mu)
    for level, value in zip((0.05, 0.5, 0.95), found.mean, strict=True):
        assert np.interp(value, mu[1:], mass / mass[-1]) == pytest.approx(level, abs=0.01)


def test_population_intervals_hold_the_truth() -> None:
    held = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        s = rng.uniform(0.5, 2.0, 15)
        found = population("k1", 5.0 + np.hypot(s, 1.5) * rng.standard_normal(15), s)
        assert found is not None
        held += found.mean[0] < 5.0 < found.mean[2]
    low, high = stats.binom.ppf([1e-3, 1 - 1e-3], 200, 0.9)
    assert low <= held <= high


def test_two_campaigns_are_no_population() -> None:
    assert population("k1", np.array([1.0, 2.0]), np.array([0.1, 0.1])) is None
    assert population("k1", np.ones(4), np.array([0.1, 0.1, 0.0, 0.1])) is None
