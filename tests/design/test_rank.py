"""How designs are weighed and ranked."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rivals import base_rivalry, fitted, rivalry_of
from scipy.stats import norm

from bayesimpact.design.hypotheses import Rivalry
from bayesimpact.design.odds import Odds
from bayesimpact.design.rank import box_hill, decisive, proposals
from bayesimpact.diagnosis.thresholds import DECISIVE
from bayesimpact.inference.identify import Identification


@pytest.fixture(scope="module")
def damped(small: Identification) -> Rivalry:
    return rivalry_of(fitted(small, "coulomb_friction", "quadratic_drag"))


def test_pairs_count_by_the_product_of_their_probabilities() -> None:
    odds = np.array([[0.0, 2.0, 5.0], [4.0, 0.0, 7.0], [1.0, 3.0, 0.0]])
    p = np.array([0.5, 0.3, 0.2])
    pairs = [(p[i] * p[j], odds[i, j]) for i in range(3) for j in range(3) if i != j]
    assert box_hill(p, odds) == pytest.approx(
        sum(w * x for w, x in pairs) / sum(w for w, _ in pairs)
    )


def test_the_nearest_rival_decides_whether_it_settles(damped: Rivalry) -> None:
    first, second = damped.hypotheses
    three = replace(damped, hypotheses=(replace(first, log_odds=2.0), second, second))
    pairs = {
        (i, j): Odds(9.0, np.array([9.0, 3.0 + j]), np.array([2.0, 2.0]))
        for i in range(3)
        for j in range(3)
        if i != j
    }
    now, p = [2.0, 0.0, 0.0], np.exp([2.0, 0.0, 0.0])
    expected = 0.0
    for i in range(3):
        for x in (9.0, 3.0):  # over the draws; of these the second depends on the rival
            leads = [now[i] - now[j] + x + j * (x < 9.0) for j in range(3) if j != i]
            expected += 0.5 * p[i] / p.sum() * norm.cdf((min(leads) - DECISIVE) / 2)
    assert decisive(three, pairs) == pytest.approx(expected)


def test_odds_beyond_the_decisive_ones_count_as_these(damped: Rivalry) -> None:
    first, second = damped.hypotheses
    far = replace(damped, hypotheses=(replace(first, log_odds=300.0), second))
    assert far.probabilities[1] == pytest.approx(1 / (1 + np.exp(DECISIVE)))


def test_designs_are_ranked_and_the_same_for_the_same_seed(damped: Rivalry) -> None:
    found = proposals(damped, rng=np.random.default_rng(1))
    joining = [p for p in found if p.design.joins]
    assert list(found[: len(joining)]) == joining
    steps = [round(p.chance / 0.02) for p in joining]
    assert steps == sorted(steps, reverse=True) and joining[0].chance > joining[-1].chance
    assert sum(bool(p.design.repeats) for p in found) == 1
    assert all(0 <= p.narrowing < 1 for p in found)
    again = proposals(damped, rng=np.random.default_rng(1))
    assert [p.chance for p in again] == [p.chance for p in found]


def test_a_model_that_fails_leaves_no_design(small: Identification) -> None:
    rivals = base_rivalry(small)
    first = rivals.hypotheses[0]
    softer = first.mode * np.where(np.arange(first.mode.size) == first.known["k1"], -1.0, 1.0)
    for broken in (
        replace(first, mode=softer),
        replace(first, covariance=np.full_like(first.covariance, np.nan)),
    ):
        assert proposals(replace(rivals, hypotheses=(broken,)), rng=np.random.default_rng(1)) == ()


def test_where_nothing_is_open_the_stiffness_decides(small: Identification) -> None:
    found = proposals(base_rivalry(small), rng=np.random.default_rng(1))
    joining = [p.narrowing for p in found if p.design.joins]
    assert joining == sorted(joining, reverse=True) and np.isnan(found[0].log_odds)
    before, after = found[0].halves["k2[1]"]
    assert 0 < after < before
    at = small.fit.names.index("k2[1]")
    assert before == pytest.approx(1.6449 * small.fit.sd[at], rel=1e-4)
