"""A search whose time is up names nothing that it has not compared with what may do the same."""

from __future__ import annotations

import itertools

import numpy as np
import small_rig
from effect_rigs import BY_ID

from bayesimpact.diagnosis.budget import PATIENCE, begin
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.selection.decision import decide
from bayesimpact.diagnosis.selection.search import select_model
from bayesimpact.inference.identify import identify

CATALOGUE = [BY_ID[i] for i in ("coulomb_friction", "quadratic_drag", "spring_cubic")]


def searched(*, looks: int):
    """What a search finds that may look at its clock so many times before the time is up, beside
    its beginning and how long the base model takes to be scored.
    """
    effects = {"spring_cubic": {"stiffness": 4e5}, "quadratic_drag": {"coefficient": 0.3}}
    campaign = small_rig.record(7, effects, rig=small_rig.PLAIN, releases=small_rig.PLAIN_RELEASES)
    fit = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    times = itertools.chain([0.0] * (3 + looks), itertools.repeat(PATIENCE + 1.0))
    scales = campaign_scales(fit)
    budget = begin(lambda: next(times))
    return select_model(fit, CATALOGUE, scales, rng=np.random.default_rng(0), budget=budget)


def test_without_time_nothing_is_fitted_and_nothing_named() -> None:
    found = searched(looks=0)
    assert not found.finished and [c.ids for c in found.tried] == [()]
    assert decide(found).verdict == "unknown"


def test_with_time_for_some_what_was_found_stays_but_is_not_called_needed() -> None:
    found = searched(looks=2)
    assert not found.finished and len(found.tried) > 1
    assert decide(found).verdict in ("unknown", "ambiguous")


def test_with_time_enough_the_search_ends_by_itself() -> None:
    found = searched(looks=10_000)
    assert found.finished
    decision = decide(found)
    assert decision.verdict == "named"
    assert {e.id for e in decision.effects} == {"spring_cubic", "quadratic_drag"}
