"""One trial in one line."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def trial_line(result: Mapping[str, Any]) -> str:
    """Seed, truth, answer, outcome, chi2 before and after, coverage, seconds; or what failed."""
    truth, seed = result.get("truth"), result["seed"]
    text = f"{seed}"
    if truth is not None:
        planted = " + ".join(p["id"] for p in truth["planted"]) or "nothing"
        if "fault" in truth:
            fault = f"{truth['fault']['id']} in {truth['fault']['recording']}"
            planted = f"{fault} + {planted}" if truth["planted"] else fault
        text += f" {truth['kind']} | {truth['rig_kind']}, {truth['noise_kind']}"
        if "misfit" in truth:
            text += f", misfit {truth['misfit']:.3g}"
        if truth.get("rest_s"):
            text += ", rest"
        text += f" | {planted}"
    if "score" not in result:
        return f"{text} | CRASH in {result.get('stage', '?')}: {_where(result['failed'])}"
    score, answer = result["score"], result["answer"]
    named = " + ".join(e["id"] for e in answer["effects"])
    rows = [row["after"] for row in score["coverage"].values() if "after" in row]
    text += f" | {answer['verdict']}: {named or '-'} | {score['outcome'].upper()}"
    before, after = score.get("quality", {}).get("reduced_chi2", (None, None))
    text += f" | chi2 {_short(before)} -> {_short(after)}"
    if score.get("quality", {}).get("worse"):
        text += " WORSE"
    if score.get("inconsistent"):
        text += f" MEDIAN OUTSIDE {len(score['inconsistent'])}"
    return f"{text} | inside {sum(rows)} of {len(rows)} | {answer['seconds']:.0f} s"


def _short(value: float | None) -> str:
    return "?" if value is None else f"{value:.4g}"


def _where(trace: str) -> str:
    """The last place of a traceback, and the error."""
    lines = [line.strip() for line in trace.strip().splitlines()]
    places = [line for line in lines if line.startswith("File ")]
    last = places[-1].rpartition("/")[2] if places else ""
    return f"{last} {lines[-1] if lines else ''}".strip()
