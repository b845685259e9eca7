"""Effects that were not found, and how large they could still be."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import Any

from markupsafe import Markup

from bayesimpact.model.units import quantity, significant
from bayesimpact.report.diagnosis.words import title_of
from bayesimpact.report.results import Results
from bayesimpact.report.tables import symbol


def seen(diagnosis: Mapping[str, Any]) -> list[str]:
    """Titles of effects that would explain part of what the chosen model leaves."""
    return [title_of(x["id"]) for x in diagnosis.get("limits", ()) if x.get("answer") == "present"]


def _own_name(parameter: str) -> str | Markup:
    """An effect's parameter without the effect: in words, or c2 and its like as a symbol."""
    return symbol(parameter) if len(parameter) <= 2 else parameter.replace("_", " ")


def not_found(results: Results) -> list[Mapping[str, Any]]:
    """Limits of effects of which nothing is seen: what is seen is not ruled out by its limit.

    Nor is what the model has already: where nothing is named, such a limit is of more of it. Those
    that are ruled out most clearly come first, in the table as in the figure.
    """

    def over_practical(limit: Mapping[str, Any]) -> float:
        upper, practical = limit.get("upper95"), limit.get("practical_size")
        return float(upper / practical) if upper is not None and practical else inf

    limits = (results.diagnosis or {}).get("limits", ())
    acting = {effect.id for effect in results.effects}
    unseen = [x for x in limits if x.get("answer") != "present" and x["id"] not in acting]
    return sorted(unseen, key=over_practical)


def limit_row(limit: Mapping[str, Any], *, remains: bool) -> dict[str, str | Markup]:
    """An effect that was not found and how large it could still be."""
    unit, hidden = str(limit.get("unit", "")), limit.get("hidden_bias") or {}
    upper, detection = limit.get("upper95"), limit.get("detection_limit")
    bias = hidden.get("sd")
    return {
        "title": title_of(str(limit["id"])),
        "parameter": _own_name(str(limit.get("parameter", ""))),
        "upper": "–" if upper is None else quantity(float(upper), unit),
        "detection": "" if detection is None else quantity(float(detection), unit),
        "answer": str(limit.get("answer", "")),
        # what an effect could move is lost in what moves the parameters already
        "bias": ""
        if bias is None or remains
        else Markup("{} sd of {}").format(significant(abs(bias), 2), symbol(hidden["parameter"])),
    }
