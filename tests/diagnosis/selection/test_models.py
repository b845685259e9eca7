"""A model that contains another one never ends below it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from effect_rigs import BY_ID
from made_up_models import TARGET, A, Table

from bayesimpact.diagnosis.budget import COMPARISONS, LOOKS, PATIENCE, begin
from bayesimpact.diagnosis.refits.refit import Candidate
from bayesimpact.diagnosis.selection import models
from bayesimpact.diagnosis.selection.models import Models
from bayesimpact.formula.law import FAMILY, PREFIX


def candidate(ids: str, reached: float) -> Candidate:
    fit = SimpleNamespace(
        log_likelihood=reached, log_posterior=reached, converged=True, reduced_chi2=1.0,
        density=TARGET,
    )  # fmt: skip
    return Candidate(tuple(BY_ID[i] for i in ids.split()), fit, reached)


def made_up(monkeypatch) -> Models:
    monkeypatch.setattr(models, "leaves_something", lambda fit: False)
    monkeypatch.setattr(models, "is_refuted", lambda fit: False)
    monkeypatch.setattr(models, "shakes_in_own_band", lambda fit, remains: False)
    return Models((), None, np.random.default_rng(0), lambda words: None)


@pytest.mark.parametrize(("reached", "again"), [(90.0, True), (130.0, False)])
def test_a_set_reaches_no_less_than_what_it_contains(monkeypatch, reached, again):
    begun: list[tuple[str, ...]] = []

    def grown(smaller, effects, scales):
        begun.append(smaller.ids)
        return candidate(" ".join(e.id for e in effects), 125.0)

    monkeypatch.setattr(models, "grown", grown)
    search = made_up(monkeypatch)
    search.keep(candidate("spring_cubic", 120.0))
    search.keep(candidate("coulomb_friction", 50.0))
    larger = search.keep(candidate("spring_cubic quadratic_drag", reached))
    found = search.no_worse(larger)
    assert begun == ([("spring_cubic",)] if again else [])
    assert found.fit.log_likelihood == (125.0 if again else reached)
    assert search.tried[frozenset(found.ids)] is found


def test_an_effect_is_left_out_anew_where_its_model_has_reached_more(monkeypatch):
    """What a worse end of the larger model led to says little of the smaller one."""

    goals = []

    def without(larger, effect, scales, *, enough):
        goals.append(enough.goal)
        left = " ".join(i for i in larger.ids if i != effect.id)
        return candidate(left, larger.fit.log_likelihood - 5.0)

    monkeypatch.setattr(models, "without", without)
    search = made_up(monkeypatch)
    for end, expected in ((40.0, 35.0), (40.0, 35.0), (120.0, 115.0)):
        reached = search.keep(candidate("spring_cubic quadratic_drag", end))
        assert search.drop(reached, BY_ID["quadratic_drag"]).fit.log_likelihood == expected
    assert search.refits == 2
    # one that leaves 16 times as much, of 1000 readings, puts no effect in doubt
    assert goals == [pytest.approx(e - 500.0 * np.log(16.0)) for e in (40.0, 120.0)]


def test_an_end_that_no_motion_has_is_not_looked_at(monkeypatch):
    """Its mode need not be finite, and a frequency that is no number has no place in a spectrum."""
    search = made_up(monkeypatch)

    def looked_at(fit, remains):
        assert np.isfinite(fit.log_posterior)
        return False

    monkeypatch.setattr(models, "shakes_in_own_band", looked_at)
    kept = search.keep(candidate("sensor_hum", -np.inf))
    assert kept.log_evidence == -np.inf
    assert search.keep(candidate("sensor_hum", 20.0)).log_evidence == 20.0


def test_a_model_whose_line_may_be_the_motions_own_keeps_its_evidence_apart(monkeypatch):
    search = made_up(monkeypatch)
    monkeypatch.setattr(models, "shakes_in_own_band", lambda fit, remains: True)
    kept = search.keep(candidate("sensor_hum", 20.0))
    assert (kept.log_evidence, kept.refused) == (-np.inf, 20.0)
    for end, reached in ((50.0, 50.0), (30.0, 50.0)):  # of two refused ends the better one stays
        assert search.keep(candidate("sensor_hum", end)).refused == reached


def test_a_search_keeps_time_for_comparisons_by_how_long_a_look_takes(monkeypatch):
    now, took = [0.0], 6.0

    def scan(fit, effects, scales, *, rng):
        now[0] += took

    monkeypatch.setattr(models, "scan", scan)
    for force in ("missing_force", "missing_drift"):
        monkeypatch.setattr(models, force, lambda fit, scales, *, rng: None)
    search = made_up(monkeypatch)
    search.budget = begin(lambda: now[0])
    search.examine(candidate("", 0.0))
    now[0] = PATIENCE - COMPARISONS - 1.0
    assert search.budget.may_search_on() and not search.may_go_on()
    now[0] = PATIENCE - LOOKS * took - 1.0
    assert search.may_go_on()


@pytest.mark.parametrize(
    "ids, white, goes_on",
    [
        ("", True, False),
        ("spring_cubic", False, False),
        ("spring_cubic formula", True, False),  # formulas are compared with it
        ("spring_cubic", True, True),
    ],
)
def test_what_leaves_nothing_is_compared_with_no_force(monkeypatch, ids, white, goes_on):
    """And needs no time for that."""
    search, now = made_up(monkeypatch), [0.0]
    search.budget = begin(lambda: now[0])
    now[0] = PATIENCE - 1.0
    formula = SimpleNamespace(id=PREFIX, family=FAMILY)
    effects = tuple(BY_ID.get(i, formula) for i in ids.split())
    examined = SimpleNamespace(candidate=SimpleNamespace(effects=effects), is_white=white)
    search.examined_models = {frozenset(ids.split()): examined}
    assert search.may_go_on() is goes_on


def test_a_set_that_is_asked_for_must_reach_what_it_contains(monkeypatch):
    """Its ascent is told to: one that began elsewhere and will end lower is of no use."""
    goals = []

    def fit_from(fit, effects, values, scales, *, goal):
        goals.append((tuple(e.id for e in effects), goal))
        return candidate(" ".join(e.id for e in effects), 200.0)

    monkeypatch.setattr(models, "fit_from", fit_from)
    search = made_up(monkeypatch)
    search.keep(candidate("", 40.0))
    search.keep(candidate("spring_cubic", 120.0))
    larger = ["coulomb_friction", "coulomb_friction quadratic_drag", "spring_cubic quadratic_drag"]
    sets = [
        SimpleNamespace(effects=tuple(BY_ID[i] for i in ids.split()), values={}) for ids in larger
    ]
    for one in sets:
        search.fit_sets(None, [one])
    assert [goal for _, goal in goals] == [40.0, 200.0, 120.0]


@pytest.mark.parametrize(("second", "kept"), [(-0.04, True), (-0.06, False), (0.04, True)])
def test_of_two_equal_ends_the_one_that_came_to_rest_is_kept(monkeypatch, second, kept):
    """Climbs to one mode differ by less than 0.05 nats."""
    search, table = made_up(monkeypatch), Table({A: 100.0}, unfinished={A: 0.0})
    first = search.keep(table.candidate((A,), 100.0))
    table.unfinished.clear()
    rested = table.candidate((A,), 100.0 + second)
    assert (search.keep(rested) is rested) == kept
    assert search.keep(first) is (rested if kept else first)
