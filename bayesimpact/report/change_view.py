"""Parameters before and after: estimates with the digits of their intervals, and what changed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from markupsafe import Markup

from bayesimpact.diagnosis.words import excludes, parameter_shift
from bayesimpact.model.units import (
    decimals,
    number,
    percent,
    readable,
    signed,
    span,
    typeset,
    without_zero,
)
from bayesimpact.report.rows import Z90
from bayesimpact.report.tables import symbol

ALIKE = 10.0  # intervals that differ by less are told with the same digits
NUISANCES = ("y0", "v0", "offset", "gain", "sigma")


def estimate(content: Mapping[str, Any], *, like: Mapping[str, Any] | None = None) -> str:
    """Median with its 90 % interval and unit.

    `like`: another estimate of the same parameter, told with the same digits unless its interval
    is of another order.
    """
    low, high = content["ci90"]
    half = 0.5 * (high - low)
    shown = readable(content["unit"], max(abs(content["median"]), half))
    wider = half if like is None else max(half, 0.5 * (like["ci90"][1] - like["ci90"][0]))
    places = decimals((wider if wider < ALIKE * half else half) * shown.scale)
    places = without_zero(places, low * shown.scale, high * shown.scale)
    ends = span(low, high, shown.scale, places)
    value = number(content["median"] * shown.scale, places)
    return f"{value} ({ends}) {typeset(shown.unit)}".rstrip()


def change_row(
    name: str, before: Mapping[str, Any], after: Mapping[str, Any]
) -> dict[str, str | Markup]:
    """A parameter before and after, and the shift in standard deviations of before.

    Where the interval after is too wide to prove a change, none is told.
    """
    sd = (before["ci90"][1] - before["ci90"][0]) / (2 * Z90)
    moved = (_surely(before, after) - before["median"]) / sd if sd > 0 else float("nan")
    return {
        "name": name,
        "symbol": symbol(name),
        "change": change_words(before, after),
        "before": estimate(before, like=after),
        "after": estimate(after, like=before),
        "shift": _deviations(moved) if excludes(after, before["median"]) else "",
    }


def change_words(before: Mapping[str, Any], after: Mapping[str, Any]) -> str:
    """The change of a parameter in per cent, as far as its interval after proves one."""
    old, shift = before["median"], parameter_shift(before, after)
    if not old:
        return "–"
    if not excludes(after, old):
        return "not clear"
    change = percent((_surely(before, after) - old) / abs(old))
    return f"at least {change}" if shift is not None and shift.least else change


def _surely(before: Mapping[str, Any], after: Mapping[str, Any]) -> float:
    """The value after; of a wide interval the end next to the value before."""
    shift = parameter_shift(before, after)
    if shift is None or not shift.least:
        return float(after["median"])
    return float(min(after["ci90"], key=lambda x: abs(x - before["median"])))


def _deviations(z: float) -> str:
    """A shift in standard deviations: one decimal, three digits where it is far."""
    return signed(z, 1) if abs(z) < 100 else signed(z, 0) if abs(z) < 1000 else "> 1000"
