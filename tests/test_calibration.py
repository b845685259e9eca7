"""Bands of uniform numbers, ranks of truths, false alarms; each with a control that must fail."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks import sbc
from benchmarks.alarms import alarm, false_alarms
from benchmarks.sbc import MODELS, Replicate, replicate, verdicts
from benchmarks.uniformity import band, critical_tail, grid, smallest_tail
from scipy import stats

from bayesimpact.trial.draw.settings import Settings

pytestmark = pytest.mark.long


def test_tails_against_plain_counting() -> None:
    values = np.array([0.02, 0.03, 0.5, 0.9])
    tails = []
    for point in grid(4):
        below = int(np.sum(values <= point))
        low = sum(stats.binom.pmf(k, 4, point) for k in range(below + 1))
        high = sum(stats.binom.pmf(k, 4, point) for k in range(below, 5))
        tails.append(2 * min(low, high))
    assert smallest_tail(values) == pytest.approx(min(1.0, *tails))


@pytest.mark.parametrize("count", [20, 300])
def test_the_band_holds_with_its_level(count: int) -> None:
    """Over 2000 fresh samples the share inside is 99 % within three standard errors, twice over."""
    rng = np.random.default_rng(1)
    critical = critical_tail(count, 0.99, rng)
    inside = np.mean(smallest_tail(rng.random((2000, count))) >= critical)
    assert abs(inside - 0.99) < 6 * np.sqrt(0.99 * 0.01 / 2000)


@pytest.mark.parametrize("shape", [(0.7, 0.7), (1.5, 1.5), (1.3, 1.0)])
def test_the_band_sees_what_is_not_uniform(shape: tuple[float, float]) -> None:
    """Intervals too narrow, too wide, shifted: beta distributed ranks."""
    rng = np.random.default_rng(2)
    critical = critical_tail(300, 0.99, rng)
    assert smallest_tail(rng.beta(*shape, size=300)) < critical


def test_band_and_tail_agree() -> None:
    """Leaving the drawn band is having a smaller tail than the critical one."""
    rng = np.random.default_rng(3)
    critical = critical_tail(100, 0.9, rng)
    points, low, high = band(100, critical)
    seen = []
    for _ in range(200):
        values = rng.beta(1.2, 1.0, size=100)
        share = np.array([np.mean(values <= p) for p in points])
        seen.append(bool(np.all((share >= low) & (share <= high))))
        assert seen[-1] == bool(smallest_tail(values) >= critical)
    assert 20 < sum(seen) < 180


def ranks_of(errors: np.ndarray) -> list[Replicate]:
    return [Replicate(("a", "log_likelihood"), r, r[:1]) for r in stats.norm.cdf(errors)]


def test_verdicts_on_made_up_ranks() -> None:
    rng = np.random.default_rng(4)
    good = rng.standard_normal((300, 2))
    assert verdicts(ranks_of(good), np.random.default_rng(0))["outside"] == []
    sure = verdicts(ranks_of(good * [1.4, 1.0]), np.random.default_rng(0))
    assert sure["outside"] == ["a"]
    held = sure["parameters"]["a"]["covered_90"]
    assert held == np.mean(np.abs(1.4 * good[:, 0]) <= stats.norm.ppf(0.95))


@pytest.mark.parametrize("model", MODELS)
def test_ranks_of_a_model(model: str) -> None:
    """Truths of other seeds, never absurdly far from their posterior."""
    found = [replicate(model, seed) for seed in range(4)]
    assert found[0].names[-1] == "log_likelihood"
    assert any("." in name for name in found[0].names) == (model != "base")
    errors = np.array([r.errors for r in found])
    assert np.all((found[0].ranks > 0) & (found[0].ranks < 1))
    # 4 x 13 normal numbers: beyond 4.5 once in 3000 such tests; their mean square is 1 within 0.6
    assert np.max(np.abs(errors)) < 4.5
    assert 0.4 < np.mean(errors**2) < 1.9


def test_methods_agree() -> None:
    """Weighted draws are the posterior, emcee's too; the normal approximation nearly so. One method
    gives the same ranks every time.
    """
    whole = {m: replicate("base", 5, m).ranks for m in ("normal", "weighted", "emcee")}
    assert np.array_equal(replicate("base", 5, "weighted").ranks, whole["weighted"])
    ranks = {m: found[:-1] for m, found in whole.items()}
    # 400 draws at least: a share of them is known within 0.025
    assert np.max(np.abs(ranks["weighted"] - ranks["emcee"])) < 0.11
    assert np.max(np.abs(ranks["weighted"] - ranks["normal"])) < 0.3


def test_a_wrong_model_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Friction that the posterior does not know of: truths lie far outside."""
    monkeypatch.setitem(sbc.MODELS, "wrong", MODELS["coulomb_friction"])
    record = sbc._record

    def with_friction(model, truth, table, rng):
        return record("coulomb_friction", truth, table, rng)

    monkeypatch.setattr(sbc, "_record", with_friction)
    found = replicate("wrong", 0)
    assert np.max(np.abs(found.errors)) > 6


def test_alarms_of_controls() -> None:
    settings = Settings(kinds=("control",), rig_kinds=("small",), noises=("white",))
    rows = [alarm(settings, seed) for seed in range(2)]
    assert rows[1] == alarm(settings, 1)
    table = false_alarms(rows, np.random.default_rng(0))
    assert table["controls"] == 2 and table["alarms"]["of"] == 2
    assert table["by_noise"]["white"]["hits"] == sum(r["alarm"] for r in rows)
    loud = [{**rows[0], "scan_p": 1e-4, "alarm": True, "seed": i} for i in range(40)]
    table = false_alarms(loud, np.random.default_rng(0))
    assert not table["scan_p"]["uniform"] and len(table["alarming"]) == 40
