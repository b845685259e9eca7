"""All trials of a run together: rates with their uncertainty, confusion matrix, coverage."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from bayesimpact.trial.score.answers import BASE
from bayesimpact.trial.score.rates import rate, rate_in_groups
from bayesimpact.trial.score.summary_strong import added

__all__ = ["confusion", "rate", "rate_in_groups", "summarise"]

Result = Mapping[str, Any]


def summarise(results: Sequence[Result]) -> dict[str, Any]:
    """The content of summary.json."""
    scored = [r for r in results if "score" in r]
    kinds = {k: [r for r in scored if r["truth"]["kind"] == k] for k in _kinds(scored)}
    alarms = [r["score"]["outcome"] == "false alarm" for r in kinds.get("control", [])]
    return {
        "schema": "bayesimpact/trial-summary/1",
        "trials": len(results),
        "failed": sorted(r["seed"] for r in results if "failed" in r),
        "right": {k: _share(rows, lambda s: s["right"]) for k, rows in kinds.items()},
        "outcomes": {
            k: dict(Counter(r["score"]["outcome"] for r in rows)) for k, rows in kinds.items()
        },
        "false_alarms": rate(sum(alarms), len(alarms)),
        "confident_wrong_names": _share(scored, lambda s: s["confident_wrong"]),
        "truth_in_set": _share(
            [r for r in scored if r["truth"]["kind"] in ("single", "pair")],
            lambda s: s["truth_in_set"],
        ),
        "place": _share(
            [r for r in scored if r["score"]["place"] is not None], lambda s: s["place"]
        ),
        "sizes_inside": _sizes(scored),
        "coverage": {label: _coverage(rows) for label, rows in _groups(scored).items()},
        "concealed": _quartiles(r["score"]["concealed"] for r in scored),
        "held_out_gain": _quartiles(
            r["score"]["held_out_gain"]
            for r in scored
            if r["score"]["right"] and r["truth"]["planted"]
        ),
        "seconds": _quartiles(r["score"]["seconds"] for r in scored),
        "processor_seconds": _quartiles(r.get("processor_s") for r in scored),
        "by_rig_kind": _by(scored, lambda r: r["truth"]["rig_kind"]),
        "by_noise": _by(scored, lambda r: r["truth"]["noise_kind"]),
        "by_effect": _by_effect(scored),
        "confusion": confusion(scored),
        "misses": [_miss(r) for r in scored if not r["score"]["right"]],
        **added(results),
    }


def confusion(scored: Iterable[Result]) -> dict[str, dict[str, int]]:
    """Truth -> answer -> how often."""
    table: dict[str, Counter[str]] = {}
    for r in scored:
        table.setdefault(r["score"]["truth"], Counter())[_label(r)] += 1
    return {truth: dict(answers) for truth, answers in sorted(table.items())}


def _label(r: Result) -> str:
    verdict = r["score"]["verdict"]
    return f"ambiguous: {r['score']['named']}" if verdict == "ambiguous" else r["score"]["named"]


def _kinds(scored: Iterable[Result]) -> list[str]:
    return list(dict.fromkeys(r["truth"]["kind"] for r in scored))


def _share(rows: Sequence[Result], hit: Callable[[Mapping[str, Any]], Any]) -> dict[str, Any]:
    return rate(sum(bool(hit(r["score"])) for r in rows), len(rows))


def _sizes(scored: Iterable[Result]) -> dict[str, Any]:
    return rate_in_groups([[*map(bool, r["score"]["sizes"].values())] for r in scored])


def _groups(scored: Sequence[Result]) -> dict[str, list[Result]]:
    """Controls, effects that were named right, and everything with something planted in it."""
    return {
        "controls": [r for r in scored if not r["truth"]["planted"]],
        "named": [r for r in scored if r["score"]["outcome"] == "named"],
        "concealed": [r for r in scored if r["truth"]["planted"]],
        "outside": [r for r in scored if r["truth"]["kind"] == "outside"],
    }


def _coverage(rows: Sequence[Result]) -> dict[str, Any]:
    """Per kind of base parameter: coverage and median error in deviations, of both models."""
    result: dict[str, Any] = {}
    for base in BASE:
        trials = [
            [row for name, row in r["score"]["coverage"].items() if name.split("[")[0] == base]
            for r in rows
        ]
        entry: dict[str, Any] = {}
        for label in ("before", "after"):
            inside = [[bool(row[label]) for row in found if label in row] for found in trials]
            errors = [abs(row[f"{label}_error"]) for t in trials for row in t if label in row]
            if errors:
                entry[label] = rate_in_groups(inside)
                entry[label]["median_error_sd"] = float(np.median(errors))
        if entry:
            result[base] = entry
    return result


def _quartiles(values: Iterable[float | None]) -> dict[str, Any]:
    known = [v for v in values if v is not None]
    if not known:
        return {"count": 0}
    low, median, high = np.percentile(known, [25, 50, 75])
    return {
        "count": len(known),
        "median": float(median),
        "quartiles": [float(low), float(high)],
        "largest": float(max(known)),
        "total": float(sum(known)),
    }


def _by(scored: Sequence[Result], key: Callable[[Result], str]) -> dict[str, Any]:
    names = sorted({key(r) for r in scored})
    return {n: _share([r for r in scored if key(r) == n], lambda s: s["right"]) for n in names}


def _by_effect(scored: Sequence[Result]) -> dict[str, Any]:
    """Effect or fault -> outcomes of all trials that it was planted in, alone or with another."""
    table: dict[str, dict[str, Counter[str]]] = {}
    for r in scored:
        fault = [r["truth"]["fault"]] if "fault" in r["truth"] else []
        for planted in (*r["truth"]["planted"], *fault):
            row = table.setdefault(planted["id"], {})
            row.setdefault(r["truth"]["kind"], Counter())[r["score"]["outcome"]] += 1
    return {k: {kind: dict(c) for kind, c in row.items()} for k, row in sorted(table.items())}


def _miss(r: Result) -> dict[str, Any]:
    score = r["score"]
    keys = ("truth", "verdict", "named", "outcome", "truth_in_set", "strengths")
    rig = {"rig_kind": r["truth"]["rig_kind"], "noise": r["truth"]["noise_kind"]}
    return {"seed": r["seed"], **rig, **{k: score[k] for k in keys}}
