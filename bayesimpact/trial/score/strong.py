"""Outcomes of trials with several effects at once, and what holds under every verdict.

| truth | right | wrong |
|---|---|---|
| all in the catalogue | named (all, and no other) | wrong name, overconfident, missed |
| a force outside it as well | partly or unknown outside, formula | as above |

A formula of the class of the force outside the catalogue (`score.formulas`) is its name: `partly`
may have it, and `named` with all effects of the catalogue beside it is right. A wrong name is an
effect that is not there, under `named` or `partly`; a near neighbour of one that is there counts as
wrong. Overconfident: no wrong name, but `named` says that nothing is left where something is.
Partly, ambiguous and unknown for effects of the catalogue are abstentions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

SLACK = 1e-6  # relative: two fits that stopped at the same place
MEASURES = ("rms_m", "reduced_chi2")


def score_several(planted: Sequence[str], outside: bool, verdict: str, named: Sequence[str]) -> str:
    """The outcome in two words.

    Parameters
    ----------
    planted : effects of the catalogue that are there, and faults that are allowed to be named
    outside : whether a force outside the catalogue is there too
    named : effects of the answer
    """
    if verdict in ("named", "partly") and not set(named) <= set(planted):
        return "wrong name"
    if verdict == "adequate":
        return "missed"
    if verdict == "named":
        return "named" if set(named) == set(planted) and not outside else "overconfident"
    if outside and verdict in ("partly", "unknown"):
        return f"{verdict} outside"
    return {"partly": "partly", "unknown": "called unknown"}.get(verdict, verdict)


def worse(answer: Mapping[str, Any]) -> list[str]:
    """Measures of fit that are worse after than before."""
    before, after = answer["fit"]["before"], answer["fit"].get("after") or {}
    found = []
    for name in MEASURES:
        old, new = before.get(name), after.get(name)
        if old is not None and new is not None and new > old * (1 + SLACK):
            found.append(name)
    return found


def quality(answer: Mapping[str, Any]) -> dict[str, Any]:
    """Measures of fit before and after, and which of them became worse."""
    before, after = answer["fit"]["before"], answer["fit"].get("after") or {}
    values = {name: [before.get(name), after.get(name)] for name in MEASURES}
    return values | {"worse": worse(answer)}


def inconsistent(answer: Mapping[str, Any]) -> list[str]:
    """Parameters of any table whose interval does not hold their own median."""
    tables = {side: answer["parameters"].get(side) or {} for side in ("before", "after")}
    tables |= {e["id"]: e.get("parameters") or {} for e in answer["effects"]}
    found = []
    for label, table in tables.items():
        for name, row in table.items():
            interval, median = row.get("ci90"), row.get("median")
            if interval is not None and median is not None:
                low, high = interval
                if not low <= median <= high:
                    found.append(f"{label}: {name}")
    return found
