"""The story of a diagnosis as rows of text, from the content of diagnosis.json."""

from __future__ import annotations

import math
from collections.abc import Mapping
from math import isfinite
from typing import Any

from bayesimpact.diagnosis.thresholds import DECISIVE
from bayesimpact.model.units import (
    chi2,
    decimals,
    number,
    p_value,
    p_words,
    quantity,
    signed,
    significant,
    span_of,
    typeset,
)
from bayesimpact.report.diagnosis.change_view import NUISANCES, change_row, estimate
from bayesimpact.report.diagnosis.formula_text import effect_title
from bayesimpact.report.diagnosis.limit_view import limit_row, not_found, seen
from bayesimpact.report.diagnosis.next_words import next_view
from bayesimpact.report.diagnosis.words import titles_of, together
from bayesimpact.report.names import is_fault, of_recordings, own_parameters
from bayesimpact.report.results import Results
from bayesimpact.report.tables import own_symbol

FORMULAS, UNLIKELY = 5, 1e-3
"""Formulas that are shown whatever their probability; the others from this probability on."""

LIKELY = math.exp(-DECISIVE)
"""Probability from which on another explanation stands on the first page: it is a rival."""

VERDICTS = {
    "adequate": "Nothing is missing",
    "named": "What is missing is named",
    "partly": "Part of what is missing is named; something unexplained remains",
    "ambiguous": "Several explanations fit alike",
    "unknown": "The missing physics is outside the catalogue",
}
REGIMES = {
    "free": "the suspension, wherever the mass moves",
    "contact": "contact with the stop",
    "entry": "the beginning of contact",
    "exit": "the end of contact",
    "everywhere": "the whole motion",
    "measurement": "the measuring chain",
}
_FIT_ROWS = {
    "rms_m": ("residual rms", "m"),
    "reduced_chi2": ("reduced χ²", ""),
    "whiteness_p": ("whiteness p", "p"),
    "held_out_log_score": ("held-out log score", "nats"),
}


def diagnosis_view(results: Results) -> dict[str, Any] | None:
    """Everything that the section on the diagnosis shows; None without one."""
    diagnosis, unit, length = results.diagnosis, results.unit, results.length
    if diagnosis is None:
        return None
    before, after = (diagnosis.get("parameters", {}).get(k, {}) for k in ("before", "after"))
    formulas = diagnosis.get("formulas") or ()
    shown = [f for i, f in enumerate(formulas) if i < FORMULAS or _likely(f)]
    return {
        "verdict": verdict_words(diagnosis),
        "changed": diagnosis["verdict"] != "adequate",
        "location": _location(diagnosis, length),
        "effects": [_effect(effect) for effect in diagnosis.get("effects", [])],
        "alternatives": [
            {
                "titles": titles_of(other["id"]),
                "probability": probability(other["probability"]),
                "evidence": _plain(other["delta_log_evidence"], 1),
            }
            for other in diagnosis.get("alternatives", [])
        ],
        "remainder": remainder_rows(diagnosis.get("remainder"), unit, length),
        "formulas": [_formula(f, "N m" if results.angular else "N") for f in shown],
        "formulas_left": len(formulas) - len(shown),
        "fit": _fit(diagnosis.get("fit", {}), unit) + _backbones(results),
        "held_out": _held_out(diagnosis.get("fit", {})),
        "parameters": [
            change_row(name, before[name], after[name])
            for name in before
            if name in after and name.partition("[")[0] not in NUISANCES
        ],
        "limits": [limit_row(limit, remains=results.remains) for limit in not_found(results)],
        "seen": seen(diagnosis),
        "next": next_view(diagnosis.get("next")),
    }


def _likely(formula: Mapping[str, Any]) -> bool:
    return (formula.get("probability") or 0.0) >= UNLIKELY


def verdict_words(diagnosis: Mapping[str, Any]) -> str:
    """The verdict as a heading; faults of recordings are no part of the physics that is missing."""
    verdict = str(diagnosis["verdict"])
    if verdict == "ambiguous" and not likely_others(diagnosis):
        return "One explanation leads, but others are not ruled out"
    families = {effect.get("family") for effect in diagnosis.get("effects") or ()}
    if verdict == "partly" and families == {"recording"}:
        return "Faults of recordings are set aside or corrected; the rest is unknown"
    return VERDICTS.get(verdict, verdict)


def likely_others(diagnosis: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Other explanations that are likely enough to be told first; all are in the details."""
    others = diagnosis.get("alternatives", ())
    return [x for x in others if (x.get("probability") or 0.0) >= LIKELY]


def regime_words(diagnosis: Mapping[str, Any]) -> str:
    """Where the named effects act, the first one first; else where what is unknown does."""
    effects = [e for e in diagnosis.get("effects", ()) if not is_fault(e)]
    own = [(e.get("location") or {}).get("regime") for e in effects]
    regimes = together(str(x) for x in own if x) or [str(diagnosis["location"]["regime"])]
    return "; ".join(REGIMES.get(x, x) for x in regimes)


def _location(diagnosis: Mapping[str, Any], unit: str) -> list[tuple[str, str]]:
    """Lines on the place, in words and ranges; the force where no effect is named to tell it."""
    location = diagnosis.get("location")
    if not location:
        return []
    share = location.get("share")
    part = "" if share is None else f" ({significant(100 * share, 2)} % of what is unexplained)"
    rows = [("regime", regime_words(diagnosis) + part)]
    ranges = (
        ("displacement_m", "displacement", unit),
        ("velocity_m_s", "velocity", f"{unit}/s"),
        ("time_s", "time", "s"),
    )
    for key, words, si in ranges:
        if location.get(key):
            rows.append((words, span_of(location[key], si)))
    for key in ("cases", "recordings"):
        if location.get(key):
            order = ", most first" if len(location[key]) > 1 else ""
            rows.append((key + order, ", ".join(str(x) for x in location[key])))
    if location.get("force_rms_n") is not None and not diagnosis.get("effects"):
        force = quantity(location["force_rms_n"], "N m" if unit == "rad" else "N", 2)
        which = "without" if location.get("beyond_base") else "with"
        rows.append(("force, rms", f"{force}, {which} what base parameters could imitate"))
    return rows


def size_words(size: Mapping[str, Any] | None) -> str:
    """How large an effect is: "3.1 µm, 0.12 % of the deepest indentation"; "" where not known."""
    if not size or size.get("value") is None:
        return ""
    words = quantity(float(size["value"]), str(size.get("unit") or ""), 2)
    if size.get("percent") is not None:
        words += f", {significant(float(size['percent']), 2)}\N{NO-BREAK SPACE}%"
        words += f" of {size['of']}" if size.get("of") else ""
    return words


def remainder_rows(
    remainder: Mapping[str, Any] | None, unit: str, length: str
) -> list[tuple[str, str]]:
    """What stays unexplained beside the named effects, as name and value.

    `unit` is that of the readings, `length` of displacements.
    """
    if not remainder:
        return []
    rows = []
    if remainder.get("rms_m") is not None:
        rows.append(("rms", quantity(float(remainder["rms_m"]), unit, 2)))
    for key, words, after in (
        ("share_of_signal_percent", "of the signal", "\N{NO-BREAK SPACE}%"),
        ("over_noise", "over the noise", ""),
    ):
        if remainder.get(key) is not None:
            rows.append((words, significant(float(remainder[key]), 2) + after))
    if remainder.get("regime"):
        rows.append(("regime", REGIMES.get(str(remainder["regime"]), str(remainder["regime"]))))
    if remainder.get("displacement_m"):
        rows.append(("displacement", span_of(remainder["displacement_m"], length)))
    if remainder.get("recordings"):
        rows.append(("recordings", ", ".join(str(x) for x in remainder["recordings"])))
    if remainder.get("guess"):
        rows.append(("likely", titles_of(str(remainder["guess"]))))
    return rows


def _formula(formula: Mapping[str, Any], force: str) -> dict[str, str]:
    """A formula for a learned force, as a row of the table."""
    peak = {"value": formula.get("peak_n"), "unit": force, "percent": formula.get("percent")}
    return {
        "formula": str(formula.get("formula", "")),
        "unit": typeset(str(formula.get("unit") or "")),
        "sizes": ", ".join(significant(float(x), 3) for x in formula.get("sizes") or ()),
        "peak": size_words(peak),
        "probability": probability(formula.get("probability")),
        "odds": _plain(formula.get("log_odds"), 1),
        "fitted": "" if formula.get("fitted", True) else "scored only",
        "alike": "; ".join(formula.get("alike") or ()),
    }


def _effect(effect: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "title": effect_title(effect["id"], effect.get("title", "")) + of_recordings(effect),
        "family": effect.get("family", ""),
        "size": size_words(effect.get("size")),
        "statement": effect.get("statement", ""),
        "probability": probability(effect.get("probability")),
        "evidence": _plain(effect.get("delta_log_evidence"), 1),
        "parameters": [
            (own_symbol(name), estimate(content)) for name, content in own_parameters(effect)
        ],
    }


def probability(p: float | None) -> str:
    """A probability for a table."""
    if p is None or not isfinite(p):
        return "–"
    if p > 0.995:  # two digits would make it certain
        return "> 0.999" if p > 0.999 else number(p, 3)
    return p_value(p)


def _plain(value: float | None, places: int) -> str:
    return "–" if value is None else signed(value, places)


def _fit(fit: Mapping[str, Any], unit: str) -> list[tuple[str, str, str]]:
    """Figure of merit, before, after."""
    before, after = fit.get("before") or {}, fit.get("after") or {}
    return [
        (words, _merit(before.get(key), kind, unit), _merit(after.get(key), kind, unit))
        for key, (words, kind) in _FIT_ROWS.items()
        if _known(before.get(key)) or _known(after.get(key))
    ]


def _known(value: float | None) -> bool:
    return value is not None and isfinite(value)


def _merit(value: float | None, kind: str, unit: str) -> str:
    if value is None or not isfinite(value):
        return "–"
    if kind == "m":
        return quantity(value, unit)
    if kind == "nats":
        return number(value, 0)
    return p_value(value) if kind == "p" else chi2(value)


def _backbones(results: Results) -> list[tuple[str, str, str]]:
    """Recorded backbone points inside the bands of both models."""
    before, after = results.before_backbone, results.backbone
    if before is None or after is None:
        return []
    cells = [f"{100 * b.inside[-1]:.0f} %, {p_words(b.p_values[-1])}" for b in (before, after)]
    return [("backbone inside its band", cells[0], cells[1])]


def _held_out(fit: Mapping[str, Any]) -> str:
    gain = fit.get("held_out_gain") or {}
    value, error = gain.get("value"), gain.get("se")
    if value is None or error is None or not isfinite(value) or gain.get("of") == 0:
        return ""
    words = f"On recordings held out, the log score changes by {gain_words(gain)} (standard error)"
    if gain.get("improved", value > 2 * error):
        return f"{words}: an improvement."
    if value > 0 and gain.get("of") and gain.get("wins") == gain["of"]:
        return (
            f"{words}. All {gain['of']} are predicted better, but by amounts so different that the "
            "total is uncertain."
        )
    return f"{words}: no clear improvement."


def gain_words(gain: Mapping[str, Any]) -> str:
    """Held-out gain with its standard error, nats: the same digits wherever it is told."""
    value, error = gain.get("value"), gain.get("se")
    if value is None or not isfinite(value):
        return ""
    if error is None or not isfinite(error) or error <= 0:
        return signed(value, 1)
    places = decimals(error, 2)
    return f"{signed(value, places)} ± {number(error, places)}"
