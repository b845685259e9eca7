"""Intervals, cut at bounds; whiteness of what a fit leaves."""

from __future__ import annotations

import importlib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID
from scipy import stats

from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.diagnosis.intervals import Intervals, intervals
from bayesimpact.diagnosis.loop import Diagnosis
from bayesimpact.diagnosis.measurement.whiteness import combined, ljung_box, whiteness_p
from bayesimpact.diagnosis.residual_force.discrepancy import discrepancy
from bayesimpact.inference.noise.whitening import Noise


def test_intervals_are_central():
    bounds = np.array([0.0, -np.inf]), np.array([np.inf, np.inf])
    found = Intervals(("a", "b"), np.array([1.0, 2.0]), np.diag([4.0, 9.0]), *bounds)
    assert stats.norm(2, 3).cdf(found.quantiles("b")) == pytest.approx([0.05, 0.5, 0.95])
    with pytest.raises(KeyError):
        found.quantiles("c")


@pytest.mark.parametrize("mean", [1.0, 0.0, -3.0, -300.0])
def test_a_bound_cuts_the_posterior_and_the_median_stays_inside(mean):
    bounds = np.array([0.0]), np.array([np.inf])
    found = Intervals(("c1",), np.array([mean]), np.array([[1.0]]), *bounds)
    low, median, high = found.quantiles("c1")
    assert 0.0 <= low <= median <= high and np.isfinite(high)
    if mean > -10:
        draws = np.random.default_rng(0).normal(mean, 1.0, 4_000_000)
        draws = draws[draws > 0]
        error = 4 / np.sqrt(draws.size)  # of a quantile, over the density there (at least 0.1)
        expected = np.percentile(draws, [5, 50, 95])
        np.testing.assert_allclose([low, median, high], expected, atol=10 * error)


def test_a_width_beyond_a_bound_leaves_the_median_at_the_mode(small):
    """What stays unexplained may be as much as a parameter itself, and more."""
    found = intervals(small.fit, remains=True)
    i = found.names.index("k1")
    wide = found.covariance.copy()
    wide[i, i] = (30.0 * small.fit.mode[i]) ** 2
    low, median, high = replace(found, covariance=wide).quantiles("k1")
    assert median == pytest.approx(small.fit.value("k1"), rel=1e-6)
    assert low == 0.0 and high == pytest.approx((1 + 30 * 1.645) * median)


def test_ljung_box_statistic_and_its_law():
    rng = np.random.default_rng(0)
    x = rng.standard_normal(500)
    centred = x - x.mean()
    full = np.correlate(centred, centred, "full")[500 - 1 :]
    rho = full[1:21] / full[0]
    q = 500 * 502 * np.sum(rho**2 / (500 - np.arange(1, 21)))
    assert ljung_box(x) == pytest.approx(stats.chi2.sf(q, 20))
    p = [ljung_box(rng.standard_normal(1500)) for _ in range(300)]
    assert stats.kstest(p, "uniform").pvalue > 1e-3
    walk = Noise(0.2).coloured(rng, 1500, 1e-3, 1.0)
    assert ljung_box(walk) < 1e-4


def with_residuals(fit, noise: Noise, seed: int):
    """The fit with fresh noise for its residuals, nothing else changed."""
    rng = np.random.default_rng(seed)
    parts = []
    for lin in fit.linearisation:
        draw = noise.coloured(rng, lin.residual.size, 1e-3, small_rig.NOISE)
        parts.append(replace(lin, residual=draw))
    return replace(fit, linearisation=tuple(parts))


def test_combined_p_value_is_fishers(small):
    p = [0.3, 0.02, 0.7]
    assert combined(p) == pytest.approx(stats.combine_pvalues(p, "fisher").pvalue)
    assert combined([0.0, 0.5]) > 0.0 or combined([0.0, 0.5]) == 0.0  # no NaN
    parts = [ljung_box(lin.residual) for lin in small.fit.linearisation]
    assert whiteness_p(small.fit) == pytest.approx(combined(parts))
    assert whiteness_p(small.fit) > 1e-3
    assert whiteness_p(with_residuals(small.fit, Noise(0.3), 0)) < 1e-6


def leaving_something() -> Diagnosis:
    """Strong friction is in the catalogue, the cubic spring beside it is not."""
    effects = {"coulomb_friction": {"force": 2e-2}, "spring_cubic": {"stiffness": 2e4}}
    campaign = small_rig.record(
        5, effects, rig=small_rig.PLAIN, releases=small_rig.PLAIN_RELEASES, duration=4.0
    )
    rng = np.random.default_rng(0)
    return diagnose(campaign, rng=rng, effects=(BY_ID["coulomb_friction"],), search=False)


@pytest.mark.slow
def test_the_force_of_time_of_the_chosen_model_is_built_once(monkeypatch) -> None:
    """Its intervals rest on the one that the search compared, which is not kept beyond that."""
    names = ("selection.ranked", "selection.remaining", "intervals", "loop")
    *modules, loop = (importlib.import_module(f"bayesimpact.diagnosis.{name}") for name in names)
    built = []

    def counted(fit: Any) -> Any:
        built.append(fit)
        return discrepancy(fit)

    for module in modules:
        monkeypatch.setattr(module, "discrepancy", counted)
    monkeypatch.setattr(loop, "with_formulas", lambda answer, *_, **__: answer)
    found = leaving_something()
    assert found.verdict == "partly" and found.after is found.selection.chosen.candidate.fit
    assert len({id(fit) for fit in built}) == len(built) > 0
    assert any(fit is found.after for fit in built)
    assert not any(fit is found.before for fit in built)  # its misfit tells enough
    assert found.selection.own is None
