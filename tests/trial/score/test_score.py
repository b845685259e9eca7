"""Scores against truths made by hand."""

from __future__ import annotations

import copy

import numpy as np
import pytest
from scipy import stats

from bayesimpact.trial.score.answers import flat, outcome_of, place, score, sizes
from bayesimpact.trial.score.summary import confusion, rate, rate_in_groups, summarise
from bayesimpact.trial.score.table import summary_text

TRUTH = {
    "kind": "single",
    "rig_kind": "small",
    "noise_kind": "white",
    "noise_rms_m": 2e-6,
    "parameters": {"c1": 1.0, "k1": 100.0, "k2[1]": 500.0, "y0[a]": 0.1},
    "planted": [
        {
            "id": "spring_cubic",
            "parameters": {"stiffness": 7.0},
            "strength": 3.0,
            "regimes": ["free"],
            "place_m": None,
        }
    ],
}
ANSWER = {
    "verdict": "named",
    "effects": [
        {"id": "spring_cubic", "parameters": {"spring_cubic.stiffness": {"ci90": [6.0, 9.0]}}}
    ],
    "alternatives": [],
    "location": {"regime": "free", "displacement_m": [-0.002, 0.001]},
    "fit": {"before": {"rms_m": 2.1e-6}, "held_out_gain": {"value": 5.0, "se": 1.0}},
    "parameters": {
        "before": {"c1": {"ci90": [1.5, 2.5]}, "k1": {"ci90": [90.0, 112.0]}},
        "after": {
            "c1": {"ci90": [0.8, 1.1]},
            "k1": {"ci90": [99.0, 103.0]},
            "k2[1]": {"ci90": [480.0, 490.0]},
        },
    },
    "seconds": 3.0,
}


def answered(**changes: object) -> dict:
    return copy.deepcopy(ANSWER) | changes


@pytest.mark.parametrize(
    ("kind", "planted", "verdict", "named", "outcome"),
    [
        ("control", [], "adequate", [], "quiet"),
        ("control", [], "named", ["gap_wear"], "false alarm"),
        ("control", [], "ambiguous", ["gap_wear"], "false alarm"),
        ("control", [], "unknown", [], "false alarm"),
        ("single", ["gap_wear"], "named", ["gap_wear"], "named"),
        ("single", ["gap_wear"], "named", ["spring_cubic"], "wrong name"),
        ("single", ["gap_wear"], "named", ["gap_wear", "spring_cubic"], "wrong name"),
        ("pair", ["gap_wear", "spring_cubic"], "named", ["spring_cubic", "gap_wear"], "named"),
        ("pair", ["gap_wear", "spring_cubic"], "named", ["gap_wear"], "wrong name"),
        ("pair", ["gap_wear", "spring_cubic"], "ambiguous", ["gap_wear"], "ambiguous"),
        ("pair", ["gap_wear", "spring_cubic"], "adequate", [], "missed"),
        ("single", ["gap_wear"], "unknown", [], "called unknown"),
        ("outside", ["detent"], "unknown", [], "unknown outside"),
        ("outside", ["detent"], "named", ["gap_wear"], "wrong name"),
        ("outside", ["detent"], "ambiguous", ["gap_wear"], "ambiguous"),
        ("outside", ["detent"], "adequate", [], "missed"),
    ],
)
def test_outcomes(
    kind: str, planted: list[str], verdict: str, named: list[str], outcome: str
) -> None:
    assert outcome_of(kind, planted, verdict, named) == outcome


@pytest.mark.parametrize(
    ("kind", "more", "outcome"),
    [("outside", [], "named"), ("outside", ["gap_wear"], "wrong name"), ("several", [], "named")],
)
def test_a_knock_told_as_the_fault_of_a_recording(kind: str, more: list[str], outcome: str) -> None:
    """It is outside the catalogue of effects, but not outside what recordings are known to have."""
    knock = {**TRUTH["planted"][0], "id": "knock", "outside": True}
    there = [{**p, "outside": False} for p in TRUTH["planted"]] if kind == "several" else []
    truth = {**TRUTH, "kind": kind, "planted": [*there, knock], "rest_s": {}}
    names = [*(p["id"] for p in there), *more, "recording_knock"]
    effects = [{**ANSWER["effects"][0], "id": name} for name in names]
    assert score(truth, answered(effects=effects))["outcome"] == outcome


def test_a_right_name() -> None:
    found = score(TRUTH, ANSWER)
    assert found["right"] and not found["confident_wrong"] and found["place"]
    assert found["concealed"] == pytest.approx(0.05)
    assert found["sizes"] == {"spring_cubic.stiffness": True}
    rows = found["coverage"]
    assert set(rows) == {"c1", "k1", "k2[1]"}  # nuisances are not scored
    assert rows["c1"]["before"] is False and rows["c1"]["after"] is True
    # 1.0 lies one unit below the middle of 1.5 to 2.5, which is 2 x 1.645 standard deviations wide
    assert rows["c1"]["before_error"] == pytest.approx(2 * 1.6448536)
    assert "before" not in rows["k2[1]"] and rows["k2[1]"]["after"] is False
    assert set(rows["k1"]) == {"before", "after", "before_error", "after_error"}


def test_correlated_noise_is_no_name() -> None:
    effects = [*ANSWER["effects"], {"id": "noise_correlated", "parameters": {}}]
    assert score(TRUTH, answered(effects=effects))["outcome"] == "named"


def test_the_truth_among_alternatives() -> None:
    other = [{"id": "gap_wear", "parameters": {}}]
    answer = answered(verdict="ambiguous", effects=other, alternatives=[{"id": "spring_cubic"}])
    found = score(TRUTH, answer)
    assert found["truth_in_set"] and not found["right"] and not found["confident_wrong"]
    answer["alternatives"] = [{"id": "spring_cubic + gap_wear"}]
    assert not score(TRUTH, answer)["truth_in_set"]


def test_places() -> None:
    assert not place(TRUTH, answered(location={"regime": "contact", "displacement_m": [0, 1]}))
    assert place({"planted": []}, ANSWER) is None
    assert place(TRUTH, answered(location=None)) is None
    local = copy.deepcopy(TRUTH)
    local["planted"][0]["place_m"] = [-0.005, -0.003]
    assert not place(local, ANSWER)
    local["planted"][0]["place_m"] = [-0.005, -0.0019]
    assert place(local, ANSWER)
    contact = copy.deepcopy(TRUTH)
    contact["planted"][0]["regimes"] = ["contact"]
    for regime in ("entry", "exit", "contact"):
        assert place(contact, answered(location={"regime": regime, "displacement_m": [0, 1]}))


def test_phases_count_modulo_a_turn() -> None:
    truth = {"planted": [{"id": "sensor_hum", "parameters": {"phase": {"a": 0.1, "b": 3.0}}}]}
    found = {"sensor_hum.phase[a]": {"ci90": [6.2, 6.5]}, "sensor_hum.phase[b]": {"ci90": [0, 1]}}
    answer = {"effects": [{"id": "sensor_hum", "parameters": found}]}
    assert sizes(truth, answer) == {"sensor_hum.phase[a]": True, "sensor_hum.phase[b]": False}


def test_names_of_numbers() -> None:
    numbers = flat("e", {"a": 1, "b": {"x": 2.0, "y": 3.0}})
    assert numbers == {"e.a": 1.0, "e.b[x]": 2.0, "e.b[y]": 3.0}


@pytest.mark.parametrize(("hits", "of"), [(0, 60), (3, 60), (60, 60)])
def test_intervals_are_exact(hits: int, of: int) -> None:
    """At each end what was seen, or more of it, has probability 2.5 %."""
    low, high = rate(hits, of)["interval"]
    if hits > 0:
        assert stats.binom.sf(hits - 1, of, low) == pytest.approx(0.025)
    if hits < of:
        assert stats.binom.cdf(hits, of, high) == pytest.approx(0.025)
    assert (low == 0.0) == (hits == 0) and (high == 1.0) == (hits == of)


def result(seed: int, truth: dict, answer: dict) -> dict:
    return {"seed": seed, "truth": truth, "answer": answer, "score": score(truth, answer)}


@pytest.mark.parametrize("together", [1, 9])
def test_numbers_that_err_together_count_as_one(together):
    groups = [[k >= 3] * together for k in range(20)] + [[]]
    found = rate_in_groups(groups)
    assert (found["hits"], found["of"]) == (17 * together, 20 * together)
    np.testing.assert_allclose(found["interval"], rate(17, 20)["interval"])


def test_numbers_that_err_alone_count_each():
    rng = np.random.default_rng(0)
    groups = (rng.random((400, 5)) < 0.9).tolist()
    low, high = rate_in_groups(groups)["interval"]
    assert high - low == pytest.approx(2 * 1.96 * np.sqrt(0.09 / 2000), rel=0.1)


def test_a_group_without_misses_still_leaves_doubt():
    assert rate_in_groups([[True] * 5] * 10)["interval"] == rate(10, 10)["interval"]
    assert rate_in_groups([])["interval"] == rate(0, 0)["interval"]


def test_the_summary_adds_up() -> None:
    control = copy.deepcopy(TRUTH) | {"kind": "control", "planted": []}
    quiet = answered(verdict="adequate", effects=[], location=None)
    wrong = answered(effects=[{"id": "gap_wear", "parameters": {}}])
    lost = {"seed": 9, "failed": "Traceback"}
    results = [
        result(0, TRUTH, ANSWER),
        result(1, TRUTH, wrong),
        result(2, control, quiet),
        result(3, control, wrong),
        lost,
    ]
    summary = summarise(results)
    assert summary["trials"] == 5 and summary["failed"] == [9]
    assert summary["right"]["single"]["hits"] == 1 and summary["right"]["single"]["of"] == 2
    assert summary["false_alarms"]["hits"] == 1 and summary["false_alarms"]["of"] == 2
    assert summary["confident_wrong_names"]["hits"] == 1  # a false alarm has its own line
    assert [m["seed"] for m in summary["misses"]] == [1, 3]
    assert confusion(results[:4]) == {
        "control": {"adequate": 1, "gap_wear": 1},
        "spring_cubic": {"spring_cubic": 1, "gap_wear": 1},
    }
    covered = summary["coverage"]["named"]["c1"]
    assert covered["before"]["hits"] == 0 and covered["after"]["hits"] == 1
    assert np.isclose(covered["before"]["median_error_sd"], 2 * 1.6448536)
    text = summary_text(summary)
    assert "seed 1: spring_cubic [3.0] on small, white: wrong name gap_wear" in text
    assert "seed 9: failed" in text


def test_a_fault_is_right_alone_and_its_runs_have_a_summary() -> None:
    fault = {"id": "recording_held", "recording": "a", "start_s": 1.0, "end_s": 1.2, "timed": True}
    truth = copy.deepcopy(TRUTH) | {"kind": "fault", "planted": [], "fault": fault}
    told = fault | {"action": "exclude"}
    notice = told | {"id": "recording_noise", "action": "notice"}
    alone = answered(effects=[{"id": "recording_held", "parameters": {}}]) | {
        "faults": [told, notice]
    }
    beside = answered(effects=[{"id": "gap_wear", "parameters": {}}]) | {"faults": [told]}
    silent = answered(verdict="unknown", effects=[]) | {"faults": [notice]}
    outcomes = [score(truth, a)["outcome"] for a in (alone, beside, silent)]
    assert outcomes == ["named", "wrong name", "missed"]
    both = truth | {"kind": "fault_single", "planted": TRUTH["planted"]}
    (effect,) = ANSWER["effects"]
    together = answered(effects=[effect, {"id": "recording_held", "parameters": {}}])
    outcomes = [score(both, a | {"faults": [told]})["outcome"] for a in (together, alone, beside)]
    assert outcomes == ["named", "fault alone", "wrong name"]
    text = summary_text(summarise([result(0, truth, alone), result(1, truth, silent)]))
    assert "faults named, with their place    50.0 %" in text
