"""Sets of effects by a few steps of each one's own fit over periods ahead.

A linear problem about a model that is far off promises too much of laws that bend its errors, and
too little of those that only act together. A step of a set's own simulation (`one_step`) tells
the sets apart, and costs far less than a fit; two more tell those apart that are alike in the
first. So sets are grown by that measure: beside each of the best ones of a size stand, one at a
time, the effects of which the linear problem promises most (a beam search; Lowerre 1976).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

import numpy as np

from bayesimpact.diagnosis.candidates.one_step import SteppedSet
from bayesimpact.diagnosis.candidates.period_sets import PeriodSets
from bayesimpact.diagnosis.candidates.term_sets import EffectSet
from bayesimpact.formula.law import is_formula_id, kind_id

WIDTH = 6  # sets of a size that are extended: set by hand
PROMISED = 12  # effects beside each, of which the linear problem promises most: set by hand
REFINED = 20  # of a size, the cheapest by one step, are weighed by `STEPS`: set by hand
STEPS = 3  # the third is small where a set is right

Steps = Callable[[EffectSet, int], SteppedSet]
"""A set by so many steps."""
Ids = frozenset[str]


def stepwise_sets(
    problem: PeriodSets,
    stepped: Steps,
    most: int,
    may_go_on: Callable[[], bool],
    *,
    with_terms: bool = False,
) -> list[SteppedSet]:
    """Sets of up to `most` effects beside a problem's model, those that cost least first.

    Every effect is one by itself; larger ones as long as the best of a size costs less than all
    smaller ones, and leaves more than another effect would cost. With terms of the grammar at most
    one of them is in a set.
    """
    weighed = dict[Ids, SteppedSet]()
    beam, least = [Ids()], np.inf
    for size in range(1, most + 1):
        level = dict.fromkeys(
            ids | {more}
            for ids in beam
            for more in _promised(problem.gains(sorted(ids), with_terms=with_terms), ids, size)
        )
        for ids in level:
            if ids not in weighed and may_go_on():
                weighed[ids] = stepped(problem.set_of(problem.shaped(sorted(ids)), 0.0), 1)
        cheapest = sorted((i for i in level if i in weighed), key=lambda i: weighed[i].cost)
        for ids in cheapest[:REFINED]:
            if may_go_on():
                weighed[ids] = stepped(weighed[ids].chosen, STEPS)
        beam = sorted(cheapest[:REFINED], key=lambda i: weighed[i].cost)[:WIDTH]
        if not beam or not weighed[beam[0]].cost < least:
            break
        least = weighed[beam[0]].cost
        if weighed[beam[0]].left < problem.cost:
            break
    return sorted(weighed.values(), key=lambda one: one.cost)


def _promised(gains: Mapping[str, float], ids: Iterable[str], size: int) -> list[str]:
    """The effects that are tried beside a set, and of every kind of term the likeliest one; by
    themselves all of the catalogue.

    Kinds stand in the order of what they promise where they promise least: one of many places bends
    the errors of a model that is far off somewhere, whatever is missing.
    """
    ranked = sorted((i for i in gains if np.isfinite(gains[i])), key=lambda i: -gains[i])
    if any(map(is_formula_id, ids)):
        ranked = [i for i in ranked if not is_formula_id(i)]
    likeliest = list({kind_id(i): i for i in reversed(ranked)}.values())[::-1]
    if size > 1:
        return likeliest[:PROMISED]
    terms = [i for i in likeliest if is_formula_id(i)]
    return [*(i for i in likeliest if not is_formula_id(i)), *terms[:PROMISED]]
