"""Faults of trials: put where the truth says, and scored by id, recording and time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayesimpact.data.faults.fault import fault_document
from bayesimpact.data.faults.find import find_faults
from bayesimpact.trial.draw import one_trial as draw_module
from bayesimpact.trial.draw.faults import PLANTED_FAULTS, plant_fault, score_fault
from bayesimpact.trial.draw.one_trial import draw
from bayesimpact.trial.draw.settings import Settings

SETTINGS = Settings(kinds=("fault",), rig_kinds=("small",), noises=("white",))


@pytest.fixture(scope="module")
def control():
    return draw(Settings(kinds=("control",), rig_kinds=("small",), noises=("white",)), 1)


@pytest.mark.parametrize("kind", PLANTED_FAULTS)
def test_a_fault_is_in_one_recording_and_nowhere_else(control, kind: str) -> None:
    rng = np.random.default_rng(3)
    planted = plant_fault(control.campaign, kind, control.truth["noise_m"], rng)
    assert planted is not None
    campaign, truth = planted
    before = {
        r.name: (r.case, r.interval, r.samples.tobytes()) for r in control.campaign.recordings
    }
    after = {r.name: (r.case, r.interval, r.samples.tobytes()) for r in campaign.recordings}
    assert [n for n in after if before.get(n) != after[n]] == [truth["recording"]]
    assert truth["id"] == PLANTED_FAULTS[kind].id


@pytest.mark.parametrize("kind", ["spikes", "held", "start", "duplicate"])
def test_what_was_put_in_is_found(control, kind: str) -> None:
    planted = plant_fault(
        control.campaign, kind, control.truth["noise_m"], np.random.default_rng(5)
    )
    assert planted is not None
    found = [f for f in find_faults(planted[0]) if f.action != "notice"]
    assert score_fault(planted[1], [fault_document(f) for f in found]) == "named"


def test_scores() -> None:
    truth = {"id": "recording_held", "recording": "a", "start_s": 1.0, "end_s": 1.2, "timed": True}
    right = {"id": "recording_held", "recording": "a", "start_s": 1.1, "end_s": 1.3}
    assert score_fault(truth, [right]) == "named"
    assert score_fault(truth, []) == "missed"
    assert score_fault(truth, [right | {"recording": "b"}]) == "elsewhere"
    assert score_fault(truth, [right | {"start_s": 1.3, "end_s": 1.4}]) == "elsewhere"
    assert score_fault(truth, [right | {"id": "recording_spikes"}]) == "wrong name"
    assert score_fault(truth, [right, right | {"id": "recording_spikes"}]) == "wrong name"


def test_a_trial_says_in_its_truth_what_was_put_in_and_is_the_same_again() -> None:
    one, again = draw(SETTINGS, 1), draw(SETTINGS, 1)
    assert one.truth["fault"] == again.truth["fault"]
    assert one.truth["fault"]["id"] == "recording_held"
    for a, b in zip(one.campaign.recordings, again.campaign.recordings, strict=True):
        np.testing.assert_array_equal(a.samples, b.samples)


def test_a_recording_of_another_rig_has_another_motion_and_the_rest_stays() -> None:
    seed = len(PLANTED_FAULTS)  # whose turn it is
    drawn = draw(SETTINGS, seed)
    fault = drawn.truth["fault"]
    assert fault["id"] == "recording_other_rig" and abs(fault["size"] - 1) >= 0.003
    control = draw(Settings(kinds=("control",), rig_kinds=("small",), noises=("white",)), seed)
    noise = drawn.truth["noise_m"]
    for one, sound in zip(drawn.campaign.recordings, control.campaign.recordings, strict=True):
        changed = np.max(np.abs(one.samples - sound.samples)) > 10 * noise
        assert changed == (one.name == fault["recording"])


def test_a_fault_and_an_effect_stand_in_one_truth() -> None:
    settings = Settings(
        kinds=("fault_single",), rig_kinds=("small",), noises=("white",), effects=("spring_cubic",)
    )
    truth = draw(settings, 0).truth
    assert truth["fault"]["id"] == "recording_spikes"
    assert [p["id"] for p in truth["planted"]] == ["spring_cubic"]


def test_faults_beside_an_effect_are_those_that_its_rigs_can_show() -> None:
    settings = replace(SETTINGS, rig_kinds=("paper", "torsion", "plain"))
    assert draw_module._faults(settings, ()) == [*PLANTED_FAULTS, "other_rig"]
    beside = draw_module._faults(settings, ("pendulum_sine",))
    assert {"reversed", "gain", "clock", "case"}.isdisjoint(beside) and "duplicate" in beside
