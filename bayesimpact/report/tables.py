"""Rows of the report's tables, as text: every number with the digits that its error allows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np
from markupsafe import Markup, escape

from bayesimpact.model.units import (
    Display,
    chi2,
    decimals,
    display,
    number,
    p_value,
    readable,
    reading,
    signed,
    significant,
    span,
    typeset,
)
from bayesimpact.report.diagnosis.formula_text import letter, written
from bayesimpact.report.digits import Digits, places
from bayesimpact.report.names import split
from bayesimpact.report.results import Results, Row

GAIN = "gain"  # of a probe
HIGH_PASS_STATE = "high_pass_state"
WITHOUT = {GAIN: "1, known", HIGH_PASS_STATE: "no high-pass"}
"""What stands for a nuisance that not every recording has."""


@dataclass(frozen=True)
class Cell:
    """A value, a smaller remark beneath it."""

    text: str
    remark: str = ""


@dataclass(frozen=True)
class ParameterView:
    """One parameter as the table shows it."""

    symbol: Markup
    meaning: str
    unit: str
    median: str
    interval: str
    total: str
    ratio: str
    ratio_interval: str
    ratio_unit: str
    references: tuple[Cell, ...]
    prior: str


def symbol(name: str) -> Markup:
    """A parameter's name for HTML: "k2[1]" with an italic k and a lowered 2, after its effect."""
    effect, _, _ = split(name)
    own = own_symbol(name)
    return Markup("<span class=effect>{}:</span> {}").format(effect, own) if effect else own


def own_symbol(name: str) -> Markup:
    """The same where it is known which effect the parameter belongs to."""
    _, own, key = split(name)
    known = letter(name.partition("[")[0])
    if known is not None:
        html = Markup("<i>{}</i>").format(known)
    elif own == "sigma":
        html = Markup("<i>σ</i>")
    elif own[-1].isdigit() and len(own) == 2:
        html = Markup("<i>{}</i><sub>{}</sub>").format(own[:-1], own[-1])
    elif len(own) == 1:
        html = Markup("<i>{}</i>").format(own)
    else:
        html = escape(own)
    return html + escape(key)


def parameter_views(results: Results, rows: tuple[Row, ...]) -> list[ParameterView]:
    """Rows of the table of parameters; reference cells in the order of `reference_labels`."""
    labels = reference_labels(rows)
    return [_view(row, labels, results.digits(row)) for row in rows]


def reference_labels(rows: tuple[Row, ...]) -> list[str]:
    """Labels of all reference values, in order of first appearance."""
    return list(dict.fromkeys(label for row in rows for label in row.references))


def _view(row: Row, labels: list[str], shown: Digits) -> ParameterView:
    total_places = places(row.median * shown.scale, [end * shown.scale for end in row.total90])
    over_mass = readable(row.ratio_unit, abs(row.ratio[0]))
    ratio, *ends = (over_mass.scale * x for x in row.ratio)
    ratio_places = places(ratio, ends)
    return ParameterView(
        symbol=own_symbol(row.name),
        meaning=written(_meaning(row)),
        unit=typeset(shown.unit),
        median=shown.value(row.median),
        interval=shown.interval(row.ci90),
        total=span(*row.total90, shown.scale, total_places),
        ratio=number(ratio, ratio_places) if row.ratio_unit else "",
        ratio_interval=span(ends[0], ends[1], 1.0, ratio_places) if row.ratio_unit else "",
        ratio_unit=typeset(over_mass.unit),
        references=tuple(_reference(row, label, shown) for label in labels),
        prior=row.prior,
    )


def _meaning(row: Row) -> str:
    """What a parameter is; of an effect's, whose own name stands beside it, which effect."""
    _, own, _ = split(row.name)
    return (
        row.meaning.rpartition(f": {own}")[0] or row.meaning
        if row.role == "effect"
        else row.meaning
    )


def _reference(row: Row, label: str, shown: Digits) -> Cell:
    """A value to compare with, and how far the median lies from it."""
    if label not in row.references:
        return Cell("")
    value = row.references[label]
    return Cell(shown.value(value), deviation(row, value))


def deviation(row: Row, value: float) -> str:
    """Median minus a reference: in standard deviations when near, in per cent when far."""
    sd = row.posterior_sd if isfinite(row.posterior_sd) else row.sd
    off = row.median - value
    if sd > 0 and abs(off) < 10 * sd:
        return f"{signed(off / sd, 1)} sd"
    return f"{signed(100 * off / abs(value), 2)} %" if value else ""


def recording_views(results: Results) -> list[dict[str, str]]:
    """Rows of the table of recordings."""
    rows = []
    for r in results.recordings:
        shown = display(r.unit, max(results.rms, results.noise.level) * r.scale)
        scale = reading(r.quantity, r.unit).scale
        rows.append(
            {
                "name": r.name,
                "case": r.case,
                "samples": number(r.count, 0),
                "rate": significant(1 / r.interval, 4),
                "duration": significant((r.samples.size - 1) * r.interval, 3),
                "largest": significant(float(np.max(np.abs(r.samples))) * scale, 3),
                "rms": significant(r.rms * shown.scale, 3),
                "share": significant(100 * r.share, 2),
                "chi2": chi2(r.reduced_chi2),
                "white": p_value(r.whiteness_p),
            }
        )
    return rows


def residual_unit(results: Results) -> str:
    """Unit of the residuals in the table of recordings."""
    return typeset(display(results.unit, max(results.rms, results.noise.level)).unit)


def release_views(results: Results) -> list[dict[str, str]]:
    """Initial conditions and rest readings of every recording: median ± half of the interval.

    Channels of one motion have one state; units stand by the numbers where they differ.
    """
    columns = release_columns(results)
    rows, known = [], {row.name for row in results.rows}
    for r in results.recordings:
        cells = {"name": r.name, "case": r.case}
        for key, (scale, unit) in columns.items():
            owner = (r.state or r.name) if key in ("y0", "v0") else r.name
            if key in WITHOUT and f"{key}[{owner}]" not in known:
                cells[key] = WITHOUT[key]
                continue
            row = results.row(f"{key}[{owner}]")
            shown = Display(scale, "") if unit else display(row.unit, _largest([row]))
            shown = Display(1.0, "") if row.unit == "-" else shown
            half = _half(row) * shown.scale
            own = decimals(half)
            text = f"{number(row.median * shown.scale, own)} ± {number(half, own)}"
            cells[key] = f"{text} {typeset(shown.unit)}".rstrip()
        rows.append(cells)
    return rows


def _half(row: Row) -> float:
    return 0.5 * (row.ci90[1] - row.ci90[0])


def _largest(rows: Sequence[Row]) -> float:
    return float(np.max([max(abs(row.median), _half(row)) for row in rows]))


def release_columns(results: Results) -> dict[str, tuple[float, str]]:
    """Nuisance -> (scale, unit) that suits all recordings; no unit where theirs differ."""
    columns = {}
    for key in ("y0", "v0", "offset", GAIN, HIGH_PASS_STATE):
        rows = [row for row in results.rows if row.name.startswith(f"{key}[")]
        if len({row.unit for row in rows}) > 1:
            columns[key] = (1.0, "")
        elif rows:
            shown = display(rows[0].unit, _largest(rows))
            columns[key] = (shown.scale, typeset(shown.unit))
    return columns


def sampler_views(results: Results) -> list[dict[str, str | Markup]]:
    """Convergence figures of the parameters of interest, and the worst of all the others."""
    s = results.sampler
    if s is None:
        return []
    shown = [
        i for i, name in enumerate(s.names) if results.row(name).role in ("physical", "effect")
    ]
    others = [i for i in range(len(s.names)) if i not in shown]
    rows = [(symbol(s.names[i]), [i]) for i in shown]
    if others:
        rows.append((Markup("worst of {} others").format(len(others)), others))
    return [
        {
            "symbol": words,
            "tau": significant(float(s.tau[index].max()), 2),
            "bulk": number(float(s.ess_bulk[index].min()), 0),
            "tail": number(float(s.ess_tail[index].min()), 0),
            "rhat": number(float(s.rhat[index].max()), 4),
        }
        for words, index in rows
    ]


def prior_views(results: Results) -> list[tuple[Markup, str]]:
    """Parameter and prior; nuisances and coefficients that share one prior on one row."""
    views: dict[tuple[str, str], list[Row]] = {}
    for row in results.rows:
        views.setdefault((_family(row), row.prior), []).append(row)
    words = []
    for (family, prior), rows in views.items():
        name = symbol(rows[0].name if len(rows) == 1 else family)
        many = "coefficients" if rows[0].role == "learned" else "recordings"
        words.append((name if len(rows) == 1 else name + escape(f" of {len(rows)} {many}"), prior))
    return words


def _family(row: Row) -> str:
    """What rows have to share to stand together: all but the recording, or all but the number."""
    if row.role in ("nuisance", "noise"):
        return row.name.partition("[")[0]
    return "learned_force" if row.role == "learned" else row.name
