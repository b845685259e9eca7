"""Odds of sums of terms: enumeration against one fit after another, and the right one first."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy import stats

from bayesimpact.formula.classes import formula_classes, term_classes
from bayesimpact.formula.evidence import KEPT, Problem, Subset, single_log_odds, subsets
from bayesimpact.formula.grammar import ONE, Power, Term

SAMPLES, TERMS = 400, 9


def problem(seed: int, sizes: dict[int, float], *, power: np.ndarray | None = None) -> Problem:
    """A linear problem with known sizes, noise = 1."""
    rng = np.random.default_rng(seed)
    columns = rng.standard_normal((SAMPLES, TERMS)) * np.geomspace(0.5, 2.0, TERMS)
    columns[:, 1] = columns[:, 0] + 0.3 * columns[:, 1]
    data = rng.standard_normal(SAMPLES) + sum(a * columns[:, i] for i, a in sizes.items())
    return Problem(
        columns.T @ data, columns.T @ columns, float(data @ data), float(SAMPLES),
        np.full(TERMS, 0.5), np.linspace(3.0, 9.0, TERMS),
        np.zeros(TERMS) if power is None else power,
    )  # fmt: skip


def by_hand(p: Problem, terms: tuple[int, ...]) -> float:
    """The docstring of `evidence`, term by term."""
    at = np.array(terms)
    information = p.information[np.ix_(at, at)]
    size = np.linalg.solve(information, p.score[at])
    left = p.left - p.score[at] @ size
    value = -0.5 * p.samples * np.log(left / p.left)
    value += np.sum(stats.cauchy.logpdf(size, scale=p.scale[at]) + 0.5 * np.log(2 * np.pi))
    value -= 0.5 * np.linalg.slogdet(information * p.samples / left)[1]
    return float(value - p.price[at].sum())


@pytest.mark.parametrize("seed", [0, 1])
def test_every_subset_has_the_odds_of_its_own_fit(seed: int) -> None:
    p = problem(seed, {0: 0.5, 4: -0.2})
    found = {s.terms: s for s in subsets(p)}
    every = [c for k in (1, 2, 3) for c in itertools.combinations(range(TERMS), k)]
    assert set(found) == set(every)
    for terms in every:
        assert found[terms].log_odds == pytest.approx(by_hand(p, terms), abs=1e-8)
        at = np.array(terms)
        size = np.linalg.solve(p.information[np.ix_(at, at)], p.score[at])
        np.testing.assert_allclose(found[terms].sizes, size, rtol=1e-8)


def test_the_true_sum_is_first_and_the_price_decides_near_nothing() -> None:
    assert subsets(problem(3, {2: 0.6, 5: -0.4, 7: 0.3}))[0].terms == (2, 5, 7)
    assert subsets(problem(4, {6: 0.5}))[0].terms == (6,)
    assert subsets(problem(5, {}))[0].log_odds < 0.0


def test_no_better_subset_is_skipped_where_not_all_are_kept(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    p = problem(6, {2: 0.4, 5: -0.4, 7: 0.3})
    every = subsets(p)
    assert len(every[0].terms) == 3
    monkeypatch.setattr("bayesimpact.formula.evidence.KEPT", 10)
    assert KEPT > 10
    assert [s.terms for s in subsets(p)] == [s.terms for s in every[:10]]


def test_damping_that_would_feed_energy_is_not_admitted() -> None:
    p = problem(7, {3: -0.6}, power=np.ones(TERMS))
    assert single_log_odds(p)[3] == -np.inf
    assert all(sum(s.sizes) >= 0.0 for s in subsets(p))
    assert single_log_odds(problem(7, {3: -0.6}))[3] > 0.0


def test_near_equal_terms_are_one_class_named_by_the_simplest() -> None:
    rng = np.random.default_rng(8)
    columns = rng.standard_normal((SAMPLES, 4))
    columns[:, 2] = columns[:, 0] + 0.1 * columns[:, 2]  # cosine 0.995
    columns[:, 3] = columns[:, 0] + 0.5 * columns[:, 3]  # cosine 0.9
    found = term_classes(columns.T @ columns, np.array([5.0, 3.0, 4.0, 2.0]))
    assert found.tolist() == [2, 1, 2, 3]


def test_formulas_are_merged_by_class_and_by_kind() -> None:
    bump, cubic = Power(1.0, True), Power(3.0, True)
    terms = [
        Term("everywhere", cubic),
        Term("bump", bump, ONE, -1, 2e-3, 5e-4),
        Term("bump", bump, ONE, -1, 3e-3, 5e-4),
        Term("everywhere", Power(5.0, True)),
    ]
    ranked = [Subset((i,), (1.0,), 10.0 - i) for i in range(4)]
    found = formula_classes(ranked, terms, np.array([0, 1, 2, 0]))
    assert [c.best.terms for c in found] == [(0,), (1,)]
    assert [[s.terms for s in c.alike] for c in found] == [[(3,)], [(2,)]]
    assert found[0].log_odds == pytest.approx(np.logaddexp(10.0, 7.0))
