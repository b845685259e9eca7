"""Parameters before and after: estimates with the digits of their intervals, and what changed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from markupsafe import Markup

from bayesimpact.inference.fit import Z90
from bayesimpact.model.units import percent, signed
from bayesimpact.report.diagnosis.words import excludes, parameter_shift
from bayesimpact.report.digits import digits
from bayesimpact.report.tables import symbol

UNTOLD = ("–", "not clear")
"""What stands for a change where none is proved."""
NUISANCES = ("y0", "v0", "offset", "gain", "high_pass_state", "sigma")


def estimate(content: Mapping[str, Any], *, like: Mapping[str, Any] | None = None) -> str:
    """Median with its 90 % interval and unit; `like` is another estimate of the same parameter."""
    others = () if like is None else (like,)
    shown = digits(content["unit"], content["median"], content["ci90"], others)
    return shown.estimate(content["median"], content["ci90"])


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
        return UNTOLD[0]
    if not excludes(after, old):
        return UNTOLD[1]
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
