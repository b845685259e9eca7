"""One opened trial: was the answer right?

Verdicts against truths:

| truth | right | wrong |
|---|---|---|
| control | quiet (adequate) | false alarm (anything else) |
| effects of the catalogue | named (all, and no other) | wrong name, missed |
| a force outside it | unknown, or a formula of its class (`score.formulas`) | wrong name, missed |
| a knock, outside too | the fault of a recording that it is (`AS_FAULT`), or unknown | as above |

Ambiguous, partly (with no wrong name), and unknown for effects of the catalogue, are abstentions:
neither. Several effects at once: `score.strong`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from bayesimpact.trial.draw.faults import score_fault
from bayesimpact.trial.score.formulas import is_right, split
from bayesimpact.trial.score.strong import inconsistent, quality, score_several

NORMAL_90 = 1.6448536269514722
QUIET = ("noise_correlated",)  # reported beside a verdict, never a name
BASE = ("c1", "k1", "c2", "g", "k2")
AS_FAULT = {"knock": "recording_knock"}
"""Forces outside the catalogue that a recording's fault names."""
RIGHT = ("quiet", "named", "unknown outside", "partly outside", "formula")


def score(truth: Mapping[str, Any], answer: Mapping[str, Any]) -> dict[str, Any]:
    """Score an answer (the content of diagnosis.json) against the opened truth."""
    planted = [p["id"] for p in truth["planted"]]
    effects = [e for e in answer["effects"] if e["id"] not in QUIET]
    named = [e["id"] for e in effects]
    outcome = _outcome(truth, answer["verdict"], effects, answer.get("faults", ()))
    if names_the_force(truth, answer):
        outcome = "formula"
    sets = [set(named), *(set(a["id"].split(" + ")) for a in answer["alternatives"])]
    return {
        "truth": truth["fault"]["id"]
        if "fault" in truth
        else " + ".join(sorted(planted)) or "control",
        "verdict": answer["verdict"],
        "named": " + ".join(sorted(named)) or answer["verdict"],
        "outcome": outcome,
        "right": outcome in RIGHT,
        "confident_wrong": outcome == "wrong name",
        "truth_in_set": answer["verdict"] in ("named", "ambiguous") and set(planted) in sets,
        "strengths": [p["strength"] for p in truth["planted"]],
        "concealed": concealed(truth, answer),
        "place": place(truth, answer),
        "sizes": sizes(truth, answer) if outcome == "named" else {},
        "coverage": coverage(truth, answer),
        "quality": quality(answer),
        "inconsistent": inconsistent(answer),
        "held_out_gain": answer["fit"]["held_out_gain"]["value"],
        "held_out_se": answer["fit"]["held_out_gain"]["se"],
        "seconds": answer["seconds"],
    }


def names_the_force(truth: Mapping[str, Any], answer: Mapping[str, Any]) -> bool:
    """Whether the answer is a formula, and nothing else, for a force outside the catalogue."""
    others, formulas = split(answer["effects"])
    if truth["kind"] != "outside" or answer["verdict"] != "named" or set(others) - set(QUIET):
        return False
    return is_right(formulas, [p["id"] for p in truth["planted"]])


def _outcome(
    truth: Mapping[str, Any],
    verdict: str,
    effects: Sequence[Mapping[str, Any]],
    faults: Sequence[Mapping[str, Any]],
) -> str:
    """The outcome by the rules of its regime."""
    named = [e["id"] for e in effects]
    if "fault" in truth:
        named_faults = [f for f in faults if f.get("action") != "notice"]
        physics = [i for i in named if not i.startswith("recording_")]
        effects_there = {p["id"] for p in truth["planted"]}
        if set(physics) - effects_there and verdict in ("named", "partly"):
            return "wrong name"
        outcome = score_fault(truth["fault"], named_faults)
        return outcome if outcome != "named" or set(physics) == effects_there else "fault alone"
    planted = [p["id"] for p in truth["planted"]]
    told = [AS_FAULT[i] for i in planted if AS_FAULT.get(i) in named]
    if not truth["kind"].startswith("several"):
        if told:
            return outcome_of("fault", told, verdict, named)
        return outcome_of(truth["kind"], planted, verdict, named)
    there = [p["id"] for p in truth["planted"] if not p["outside"]] + told
    outsiders = [p["id"] for p in truth["planted"] if p["outside"]]
    beyond = [i for i in outsiders if AS_FAULT.get(i) not in told]
    outside = bool(beyond)
    right = {f["id"] for f in split(effects)[1] if is_right([f], beyond)}
    if right:  # these stand for the force outside the catalogue
        named = [i for i in named if i not in right]
        outside = verdict != "named"
    if truth["rest_s"] and "recording_start" in named:  # there, and said to be there
        there.append("recording_start")
    outcome = score_several(there, outside, verdict, named)
    return "formula" if right and outcome == "named" else outcome


def outcome_of(kind: str, planted: list[str], verdict: str, named: list[str]) -> str:
    """The outcome in two words."""
    if kind == "control":
        return "quiet" if verdict == "adequate" else "false alarm"
    if verdict == "adequate":
        return "missed"
    if kind == "outside":
        return {"unknown": "unknown outside", "ambiguous": "ambiguous"}.get(verdict, "wrong name")
    if verdict == "named":
        return "named" if set(named) == set(planted) else "wrong name"
    if verdict == "partly":
        return "partly" if set(named) <= set(planted) else "wrong name"
    return "ambiguous" if verdict == "ambiguous" else "called unknown"


def concealed(truth: Mapping[str, Any], answer: Mapping[str, Any]) -> float:
    """Rms of the base fit over the rms of the true noise, minus one."""
    return float(answer["fit"]["before"]["rms_m"] / truth["noise_rms_m"] - 1)


def place(truth: Mapping[str, Any], answer: Mapping[str, Any]) -> bool | None:
    """Whether the place is right: a regime of the truth; for a local force a range that meets it.

    None where there is no place to find, or none was given.
    """
    location = answer["location"]
    if not truth["planted"] or location is None:
        return None
    found = {"entry": "contact", "exit": "contact"}.get(location["regime"], location["regime"])
    regimes = {r for p in truth["planted"] for r in p["regimes"]}
    if found not in regimes:
        return False
    low, high = location["displacement_m"]
    places = [p["place_m"] for p in truth["planted"] if p["place_m"] is not None]
    return all(low <= far and near <= high for near, far in places)


def flat(effect: str, parameters: Mapping[str, Any]) -> dict[str, float]:
    """An effect's numbers by their full names."""
    result: dict[str, float] = {}
    for name, value in parameters.items():
        if isinstance(value, Mapping):
            result.update({f"{effect}.{name}[{key}]": float(v) for key, v in value.items()})
        else:
            result[f"{effect}.{name}"] = float(value)
    return result


def sizes(truth: Mapping[str, Any], answer: Mapping[str, Any]) -> dict[str, bool]:
    """Planted parameter -> whether its 90 % interval holds the truth; phases modulo a turn."""
    result = {}
    values = {n: v for e in answer["effects"] for n, v in e["parameters"].items()}
    for planted in truth["planted"]:
        for name, true in flat(planted["id"], planted["parameters"]).items():
            interval = values.get(name, {}).get("ci90")
            if interval is not None:
                low, high = interval
                if ".phase" in name:
                    true += 2 * np.pi * np.round((0.5 * (low + high) - true) / (2 * np.pi))
                result[name] = bool(low <= true <= high)
    return result


def coverage(truth: Mapping[str, Any], answer: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Base parameter -> inside its 90 % interval, and error in deviations, of both models."""
    result: dict[str, dict[str, Any]] = {}
    before, after = answer["parameters"]["before"], answer["parameters"]["after"]
    for name, true in truth["parameters"].items():
        if name.split("[")[0] not in BASE:
            continue
        row: dict[str, Any] = {}
        for label, table in (("before", before), ("after", after)):
            interval = table.get(name, {}).get("ci90")
            if interval is not None:
                low, high = interval
                sd = max((high - low) / (2 * NORMAL_90), 1e-300)
                row[label] = bool(low <= true <= high)
                row[f"{label}_error"] = float((0.5 * (low + high) - true) / sd)
        result[name] = row
    return result
