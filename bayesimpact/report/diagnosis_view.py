"""The story of a diagnosis as rows of text, from the content of diagnosis.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

from markupsafe import Markup

from bayesimpact.report.results import Results
from bayesimpact.report.rows import Z90
from bayesimpact.report.tables import signed, span, symbol
from bayesimpact.report.units import (
    decimals,
    number,
    p_value,
    p_words,
    readable,
    significant,
    typeset,
)

Rows = list[dict[str, Any]]

VERDICTS = {
    "adequate": "Nothing is missing",
    "named": "What is missing is named",
    "ambiguous": "Several effects fit alike",
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
    diagnosis, unit = results.diagnosis, results.unit
    if diagnosis is None:
        return None
    before, after = (diagnosis.get("parameters", {}).get(k, {}) for k in ("before", "after"))
    return {
        "verdict": VERDICTS.get(diagnosis["verdict"], diagnosis["verdict"]),
        "changed": diagnosis["verdict"] != "adequate",
        "location": _location(diagnosis.get("location"), unit),
        "effects": [_effect(effect) for effect in diagnosis.get("effects", [])],
        "alternatives": [
            {
                "id": other["id"],
                "probability": probability(other["probability"]),
                "evidence": _plain(other["delta_log_evidence"], 1),
            }
            for other in diagnosis.get("alternatives", [])
        ],
        "fit": _fit(diagnosis.get("fit", {}), unit) + _backbones(results),
        "held_out": _held_out(diagnosis.get("fit", {})),
        "parameters": [
            _shift(name, before[name], after[name])
            for name in before
            if name in after and name.partition("[")[0] not in NUISANCES
        ],
        "limits": [_limit(limit) for limit in diagnosis.get("limits", [])],
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
    places = decimals((high - low) * shown.scale)
    return f"{span(low, high, shown.scale, places)} {typeset(shown.unit)}"


def amount(value: float, unit: str, digits: int = 3) -> str:
    """A size with its unit."""
    shown = readable(unit, abs(value))
    return f"{significant(value * shown.scale, digits)} {typeset(shown.unit)}"


def _effect(effect: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "id": effect["id"],
        "family": effect.get("family", ""),
        "statement": effect.get("statement", ""),
        "probability": probability(effect.get("probability")),
        "evidence": _plain(effect.get("delta_log_evidence"), 1),
        "parameters": [
            (symbol(name), estimate(content))
            for name, content in effect.get("parameters", {}).items()
        ],
    }


def estimate(content: Mapping[str, Any], *, median: bool = True) -> str:
    """Median with its 90 % interval and unit, or the interval alone."""
    low, high = content["ci90"]
    half = 0.5 * (high - low)
    shown = readable(content["unit"], max(abs(content["median"]), half))
    places = decimals(half * shown.scale)
    ends = span(low, high, shown.scale, places)
    if not median:
        return f"{ends} {typeset(shown.unit)}".rstrip()
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
    return p_value(value) if kind == "p" else significant(value, 4)


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
    words = (
        f"On recordings held out, the log score changes by {signed(value, 1)} ± {number(error, 1)} "
        "(standard error)"
    )
    improved = gain.get("improved", value > 2 * error)
    return f"{words}: an improvement." if improved else f"{words}: no clear improvement."


def _shift(
    name: str, before: Mapping[str, Any], after: Mapping[str, Any]
) -> dict[str, str | Markup]:
    """A parameter before and after, and the shift in standard deviations of before."""
    sd = (before["ci90"][1] - before["ci90"][0]) / (2 * Z90)
    moved = (after["median"] - before["median"]) / sd if sd > 0 else float("nan")
    return {
        "name": name,
        "symbol": symbol(name),
        "before": estimate(before),
        "after": estimate(after),
        "honest": estimate({**after, "ci90": after["ci90_honest"]}, median=False)
        if after.get("ci90_honest")
        else "",
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
