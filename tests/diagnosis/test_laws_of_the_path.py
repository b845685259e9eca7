"""Hysteresis is named by its law; what only restates a law never stands beside it."""

from __future__ import annotations

import numpy as np
import small_rig
from effect_rigs import BY_ID, with_effect

import bayesimpact as bi
from bayesimpact.diagnosis.decision import holds
from bayesimpact.diagnosis.directions import directions
from bayesimpact.diagnosis.extend import campaign_scales
from bayesimpact.diagnosis.promising import families
from bayesimpact.diagnosis.scan import Scan
from bayesimpact.diagnosis.scores import Score
from bayesimpact.model.effects import Effect

LOOP, DAHL = BY_ID["hysteresis_bouc_wen"], BY_ID["presliding_friction"]


def score(effect: Effect) -> Score:
    none = np.zeros(0)
    return Score(effect, {}, 0.0, 1.0, none, none, 0.0, none, 1.0, 9.0, ())


def test_a_loop_as_wide_as_the_swing_is_named():
    stiffness, decay = 8.0, 1 / 6e-3
    planted = {"hysteresis_bouc_wen": {"stiffness": stiffness, "decay": decay}}
    campaign = small_rig.record(seed=11, effects=planted)
    found = bi.diagnose(campaign, search=False, seed=0, effects=(*bi.SEARCHED, LOOP))
    assert found.verdict == "named" and [e.id for e in found.effects] == [LOOP.id]
    for name, true in (("stiffness", stiffness), ("decay", decay)):
        at = found.after.names.index(f"{LOOP.id}.{name}")
        assert abs(found.after.mode[at] - true) < 4 * found.after.sd[at]
    one = frozenset([LOOP.id])
    assert not any(one < frozenset(c.ids) and DAHL.id in c.ids for c in found.naming.tried)


def test_one_law_is_not_added_to_itself(small):
    friction = BY_ID["coulomb_friction"]
    assert not LOOP.stands_beside(DAHL) and not DAHL.stands_beside(LOOP)
    assert DAHL.stands_beside(friction) and LOOP.stands_beside(friction)
    fit, law = with_effect(small, LOOP.id, stiffness=1.0), BY_ID["spring_cubic"]
    scored = directions(fit, (law, DAHL, LOOP), campaign_scales(small.fit))
    assert {d.effect.id for d in scored} == {law.id}
    best = Scan((score(DAHL), score(LOOP), score(friction)), 1.0, None, (), ())
    assert [[s.effect.id for s in j] for j in families(best)] == [[DAHL.id, friction.id]]
    assert holds([LOOP], DAHL) and holds([DAHL], LOOP) and not holds([friction], LOOP)
