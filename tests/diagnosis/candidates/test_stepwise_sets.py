"""Sets of effects that one step of each one's own fit leads to."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import small_rig

from bayesimpact.diagnosis.candidates.one_step import SteppedSet, after_steps
from bayesimpact.diagnosis.candidates.period_terms import periods_with_terms
from bayesimpact.diagnosis.candidates.stepwise_sets import PROMISED, _promised, stepwise_sets
from bayesimpact.diagnosis.candidates.term_sets import EffectSet
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import fit_from
from bayesimpact.inference.identify import identify
from bayesimpact.model.effects import SEARCHED

RUBBING = {
    "hunt_crossley": {"damping": 0.3, "exponent": 1.3},
    "spring_cubic": {"stiffness": 4e6},
    "contact_friction": {"force": 0.3},
}
TRUTH = {"hunt_crossley", "spring_cubic", "formula_sign_v_in_contact"}
TERMS = ("formula_v_at_1", "formula_d", "formula_v_at_2")
PLAIN = tuple(f"effect_{i}" for i in range(2 * PROMISED))


class Problem:
    """Of effects that promise less from one to the next."""

    cost = 5.0

    def gains(self, ids: Collection[str], *, with_terms: bool) -> dict[str, float]:
        every = [*TERMS, *PLAIN] if with_terms else PLAIN
        return {name: 100.0 - i for i, name in enumerate(every) if name not in ids}

    def shaped(self, ids: Collection[str]) -> list[str]:
        return sorted(ids)

    def set_of(self, ids: list[str], odds: float) -> Any:
        return SimpleNamespace(ids=frozenset(ids))


def weighed(costs: dict[frozenset[str], float], most: int, **how: Any) -> dict[Any, float]:
    """Sets with their cost, 100 less their size where none is given."""
    go_on = how.pop("go_on", lambda: True)

    def stepped(chosen: Any, steps: int) -> SteppedSet:
        return SteppedSet(costs.get(chosen.ids, 100.0 - len(chosen.ids)), 3.0 - steps, chosen)

    problem: Any = Problem()
    found = stepwise_sets(problem, stepped, most, go_on, **how)
    assert [one.cost for one in found] == sorted(one.cost for one in found)
    return {one.chosen.ids: one.left for one in found}  # type: ignore[attr-defined]


def test_every_effect_is_weighed_and_the_cheapest_are_extended() -> None:
    last = frozenset([PLAIN[-1]])
    pair = last | {PLAIN[0]}
    found = weighed({last: 11.0, pair: 10.0}, 2)
    assert {frozenset([name]) for name in PLAIN} <= set(found)
    assert next(iter(found)) == pair
    beside_last = [ids for ids in found if len(ids) == 2 and last < ids]
    assert len(beside_last) == PROMISED  # those of which the problem promises most
    assert all(PLAIN.index(*(ids - last)) < PROMISED for ids in beside_last)


def test_sets_grow_as_long_as_that_costs_less() -> None:
    dear = {frozenset([a, b]): 99.5 for a in PLAIN for b in PLAIN if a != b}
    assert max(map(len, weighed(dear, 4))) == 2
    assert max(map(len, weighed({}, 4))) == 4
    white = {frozenset([PLAIN[0], PLAIN[1]]): 0.5 * Problem.cost}
    assert max(map(len, weighed(white, 4))) == 2  # another effect would cost more


def test_at_most_one_term_is_in_a_set_and_of_a_kind_the_likeliest() -> None:
    assert not any(ids & {*TERMS} for ids in weighed({}, 3))
    found = weighed({}, 3, with_terms=True)
    assert frozenset(["formula_v_at_1"]) in found and frozenset(["formula_v_at_2"]) not in found
    with_terms = [ids for ids in found if ids & {*TERMS}]
    assert {len(ids) for ids in with_terms} == {1, 2, 3}
    assert all(len(ids & {*TERMS}) == 1 for ids in with_terms)


def test_kinds_of_terms_stand_where_they_promise_least() -> None:
    """Each by its likeliest one; none beside another term."""
    gains = {name: 100.0 - i for i, name in enumerate([*TERMS, *PLAIN])}
    assert _promised(gains, [PLAIN[0]], 2)[:3] == [TERMS[1], TERMS[0], PLAIN[0]]
    assert _promised(gains, [TERMS[1]], 2) == list(PLAIN[:PROMISED])
    assert _promised(gains, [], 1) == [*PLAIN, TERMS[1], TERMS[0]]


def test_none_is_weighed_when_time_is_up() -> None:
    assert weighed({}, 3, go_on=lambda: False) == {}


@pytest.mark.long
def test_laws_that_only_act_together_are_found_with_a_force_of_no_effect() -> None:
    """The linear problem promises more of others: a step of each set's own fit tells."""
    campaign = small_rig.record(2, RUBBING, duration=4.0)
    base = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    scales = campaign_scales(base)
    problem = periods_with_terms(base, SEARCHED, scales)

    def stepped(chosen: EffectSet, steps: int) -> SteppedSet:
        prices = sum(problem.cost + effect.price for effect in chosen.effects)
        found = after_steps(base, chosen, scales, steps, problem.starts if steps == 1 else ())
        return replace(found, price=found.price + prices)

    best = stepwise_sets(problem, stepped, 3, lambda: True, with_terms=True)[0].chosen
    assert {e.id for e in best.effects} == TRUTH
    assert {e.id for e in problem.best(3)[-1].effects} != TRUTH
    assert fit_from(base, best.effects, best.values, scales).fit.reduced_chi2 < 1.2
