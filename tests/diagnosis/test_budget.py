"""One budget for a whole diagnosis, on a made-up clock: what is searched, compared and said."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.diagnosis.budget import (
    ANOTHER,
    COMPARISONS,
    LOOKS,
    MOST_KEPT,
    PATIENCE,
    Budget,
    begin,
)
from bayesimpact.diagnosis.faults.simpler import may_be_simpler
from bayesimpact.diagnosis.loop import Diagnosis
from bayesimpact.diagnosis.refits.refit import Candidate, Enough
from bayesimpact.diagnosis.selection.outcome import Selection
from bayesimpact.diagnosis.selection.remaining import Remaining
from bayesimpact.report.diagnosis.document import document

whole = importlib.import_module("bayesimpact.diagnosis.diagnose")


@dataclass
class Clock:
    """Shows the time that it is set to."""

    now: float = 0.0

    def __call__(self) -> float:
        return self.now


@dataclass(frozen=True)
class MadeUpSelection:
    finished: bool = True


@dataclass(frozen=True)
class MadeUp:
    """As much of a diagnosis as is compared."""

    verdict: str
    selection: MadeUpSelection = MadeUpSelection()


def test_a_budget_is_used_up_by_its_clock_alone() -> None:
    clock = Clock(1000.0)
    budget = begin(clock)
    assert budget.left == PATIENCE and budget.may_go_on() and budget.may_search_again()
    clock.now += PATIENCE - ANOTHER
    assert budget.may_search_again()
    clock.now += 1.0
    assert not budget.may_search_again() and budget.may_go_on()
    clock.now += ANOTHER - 1.0
    assert budget.left == 0.0 and not budget.may_go_on()


def test_a_search_keeps_time_for_its_comparisons() -> None:
    """The longer a model takes to be scored, the more of it; at most a share of all."""
    for look, kept in ((0.0, COMPARISONS), (3.0, LOOKS * 3.0), (50.0, MOST_KEPT * PATIENCE)):
        clock = Clock()
        budget = begin(clock)
        clock.now = PATIENCE - kept - 1.0
        assert budget.may_search_on(look)
        clock.now += 1.0
        assert not budget.may_search_on(look)
        clock.now = PATIENCE + (kept if look else 0.0) - 1.0
        assert budget.may_compare_on(look) and budget.may_go_on() == (look == 0.0)
        clock.now += 1.0
        assert not budget.may_compare_on(look)


def searches(
    monkeypatch: pytest.MonkeyPatch, clock: Clock, other: MadeUp, took: float = 0.0
) -> tuple[Any, list[Budget]]:
    """Searches with a whole budget before them, each of which takes so long."""
    given: list[Budget] = []

    def searched(corrected: Any, *, budget: Budget, **others: Any) -> MadeUp:
        given.append(budget)
        clock.now += took
        return other

    monkeypatch.setattr(whole, "_of_corrected", searched)
    rng = np.random.default_rng(0)
    campaign: Any = None
    return whole.Searches(rng, (), lambda message: None, begin(clock), campaign), given


def better(answer: bool) -> Callable[[Any, Any], bool]:
    return lambda other, found: answer


@pytest.mark.parametrize(("verdict", "told"), [("named", "ambiguous"), ("partly", "partly")])
def test_a_search_for_which_too_little_is_left_is_not_begun(monkeypatch, verdict, told) -> None:
    """Nor is the campaign corrected for it; the answer says so, and names nothing for certain."""
    clock = Clock()
    asked, given = searches(monkeypatch, clock, MadeUp("named"))
    clock.now = PATIENCE - ANOTHER + 1.0
    found = asked.again(MadeUp(verdict), pytest.fail, better(True))
    assert given == [] and found == MadeUp(told, MadeUpSelection(finished=False))


def test_searches_share_one_budget(monkeypatch) -> None:
    clock = Clock()
    asked, given = searches(monkeypatch, clock, MadeUp("partly"), took=(PATIENCE - ANOTHER) / 2)
    found = asked.search(None)
    for turn in range(4):
        found = asked.again(found, lambda: None, better(False))
        assert found.selection.finished == (turn < 2)
    assert len(given) == 3 and all(one is asked.budget for one in given)


@pytest.mark.parametrize("is_better", [False, True])
@pytest.mark.parametrize("finished", [False, True])
def test_an_answer_is_final_only_where_the_other_search_came_to_its_end(
    monkeypatch, is_better, finished
) -> None:
    first, other = MadeUp("named"), MadeUp("ambiguous", MadeUpSelection(finished))
    asked, _ = searches(monkeypatch, Clock(), other)
    found = asked.again(first, lambda: None, better(is_better))
    if is_better:
        assert found is other
    else:
        assert found == (
            first if finished else MadeUp("ambiguous", MadeUpSelection(finished=False))
        )


def test_a_diagnosis_without_time_for_a_second_search_says_so(monkeypatch) -> None:
    """Physics leaves something, and another rig is doubtful; the budget begins with the first
    search, whatever was computed before.
    """
    of_corrected, clock, begun = whole._of_corrected, Clock(), []

    def slow(corrected: Any, *, budget: Budget, **others: Any) -> Diagnosis:
        begun.append((budget.begun, budget.left))
        found = replace(of_corrected(corrected, budget=budget, **others), verdict="partly")
        clock.now += PATIENCE - ANOTHER + 1.0
        return found

    def doubtful(before: Any, *others: Any) -> Any:
        clock.now += 2 * PATIENCE
        fit = before.identification.fit
        campaign = fit.density.oscillator.campaign
        fault = SimpleNamespace(id="recording_other_rig", recording="a")
        return ((SimpleNamespace(fault=fault, campaign=campaign, after=fit.reduced_chi2),),)

    monkeypatch.setattr(whole, "_of_corrected", slow)
    monkeypatch.setattr(whole, "comparisons", doubtful)
    monkeypatch.setattr(whole, "promised_gains", lambda *_, **__: np.ones(9))
    monkeypatch.setattr(whole, "with_steps", pytest.fail)
    campaign = small_rig.record(61, duration=1.5, releases=small_rig.RELEASES[:1])
    rng, effects = np.random.default_rng(0), (BY_ID["coulomb_friction"],)
    found = whole.diagnose(campaign, rng=rng, effects=effects, search=False, clock=clock)
    assert begun == [(2 * PATIENCE, PATIENCE)]
    assert found.verdict == "partly" and not found.selection.finished
    content = document(found, seed=0, seconds=1.0, versions={})
    assert "The search ended by its limit" in content["summary"]


@pytest.mark.parametrize("late", [False, True])
def test_exchanges_beside_a_force_of_time_that_the_budget_cut_short_are_not_finished(late) -> None:
    """Where the force makes another model the likeliest, that one has exchanges of its own."""
    clock = Clock(PATIENCE if late else 0.0)
    search = Remaining((), None, np.random.default_rng(0), pytest.fail, Budget(clock, 0.0))
    base, other = (
        Candidate(effects, SimpleNamespace(), 0.0) for effects in ((), (BY_ID["coulomb_friction"],))
    )
    search.tried = {frozenset(c.ids): c for c in (base, other)}
    examined_models: Any = {c.ids: SimpleNamespace(candidate=c) for c in (base, other)}
    exchanged = []
    search.examine = lambda candidate: examined_models[candidate.ids]
    search.drop = lambda candidate, effect: base
    search.exchange = exchanged.append
    left: Any = SimpleNamespace(log_evidence_gain=lambda fit, alone: 90.0 * (fit is other.fit))
    before = Selection(examined_models[()], examined_models[()], (base, other), 1.0)
    found = search.beside_a_force(before, left)
    assert found.chosen.candidate is other and found.beside is left
    assert exchanged == ([] if late else [other]) and found.finished == (not late)


def test_a_search_keeps_time_for_what_its_answer_is_compared_with() -> None:
    clock = Clock()
    search = Remaining((), None, np.random.default_rng(0), pytest.fail, Budget(clock, 0.0))
    assert search.may_go_on()
    clock.now = PATIENCE - COMPARISONS
    assert not search.may_go_on()
    base = Candidate((), SimpleNamespace(), 0.0)
    search.examine = lambda candidate: SimpleNamespace(candidate=candidate)
    search.with_residual = lambda examined: examined.candidate
    examined = search.examine(base)
    found = search.with_forces(Selection(examined, examined, (base,), 1.0), [base])
    assert list(found.residual.values()) == [base]


@pytest.mark.parametrize("look", [0.0, 5.0])
def test_no_residual_force_is_fitted_once_the_time_is_up(look: float) -> None:
    """The first one may take the time of the second, without which the search is not finished; but
    where models take long to be scored.
    """
    clock = Clock()
    search = Remaining((), None, np.random.default_rng(0), pytest.fail, Budget(clock, 0.0))
    search.look = look
    first, second = (
        Candidate(effects, SimpleNamespace(), 0.0) for effects in ((), (BY_ID["coulomb_friction"],))
    )

    def fitted(examined: Any) -> Candidate:
        clock.now += PATIENCE
        return examined.candidate

    search.examine = lambda candidate: SimpleNamespace(candidate=candidate)
    search.with_residual = fitted
    examined = search.examine(first)
    selection = Selection(examined, examined, (first, second), 1.0)
    found = search.with_forces(selection, [first])
    assert list(found.residual.values()) == [first] and found.finished
    found = search.with_forces(found, [first, second])
    assert list(found.residual.values()) == [first, second][: 1 + (look > 0.0)]
    assert found.finished == (look > 0.0)


@pytest.mark.parametrize(
    ("effects", "named"),
    [((), "the base model"), ((BY_ID["coulomb_friction"],), "coulomb_friction")],
)
def test_a_residual_force_is_said_to_stand_beside_a_model(effects, named, monkeypatch) -> None:
    module = importlib.import_module("bayesimpact.diagnosis.selection.remaining")
    least: list[float] = []

    def fitted(candidate: Any, *others: Any, least_gain: float) -> Any:
        least.append(least_gain)
        return candidate

    monkeypatch.setattr(module, "with_force", fitted)
    said: list[str] = []
    search = Remaining((), None, np.random.default_rng(0), said.append, Budget(Clock(), 0.0))
    monkeypatch.setattr(search, "enough", lambda: Enough(least_gain=2.0))
    examined: Any = SimpleNamespace(
        candidate=Candidate(effects, SimpleNamespace(), 0.0), unknown=None
    )
    search.with_residual(examined)
    assert said == [f"fitting a residual force beside {named}"]
    assert least == [2.0]  # no farther than other climbs of the search


@pytest.mark.parametrize(
    ("verdict", "effects", "asked"),
    [("named", 3, True), ("named", 2, True), ("named", 1, False), ("partly", 0, True)],
)
def test_faults_that_are_more_than_a_settled_answer_names_are_not_asked_about(
    verdict, effects, asked
) -> None:
    """One fault was corrected before; one further step has two."""
    before = SimpleNamespace(compared=("clock",))
    found = SimpleNamespace(verdict=verdict, effects=["effect"] * effects, corrected=before)
    assert may_be_simpler([("gain", "gain")], before, found) is asked
