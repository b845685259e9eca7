"""The summary of a run as text."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bayesimpact.trial.score.table_strong import added_text

RIGHT = {
    "control": "controls called adequate",
    "single": "single effects named",
    "pair": "pairs named in full",
    "outside": "outside forces called unknown",
    "fault": "faults named, with their place",
    "fault_single": "fault and effect both named",
    "several": "all named, all in catalogue",
    "several_outside": "partly or unknown, one outside",
}


def summary_text(summary: Mapping[str, Any]) -> str:
    """Rates, coverage, outcomes by effect, and the trials that went wrong with their seeds."""
    lines = [f"{summary['trials']} trials, {len(summary['failed'])} failed", ""]
    lines += [_rate(RIGHT[k], v) for k, v in summary["right"].items()]
    lines += [
        _rate("false alarms", summary["false_alarms"]),
        _rate("confident wrong names", summary["confident_wrong_names"]),
        _rate("truth among the names given", summary["truth_in_set"]),
        _rate("right place", summary["place"]),
        _rate("sizes inside 90 % interval", summary["sizes_inside"]),
        "",
        *_quartiles("base fit over noise, %", summary["concealed"], 100),
        *_quartiles("held-out gain when right, nats", summary["held_out_gain"], 1),
        *_quartiles("seconds per diagnosis", summary["seconds"], 1),
        *_quartiles("seconds of the processor", summary["processor_seconds"], 1),
    ]
    lines += added_text(summary, _rate)
    for group, table in summary["coverage"].items():
        lines += _coverage(group, table)
    lines += ["", *_by("rig", summary["by_rig_kind"]), "", *_by("noise", summary["by_noise"])]
    lines += ["", *_effects(summary["by_effect"]), *_misses(summary)]
    return "\n".join(lines) + "\n"


def _rate(title: str, r: Mapping[str, Any]) -> str:
    if not r["of"]:
        return f"{title:32s}     -"
    low, high = r["interval"]
    return (
        f"{title:32s} {100 * r['rate']:5.1f} %  {r['hits']:4d} of {r['of']:<4d} "
        f"(95 %: {100 * low:.1f} to {100 * high:.1f} %)"
    )


def _quartiles(title: str, q: Mapping[str, Any], factor: float) -> list[str]:
    if not q["count"]:
        return []
    low, high = (factor * x for x in q["quartiles"])
    largest = factor * q["largest"]
    return [
        f"{title:32s} {factor * q['median']:.3g}  ({low:.3g} to {high:.3g}; at most {largest:.3g})"
    ]


def _coverage(group: str, table: Mapping[str, Any]) -> list[str]:
    if not table:
        return []
    lines = ["", f"coverage of 90 % intervals, {group}: share inside (median error in sd)"]
    for name, row in table.items():
        cells = [
            f"{label} {100 * row[label]['rate']:5.1f} % ({row[label]['median_error_sd']:.2f})"
            for label in ("before", "after")
            if label in row
        ]
        lines.append(f"  {name:4s} " + "   ".join(cells))
    return lines


def _by(title: str, table: Mapping[str, Any]) -> list[str]:
    return [_rate(f"right, {title} {name}", row) for name, row in table.items()]


def _effects(table: Mapping[str, Any]) -> list[str]:
    lines = []
    for name, kinds in table.items():
        for kind, outcomes in kinds.items():
            found = ", ".join(f"{count} {o}" for o, count in sorted(outcomes.items()))
            lines.append(f"{name:32s} {kind:8s} {found}")
    return lines


def _misses(summary: Mapping[str, Any]) -> list[str]:
    lines = [""] if summary["misses"] or summary["failed"] else []
    for m in summary["misses"]:
        strengths = " ".join(f"{s:.1f}" for s in m["strengths"])
        also = " (truth in the set)" if m["truth_in_set"] else ""
        lines.append(
            f"seed {m['seed']}: {m['truth']} [{strengths}] on {m['rig_kind']}, {m['noise']}: "
            f"{m['outcome']} {m['named']}{also}"
        )
    lines += [f"seed {seed}: failed" for seed in summary["failed"]]
    return lines
