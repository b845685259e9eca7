"""The story of a diagnosis as rows of text, from the content of diagnosis.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

from markupsafe import Markup

from bayesimpact.report.next_words import next_view
from bayesimpact.report.results import Results
from bayesimpact.report.rows import Z90
from bayesimpact.report.tables import span, symbol
from bayesimpact.report.units import (
    chi2,
    decimals,
    number,
    p_value,
    p_words,
    percent,
    readable,
    signed,
    significant,
    typeset,
)
from bayesimpact.report.units import quantity as amount

__all__ = ["amount"]

Rows = list[dict[str, Any]]

VERDICTS = {
    "adequate": "Nothing is missing",
    "named": "What is missing is named",
    "partly": "Part of what is missing is named; something unexplained remains",
    "ambiguous": "Several explanations fit alike",
    "unknown": "The missing physics is outside the catalogue",
}
REGIMES = {
    "free": "free flight",
    "contact": "contact with the stop",
    "entry": "the beginning of contact",
    "exit": "the end of contact",
    "everywhere": "everywhere",
    "measurement": "the measuring chain",
}
NUISANCES = ("y0", "v0", "offset", "sigma")
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
    return {
        "verdict": VERDICTS.get(diagnosis["verdict"], diagnosis["verdict"]),
        "changed": diagnosis["verdict"] != "adequate",
        "location": _location(diagnosis.get("location"), length),
        "effects": [_effect(effect) for effect in diagnosis.get("effects", [])],
        "alternatives": [
            {
                "id": other["id"],
                "probability": probability(other["probability"]),
                "evidence": _plain(other["delta_log_evidence"], 1),
            }
            for other in diagnosis.get("alternatives", [])
        ],
        "remainder": remainder_rows(diagnosis.get("remainder"), unit, length),
        "formulas": [
            _formula(formula, "N m" if results.angular else "N")
            for formula in diagnosis.get("formulas") or ()
        ],
        "fit": _fit(diagnosis.get("fit", {}), unit) + _backbones(results),
        "held_out": _held_out(diagnosis.get("fit", {})),
        "parameters": [
            _shift(name, before[name], after[name])
            for name in before
            if name in after and name.partition("[")[0] not in NUISANCES
        ],
        "limits": [_limit(limit) for limit in diagnosis.get("limits", [])],
        "next": next_view(diagnosis.get("next")),
    }


def _location(location: Mapping[str, Any] | None, unit: str) -> list[tuple[str, str]]:
    """Lines on the place, in words and ranges."""
    if not location:
        return []
    regime = str(location["regime"])
    share = location.get("share")
    part = "" if share is None else f" ({significant(100 * share, 2)} % of what is unexplained)"
    rows = [("regime", REGIMES.get(regime, regime) + part)]
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
            rows.append((key, ", ".join(str(x) for x in location[key])))
    if location.get("force_rms_n") is not None:
        rows.append(
            ("force, rms", amount(location["force_rms_n"], "N m" if unit == "rad" else "N"))
        )
    return rows


def span_of(ends: Sequence[float], unit: str) -> str:
    """A range with its unit."""
    low, high = ends
    shown = readable(unit, max(abs(low), abs(high)))
    places = decimals((high - low) * shown.scale, 2)
    return f"{span(low, high, shown.scale, places)} {typeset(shown.unit)}"


def size_words(size: Mapping[str, Any] | None) -> str:
    """How large an effect is: "3.1 µm, 0.12 % of the deepest indentation"; "" where not known."""
    if not size or size.get("value") is None:
        return ""
    words = amount(float(size["value"]), str(size.get("unit") or ""))
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
        rows.append(("rms", amount(float(remainder["rms_m"]), unit)))
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
        rows.append(("likely", str(remainder["guess"])))
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
        "id": effect["id"],
        "title": effect.get("title") or str(effect["id"]).replace("_", " "),
        "family": effect.get("family", ""),
        "size": size_words(effect.get("size")),
        "statement": effect.get("statement", ""),
        "probability": probability(effect.get("probability")),
        "evidence": _plain(effect.get("delta_log_evidence"), 1),
        "parameters": [
            (symbol(name), estimate(content))
            for name, content in effect.get("parameters", {}).items()
        ],
    }


def estimate(content: Mapping[str, Any], *, like: Mapping[str, Any] | None = None) -> str:
    """Median with its 90 % interval and unit.

    `like`: another estimate of the same parameter, told with the same digits.
    """
    low, high = content["ci90"]
    half = 0.5 * (high - low)
    shown = readable(content["unit"], max(abs(content["median"]), half))
    wider = half if like is None else max(half, 0.5 * (like["ci90"][1] - like["ci90"][0]))
    places = decimals(wider * shown.scale)
    ends = span(low, high, shown.scale, places)
    value = number(content["median"] * shown.scale, places)
    return f"{value} ({ends}) {typeset(shown.unit)}".rstrip()


def probability(p: float | None) -> str:
    """A probability for a table."""
    if p is None or not isfinite(p):
        return "–"
    return "> 0.999" if p > 0.999 else p_value(p)


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
        return amount(value, unit)
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
    improved = gain.get("improved", value > 2 * error)
    return f"{words}: an improvement." if improved else f"{words}: no clear improvement."


def gain_words(gain: Mapping[str, Any]) -> str:
    """Held-out gain with its standard error, nats: the same digits wherever it is told."""
    value, error = gain.get("value"), gain.get("se")
    if value is None or not isfinite(value):
        return ""
    if error is None or not isfinite(error) or error <= 0:
        return signed(value, 1)
    places = decimals(error, 2)
    return f"{signed(value, places)} ± {number(error, places)}"


def _shift(
    name: str, before: Mapping[str, Any], after: Mapping[str, Any]
) -> dict[str, str | Markup]:
    """A parameter before and after, and the shift in standard deviations of before."""
    sd = (before["ci90"][1] - before["ci90"][0]) / (2 * Z90)
    moved = (after["median"] - before["median"]) / sd if sd > 0 else float("nan")
    old = before["median"]
    return {
        "name": name,
        "symbol": symbol(name),
        "change": percent((after["median"] - old) / abs(old)) if old else "–",
        "before": estimate(before, like=after),
        "after": estimate(after, like=before),
        "shift": signed(moved, 1) if abs(moved) < 1000 else f"{significant(moved, 2)}",
    }


def _limit(limit: Mapping[str, Any]) -> dict[str, str]:
    """An effect that was not found and how large it could still be."""
    unit, hidden = str(limit.get("unit", "")), limit.get("hidden_bias") or {}
    upper, detection = limit.get("upper95"), limit.get("detection_limit")
    bias = hidden.get("sd")
    return {
        "id": str(limit["id"]),
        "parameter": str(limit.get("parameter", "")).replace("_", " "),
        "upper": "–" if upper is None else amount(float(upper), unit),
        "detection": "" if detection is None else amount(float(detection), unit),
        "answer": str(limit.get("answer", "")),
        "bias": "" if bias is None else f"{significant(abs(bias), 2)} sd of {hidden['parameter']}",
    }
