"""The words of a fleet's page."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from bayesimpact.fleet.compare import Comparison, Series, axes
from bayesimpact.fleet.plan import Plan
from bayesimpact.fleet.run import Row, done
from bayesimpact.fleet.trend import Trend
from bayesimpact.model.units import decimals, number, readable, typeset
from bayesimpact.report.figures.save import file_name
from bayesimpact.report.figures.series import Panel
from bayesimpact.report.fleet_page import write_fleet_page
from bayesimpact.report.write import REPORT_FILE


def write_page(plan: Plan, rows: Sequence[Row], found: Comparison, out: Path) -> Path:
    """report.html and its figures in `out`."""
    units = {s.parameter: s.unit for s in found.series}
    content: dict[str, Any] = {
        "name": plan.name,
        "headline": headline(plan, rows, found),
        "changes": [_change(t, units[t.parameter]) for t in found.trends],
        "populations": [
            {
                "parameter": p.parameter,
                "campaigns": p.campaigns,
                **_three("mean", p.mean, units[p.parameter]),
                **_three("scatter", p.scatter, units[p.parameter]),
            }
            for p in found.populations
        ],
        "campaigns": [
            _line(s, row, found, out) for s, row in zip(plan.sessions, rows, strict=True)
        ],
    }
    return write_fleet_page(content, panels(plan, found), out)


def headline(plan: Plan, rows: Sequence[Row], found: Comparison) -> str:
    """What the campaigns say together, in a few sentences."""
    sound = len(done(rows))
    words = [f"{sound} of {len(plan.sessions)} campaigns done."]
    changing = list(dict.fromkeys(t.parameter for t in found.trends))
    if changing:
        told = "; ".join(_sentence(t) for t in found.trends)
        words.append(f"Not all is constant: {told}.")
    elif sound > 1:
        words.append("No parameter drifts or jumps.")
    if found.unlike:
        some = ", ".join(found.unlike[:5]) + (" and others" if len(found.unlike) > 5 else "")
        words.append(f"Other physics than in most campaigns: {some}.")
    return " ".join(words)


def _sentence(trend: Trend) -> str:
    if trend.kind == "step":
        return f"{trend.parameter} steps {_where(trend)}"
    return f"{trend.parameter} drifts with {trend.along.replace('_', ' ')}"


def _where(trend: Trend) -> str:
    if trend.kind == "drift":
        return ""
    shown = [_day(x) if trend.along == "date" else f"{x:g}" for x in trend.place]
    return f"between {shown[0]} and {shown[1]}"


def _day(days: float) -> str:
    moment = datetime(1970, 1, 1) + timedelta(days=days)
    return moment.strftime("%Y-%m-%d" if days == int(days) else "%Y-%m-%d %H:%M")


def _change(trend: Trend, unit: str) -> dict[str, str]:
    per = {"date": " per day", "order": " per campaign"}.get(trend.along, f" per {trend.along}")
    ending = per if trend.kind == "drift" else ""
    return {
        "parameter": trend.parameter,
        "kind": f"{trend.kind} with {trend.along.replace('_', ' ')}",
        "amount": _value(trend.amount, trend.error, unit) + ending,
        "interval": _interval(trend.ci90, trend.error, unit),
        "where": _where(trend),
        "p": f"{trend.p_value:.2g}",
    }


def _three(name: str, values: tuple[float, float, float], unit: str) -> dict[str, str]:
    half = 0.5 * (values[2] - values[0])
    return {
        name: _value(values[1], half, unit),
        f"{name}_interval": _interval((values[0], values[2]), half, unit, abs(values[1])),
    }


def _value(value: float, half: float, unit: str) -> str:
    shown = readable(unit, abs(value))
    places = decimals(half * shown.scale) if half > 0 else 3
    return f"{number(value * shown.scale, places)} {typeset(shown.unit)}".strip()


def _interval(ends: tuple[float, float], half: float, unit: str, size: float | None = None) -> str:
    shown = readable(unit, size if size is not None else abs(0.5 * (ends[0] + ends[1])))
    places = decimals(half * shown.scale) if half > 0 else 3
    low, high = (number(x * shown.scale, places) for x in ends)
    return f"{low} to {high}"


def _line(session: Any, row: Row, found: Comparison, out: Path) -> dict[str, str]:
    failed = row.get("failed")
    remark = f"failed: {failed.strip().splitlines()[-1]}" if failed else ""
    if session.name in found.unlike:
        remark = "other physics than most"
    if not failed and not row["converged"]:
        remark = ", ".join(filter(None, [remark, "not converged"]))
    folder = f"campaigns/{file_name(session.name)}/{REPORT_FILE}"
    link = quote(folder) if not failed and (out / folder).exists() else ""
    return {
        "name": session.name,
        "date": session.date,
        "answer": "" if failed else row["verdict"] or "fitted",
        "effects": "" if failed else " + ".join(row["effects"]),
        "remark": remark,
        "link": link,
    }


def panels(plan: Plan, found: Comparison) -> list[Panel]:
    """Every parameter along the date or the order, and along a condition that it goes with."""
    places = axes(plan)
    first = next(iter(places))
    chosen = [(s, first) for s in found.series]
    chosen += [
        (s, t.along)
        for s in found.series
        for t in found.trends
        if t.parameter == s.parameter and t.along != first
    ]
    trends = {(t.parameter, t.along): t for t in found.trends}
    return [_panel(s, a, places[a][s.at], trends.get((s.parameter, a))) for s, a in chosen]


def _panel(series: Series, along: str, x: np.ndarray, trend: Trend | None) -> Panel:
    order = np.argsort(x, kind="stable")
    x = x[order]
    estimates, low, high = (v[order] for v in (series.estimates, series.low, series.high))
    change = None
    if trend is not None:
        weights = 1.0 / np.maximum(series.errors[order], 1e-300) ** 2
        shape = x if trend.kind == "drift" else (x >= trend.place[1]).astype(float)
        level = np.average(estimates - trend.amount * shape, weights=weights)
        change = level + trend.amount * shape
    return Panel(
        series.parameter, series.unit, along, along == "date", x, estimates, low, high, change
    )
