"""The search where the misfit is large, on a table of made-up evidences."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from made_up_models import EFFECTS, ENOUGH, A, B, C, D, S, Table, chosen

from bayesimpact.diagnosis.budget import Budget
from bayesimpact.diagnosis.thresholds import DECISIVE


def test_where_the_misfit_is_large_what_gains_most_per_effect_comes_first(run):
    """Two damping laws gain more than the cubic spring, but less than twice as much."""
    gains = {A: 10.0, B: 10.0, f"{A} {B}": 400.0, C: 390.0, f"{A} {C}": 440.0, f"{B} {C}": 440.0}
    table = Table({**gains, f"{A} {B} {C}": ENOUGH}, chi2=100.0)
    assert chosen(run(table)) == {A, B, C}
    first_step = [{A, B}, *({e} for e in (A, B, C, D, S))]
    assert next(ids for ids in table.fitted if ids not in first_step) in ({A, C}, {B, C})


@pytest.mark.parametrize("most", [ENOUGH, 320.0])
def test_ascents_have_the_goal_to_come_near_what_they_are_compared_with(run, most):
    """A model that leaves nothing, or the one that is exchanged; effects alone have none."""
    gains = {A: 300.0, B: 20.0, f"{A} {B}": most, f"{A} {C}": 310.0, f"{B} {D}": 310.0}
    table = Table(gains, chi2=100.0)
    assert chosen(run(table)) == {A, B}
    assert table.goals[table.fitted[0]] == -np.inf
    expected = most - 2 * np.log(2 * len(EFFECTS)) - DECISIVE
    assert table.goals[frozenset({B, D})] == pytest.approx(expected)


def test_sets_that_a_free_force_leaves_far_behind_are_extended_once(run):
    """Where it alone leaves nothing, and they a large misfit; else nothing is told by it."""
    gains = {A: 10.0, B: 20.0, f"{A} {B}": 40.0, f"{A} {B} {C}": 60.0, f"{A} {B} {C} {D}": 80.0}
    asked = {"asked": (A, f"{A} {B}"), "chi2": 100.0}
    free = SimpleNamespace(reduced_chi2=1.0)
    table = Table(gains, **asked)
    found = run(table, free=free)
    assert max(len(ids) for ids in table.fitted) == 3
    assert [c.fit for c in found.residual.values()] == [free] and found.finished
    grown = Table(gains, **asked)
    assert len(run(grown).chosen.candidate.ids) == 4


@pytest.mark.parametrize("asked", [f"{A} {B}", f"{A} {C}"])
def test_a_set_of_the_catalogue_is_found_beside_a_free_force_that_does_the_same(run, asked):
    """It is asked for, or one effect away from what is."""
    gains = {A: 10.0, f"{A} {C}": 40.0, f"{A} {B}": ENOUGH}
    left = {f"{A} {B}": 1.0, f"{A} {B} {C}": 1.0}
    table = Table(gains, asked=(A, asked), chi2=100.0, left=left)
    assert chosen(run(table, free=SimpleNamespace(reduced_chi2=1.0))) == {A, B}


def test_the_free_force_is_shown_whether_the_time_is_up_or_not(run, monkeypatch):
    gains = {A: 10.0, f"{A} {B}": 40.0, f"{A} {B} {C}": 60.0}
    free, left = SimpleNamespace(reduced_chi2=1.0), iter([True] * 1)
    monkeypatch.setattr(Budget, "may_compare_on", lambda self, look: next(left, False))
    found = run(Table(gains, asked=(A, f"{A} {B}"), chi2=100.0), free=free)
    assert [c.fit for c in found.residual.values()] == [free]


def test_where_the_misfit_is_large_the_search_begins_with_what_the_equation_asks_for(run):
    gains = {A: 10.0, B: 10.0, f"{A} {B}": 400.0, C: 390.0, f"{A} {B} {C}": ENOUGH}
    table = Table(
        gains, chi2=100.0, asked=(C, f"{A} {B} {C}"), seen={A: 1.0, B: 2.0, C: 3.0, D: 0.5}
    )
    assert chosen(run(table)) == {A, B, C}
    assert table.fitted[:2] == [{C}, {A, B, C}]
    small = Table(gains, asked=(f"{A} {B} {C}",))
    run(small)
    assert small.fitted[0] != {A, B, C}


def test_beside_a_large_misfit_what_the_equation_asks_for_last_is_not_tried(run):
    gains = {A: 300.0, f"{A} {B}": ENOUGH, f"{A} {C}": 400.0, f"{A} {D}": 400.0}
    table = Table(gains, chi2=100.0, asked=(A,), seen={B: 9.0, C: 1.0}, first=1)
    assert chosen(run(table)) == {A, B}
    assert frozenset({A, C}) not in table.fitted
    assert {frozenset({A, B}), frozenset({A, D})} <= set(table.fitted)


def test_the_equation_is_asked_again_about_a_better_model(run):
    """About the base model's rest C + D look right; about that of A, it is three others."""
    gains = {A: 300.0, C: 1.0, f"{C} {D}": 2.0, f"{A} {B} {D}": ENOUGH}
    table = Table(
        gains, chi2=100.0, asked=(C, f"{C} {D}", A), asked_about={A: (A, f"{A} {B} {D}")},
        seen={C: 1.0}, first=1,
    )  # fmt: skip
    assert chosen(run(table)) == {A, B, D}
    assert table.fitted[3] == {A, B, D}


def test_an_effect_by_itself_may_begin_a_search_with_a_stop(run):
    """A step leads further with it than with what linear problems promise most of."""
    gains = {A: 300.0, B: 30.0, C: 20.0, f"{B} {C}": 40.0, f"{A} {D}": ENOUGH}
    asked = {"asked_in_flight": (B,), "asked_ahead": (C, f"{B} {C}"), "first": 1}
    table = Table(gains, chi2=100.0, alone=(C, A), seen={D: 2.0}, **asked)
    assert chosen(run(table)) == {A, D}
    assert table.fitted[0] == {A}


@pytest.mark.parametrize(
    ("before", "left", "ends"), [(35.0, 8.5, True), (33.0, 8.5, False), (100.0, 9.5, False)]
)
def test_one_effect_that_explains_most_of_a_large_misfit_ends_the_step(run, before, left, ends):
    """The others are scored anew beside it: less than a quarter is left, and no large misfit."""
    gains = {A: 300.0, C: 200.0, f"{A} {B}": ENOUGH}
    table = Table(gains, chi2=before, left={A: left})
    assert chosen(run(table)) == {A, B}
    assert table.fitted[1] == ({A, B} if ends else {C})


def test_the_search_ends_when_a_free_force_will_beat_all_names(run):
    steps = {A: 100.0, f"{A} {B}": 120.0, f"{A} {B} {C}": 140.0}
    dominated, promising = Table(steps, force=2000.0), Table(steps, force=130.0)
    run(dominated)
    run(promising)
    assert max(map(len, dominated.fitted)) == 1
    assert max(map(len, promising.fitted)) == 3


def test_the_search_ends_when_a_free_force_explains_what_is_left(run):
    """Beside A it gains 100 nats, two effects promise 20 each."""
    steps = {A: 100.0, f"{A} {B}": 120.0, f"{A} {B} {C}": 140.0}
    for beside, reached in ((200.0, 1), (170.0, 2), (150.0, 3)):
        run(table := Table(steps, beside=beside))
        assert max(map(len, table.fitted)) == reached


def test_no_profile_is_followed_where_a_free_force_wins_anyhow(run):
    table = Table({A: 100.0, B: 120.0}, force=900.0, unfinished={A: 60.0})
    assert chosen(run(table)) != {A}
    assert table.finished == []
