"""Hysteresis is named by its law; what only restates a law never stands beside it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID, with_effect

import bayesimpact as bi
from bayesimpact.diagnosis.candidates.promising import families
from bayesimpact.diagnosis.diagnose import is_doubtful
from bayesimpact.diagnosis.faults.recording_faults import shared_effects
from bayesimpact.diagnosis.refits.evidence import shared_sd_evidence, structure
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.score_test.directions import directions
from bayesimpact.diagnosis.score_test.scan import Scan
from bayesimpact.diagnosis.score_test.scores import Score
from bayesimpact.diagnosis.selection.decision import complexity, holds
from bayesimpact.inference.prior import Normal
from bayesimpact.model.effects import Effect

pytestmark = pytest.mark.usefixtures("catalogue_alone")

LOOP, DAHL = BY_ID["hysteresis_bouc_wen"], BY_ID["presliding_friction"]
OTHERS = tuple(
    BY_ID[i]
    for i in (
        "coulomb_friction", "quadratic_drag", "power_damping", "structural_damping",
        "spring_cubic", "stiffness_drift", "sensor_drift",
    )
)  # fmt: skip


@pytest.mark.parametrize("cut", [0, 120])
def test_a_memory_is_found_where_a_recording_was_cut(cut: int) -> None:
    """The state at the first sample is an unknown of every recording, at a release and later."""
    truth = {"stiffness": 120.0, "decay": 200.0}
    campaign = small_rig.record(
        1, {LOOP.id: truth}, rig=small_rig.PLAIN, releases=small_rig.PLAIN_RELEASES, duration=4.0
    )
    left = tuple(r.part(cut, r.samples.size) for r in campaign.recordings)
    campaign = replace(campaign, recordings=left)
    found = bi.diagnose(campaign, search=False, seed=0, effects=(*OTHERS, DAHL, LOOP))
    assert found.verdict == "named" and [e.id for e in found.effects] == [LOOP.id]
    assert shared_effects(found.effects) == found.effects  # its starts tell no recording apart
    assert not is_doubtful(found) and not shared_effects([BY_ID["gap_per_recording"]])
    expected = {f"{LOOP.id}.{name}": value for name, value in truth.items()}
    for name, value in {"k1": small_rig.PLAIN.k1, **expected}.items():
        at = found.after.names.index(name)
        assert abs(found.after.mode[at] - value) < 4.0 * found.after.sd[at], name
    starts = [i for i, n in enumerate(found.after.names) if n.startswith(f"{LOOP.id}.start")]
    known = np.abs(found.after.mode[starts]) / found.after.sd[starts]
    assert cut or structure(found.after) > 5.0  # nats: one spread in place of two sizes
    assert len(starts) == 2 and (known.min() > 50.0 if cut else known.max() < 4.0)


def test_starts_that_recordings_share_cost_little() -> None:
    """Nine states that are nothing cost what one spread of fifteen does, not nine sizes apart; nine
    that are something cost nearly as much as they do each by itself.
    """
    sd, prior = np.full(9, 1e-3), Normal(0.0, 1.0)
    covariance = np.diag(1 / (1 / sd**2 + 1 / prior.sd**2))
    alone = -float(np.sum(np.log(prior.sd / sd)))
    assert -4.0 < alone + shared_sd_evidence(np.zeros(9), covariance, prior, None) < 0.0
    apart = np.array([1.0, -1.0, 0.5, -0.5, 0.8, -0.8, 1.0, -1.0, 0.6])
    assert -4.0 < shared_sd_evidence(apart, covariance, prior, None) < 0.0


def score(effect: Effect) -> Score:
    none = np.zeros(0)
    return Score(effect, {}, 0.0, 1.0, none, none, 0.0, none, 1.0, 9.0, ())


@pytest.mark.parametrize(
    ("law", "numbers"),
    [
        (LOOP, {"stiffness": 8.0, "decay": 1 / 6e-3}),
        pytest.param(DAHL, {"force": 3e-3, "displacement": 3e-4}, marks=pytest.mark.slow),
        pytest.param(LOOP, {"stiffness": 100.0, "decay": 2 / 6e-3}, marks=pytest.mark.slow),
        (DAHL, {"force": 0.05, "displacement": 3e-4}),
    ],
)
def test_one_law_has_the_name_of_its_range(law: Effect, numbers: dict[str, float]) -> None:
    """A loop as wide as the swing, and friction that gives a little: small, and a large misfit."""
    campaign = small_rig.record(seed=11, effects={law.id: numbers})
    found = bi.diagnose(campaign, search=False, seed=0, effects=(*OTHERS, LOOP, DAHL))
    assert found.verdict == "named" and [e.id for e in found.effects] == [law.id]
    for name, true in numbers.items():
        at = found.after.names.index(f"{law.id}.{name}")
        assert abs(found.after.mode[at] - true) < 4 * found.after.sd[at]
    one = frozenset([law.id])
    assert not any(
        one < frozenset(c.ids) and {LOOP.id, DAHL.id} <= {*c.ids} for c in found.selection.tried
    )


def test_states_at_the_beginning_are_no_parameters_to_fit_more_with():
    assert complexity([LOOP]) == complexity([DAHL]) == complexity([BY_ID["power_damping"]])


def test_one_law_is_not_added_to_itself(small):
    friction = BY_ID["coulomb_friction"]
    assert not LOOP.stands_beside(DAHL) and not DAHL.stands_beside(LOOP)
    assert DAHL.stands_beside(friction) and LOOP.stands_beside(friction)
    fit, law = with_effect(small, LOOP.id, stiffness=1.0), BY_ID["spring_cubic"]
    scored = directions(fit, (law, DAHL, LOOP), campaign_scales(small.fit))
    assert {d.effect.id for d in scored} == {law.id}
    best = Scan((score(DAHL), score(LOOP), score(friction)), 1.0, None, (), ())
    assert [[s.effect.id for s in j] for j in families(best)] == [[DAHL.id, friction.id]]
    assert holds([LOOP], (DAHL,)) and holds([DAHL], (LOOP,)) and not holds([friction], (LOOP,))


def test_a_term_of_the_base_model_has_one_other_form():
    hertz, crossley = BY_ID["contact_power_law"], BY_ID["hunt_crossley"]
    assert not hertz.stands_beside(crossley) and not crossley.stands_beside(hertz)
    assert crossley.stands_beside(BY_ID["contact_hardening"])  # which adds a term
