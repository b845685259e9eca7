"""Scores of trials with several effects at once."""

from __future__ import annotations

import copy

import pytest
from test_score import ANSWER

from bayesimpact.trial.score.answers import outcome_of, score
from bayesimpact.trial.score.line import trial_line
from bayesimpact.trial.score.strong import inconsistent, score_several, worse
from bayesimpact.trial.score.summary import summarise
from bayesimpact.trial.score.summary_strong import selection
from bayesimpact.trial.score.table import summary_text

AB = ["quadratic_drag", "spring_cubic"]


@pytest.mark.parametrize(
    ("outside", "verdict", "named", "outcome"),
    [
        (False, "named", ["spring_cubic", "quadratic_drag"], "named"),
        (False, "named", ["spring_cubic"], "overconfident"),
        (False, "named", [*AB, "coulomb_friction"], "wrong name"),
        (False, "named", ["power_damping", "spring_cubic"], "wrong name"),  # a neighbour is wrong
        (False, "partly", ["spring_cubic"], "partly"),
        (False, "partly", AB, "partly"),
        (False, "partly", ["spring_quintic"], "wrong name"),
        (False, "unknown", [], "called unknown"),
        (False, "unknown", ["spring_quintic"], "called unknown"),
        (False, "ambiguous", ["spring_quintic"], "ambiguous"),
        (False, "adequate", [], "missed"),
        (True, "partly", ["spring_cubic"], "partly outside"),
        (True, "partly", AB, "partly outside"),
        (True, "partly", ["spring_quintic"], "wrong name"),
        (True, "unknown", [], "unknown outside"),
        (True, "named", AB, "overconfident"),
        (True, "named", ["spring_cubic"], "overconfident"),
        (True, "named", [*AB, "sensor_hum"], "wrong name"),
        (True, "ambiguous", AB, "ambiguous"),
        (True, "adequate", [], "missed"),
    ],
)
def test_outcomes(outside: bool, verdict: str, named: list[str], outcome: str) -> None:
    assert score_several(AB, outside, verdict, named) == outcome


def test_partly_in_the_weak_regime() -> None:
    assert outcome_of("pair", AB, "partly", ["spring_cubic"]) == "partly"
    assert outcome_of("single", AB[:1], "partly", ["spring_cubic"]) == "wrong name"
    assert outcome_of("outside", ["detent"], "partly", ["spring_cubic"]) == "wrong name"
    assert outcome_of("control", [], "partly", ["spring_cubic"]) == "false alarm"


def planted(effect: str, outside: bool = False) -> dict:
    return {
        "id": effect,
        "outside": outside,
        "parameters": {},
        "strength": 4.0,
        "regimes": ["free"],
        "place_m": None,
    }


def truth(*effects: str, outside: str = "", **more: object) -> dict:
    found = [planted(e) for e in effects] + ([planted(outside, True)] if outside else [])
    return {
        "kind": "several_outside" if outside else "several",
        "rig_kind": "decays",
        "noise_kind": "white",
        "misfit": 40.0,
        "noise_rms_m": 2e-6,
        "parameters": {"c1": 1.0, "k1": 100.0},
        "planted": found,
        "rest_s": {},
        "rejected": {"no base fit: InputError": 1, "spring_cubic is hidden by the others": 2},
    } | more


def answer(
    verdict: str, *effects: str, chi2: tuple = (900.0, 1.0), rms: tuple = (2.0, 1.0)
) -> dict:
    found = copy.deepcopy(ANSWER)
    found["verdict"] = verdict
    found["effects"] = [{"id": e, "parameters": {}} for e in effects]
    found["fit"]["before"] = {"rms_m": rms[0], "reduced_chi2": chi2[0]}
    found["fit"]["after"] = {"rms_m": rms[1], "reduced_chi2": chi2[1]}
    return found


def test_scores_by_the_truth() -> None:
    assert score(truth(*AB), answer("named", *AB))["right"]
    assert score(truth(AB[0], outside="detent"), answer("partly", AB[0]))["right"]
    assert score(truth(AB[0], outside="detent"), answer("unknown"))["right"]
    lost = score(truth(AB[0], outside="detent"), answer("named", AB[0]))
    assert lost["outcome"] == "overconfident" and not lost["right"] and not lost["confident_wrong"]
    assert score(truth(*AB), answer("partly", "sensor_hum"))["confident_wrong"]
    quiet = answer("named", *AB, "noise_correlated")
    assert score(truth(*AB), quiet)["outcome"] == "named"


def test_a_formula_of_the_class_of_a_force_outside_is_its_name() -> None:
    concealed = truth(AB[0], outside="damping_drift")

    def with_formula(verdict: str, title: str, *effects: str) -> dict:
        found = answer(verdict, *effects)
        found["effects"].append(
            {"id": "formula_x", "family": "formula", "title": title, "parameters": {}}
        )
        return found

    said = score(concealed, with_formula("named", "force A t v", AB[0]))
    assert said["outcome"] == "formula" and said["right"]
    said = score(concealed, with_formula("partly", "force A t v", AB[0]))
    assert said["outcome"] == "partly outside"
    assert score(concealed, with_formula("named", "force A t v"))["outcome"] == "overconfident"
    for verdict in ("partly", "named"):
        other = score(concealed, with_formula(verdict, "force A v |v|", AB[0]))
        assert other["outcome"] == "wrong name"
    within = score(truth(*AB), with_formula("named", "force A t v", *AB))
    assert within["outcome"] == "wrong name"


def test_a_rest_may_be_named_where_there_is_one() -> None:
    said = answer("named", *AB, "recording_start")
    assert score(truth(*AB), said)["outcome"] == "wrong name"
    rested = truth(*AB, rest_s={"decay_1": 0.5})
    assert score(rested, said)["outcome"] == "named"
    assert score(rested, answer("named", *AB))["outcome"] == "named"
    # and it does not hide a force from outside the catalogue
    rested = truth(AB[0], outside="detent", rest_s={"decay_1": 0.5})
    assert score(rested, answer("named", AB[0], "recording_start"))["outcome"] == "overconfident"


def test_a_fit_that_became_worse() -> None:
    assert worse(answer("named", chi2=(5.0, 5.0), rms=(1.0, 1.0))) == []
    assert worse(answer("named", chi2=(5.0, 5.1), rms=(1.0, 1.0))) == ["reduced_chi2"]
    assert worse(answer("named", chi2=(5.0, 4.0), rms=(1.0, 1.01))) == ["rms_m"]
    assert worse(answer("named", chi2=(5.0, None), rms=(1.0, 1.01))) == ["rms_m"]


def test_a_median_outside_its_own_interval() -> None:
    said = answer("named", "spring_cubic")
    assert inconsistent(said) == []
    said["parameters"]["after"]["c1"] = {"median": 7.3, "ci90": [0.0, 6.5]}
    said["effects"][0]["parameters"] = {"spring_cubic.stiffness": {"median": 1.0, "ci90": [2, 3]}}
    assert inconsistent(said) == ["after: c1", "spring_cubic: spring_cubic.stiffness"]


def results() -> list[dict]:
    rows = [
        (truth(*AB), answer("named", *AB)),
        (truth(*AB), answer("named", "sensor_hum")),
        (truth(AB[0], outside="detent"), answer("unknown", chi2=(2.0, 9.0))),
    ]
    found: list[dict] = [
        {"seed": i, "truth": t, "answer": a, "score": score(t, a)} for i, (t, a) in enumerate(rows)
    ]
    trace = "Traceback\n  File \"/x/recordings.py\", line 131, in f\n    g\nKeyError: 'g'"
    found.append({"seed": 3, "truth": truth(*AB), "failed": trace, "stage": "diagnosing"})
    found.append({"seed": 4, "failed": "Unsuitable: in vain", "stage": "drawing"})
    return found


def test_the_summary() -> None:
    summary = summarise(results())
    assert summary["failed"] == [3, 4]
    assert (summary["crashes"]["hits"], summary["crashes"]["of"]) == (1, 4)
    assert summary["crashes"]["seeds"] == [3]
    assert summary["worse"]["seeds"] == [2] and summary["overconfident"]["hits"] == 0
    assert summary["right"]["several"]["hits"] == 1 and summary["right"]["several"]["of"] == 2
    assert summary["right"]["several_outside"]["hits"] == 1
    assert summary["confident_wrong_names"]["hits"] == 1
    # c1 = 1 is in 0.8 to 1.1 and k1 = 100 in 99 to 103
    inside = summary["inside_by_verdict"]
    assert (inside["named"]["hits"], inside["named"]["of"]) == (4, 4)
    assert inside["all"]["of"] == 6
    text = summary_text(summary)
    assert "crashes" in text and "all named, all in catalogue" in text and "seeds 2" in text


def test_rejected_draws_are_counted() -> None:
    chosen = selection(results())
    assert chosen is not None
    assert (chosen["kept"], chosen["draws"], chosen["gave_up"]) == (4, 4 + 4 * 3, [4])
    assert chosen["thrown_away"] == {
        "an effect is hidden by the others": 8,
        "no base fit: InputError": 4,
    }
    assert selection([{"seed": 1, "truth": {"kind": "control"}}]) is None


def test_lines() -> None:
    right, wrong, bad, crash, vain = map(trial_line, results())
    assert right.startswith("0 several | decays, white, misfit 40 | quadratic_drag + spring_cubic")
    assert "| NAMED | chi2 900 -> 1 | inside 2 of 2 | 3 s" in right
    assert "WRONG NAME" in wrong and "unknown: - | UNKNOWN OUTSIDE" in bad and "9 WORSE" in bad
    assert crash.endswith("CRASH in diagnosing: recordings.py\", line 131, in f KeyError: 'g'")
    assert "drawing" in vain and vain.startswith("4 ")
