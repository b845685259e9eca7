"""Which models were tried and how they compare; which effects are ruled out, and down to where."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bayesimpact.model.units import quantity
from bayesimpact.report.diagnosis.limit_view import not_found
from bayesimpact.report.diagnosis.view import probability
from bayesimpact.report.diagnosis.words import title_of
from bayesimpact.report.figures.style import (
    AFTER,
    BLACK,
    GREY,
    ORANGE,
    RED,
    new_figure,
    row_places,
    rows_axis,
    styled,
)
from bayesimpact.report.results import Results

MOST = 12
"""Models shown; the base model always is."""
FREE_FORCE = "one free force"
_ROW, _FRAME = 0.24, 1.05  # in
_LINEAR = 10.0  # nats; beyond that the axis is logarithmic
_ANSWERS = {"negligible": GREY, "absent": AFTER, "cannot tell": ORANGE}


def ranking_figures(results: Results) -> Mapping[str, Figure]:
    """Ranking of the models that were tried, and limits of effects that were not found."""
    diagnosis = results.diagnosis or {}
    figures = {}
    evidence = diagnosis.get("evidence") or {}
    models = ranked(evidence, force=diagnosis.get("verdict") == "unknown")
    if len(models) > 1:
        figures["ranking"] = _ranking(models, chosen(diagnosis), evidence.get("decisive"))
    limits = [x for x in not_found(results) if _known(x)]
    if limits:
        figures["limits"] = _limits(limits)
    return figures


def ranked(
    evidence: Mapping[str, Any], *, force: bool = False
) -> list[tuple[tuple[str, ...], float]]:
    """Effects of every model to show and the log odds by which it trails the best one, best first.

    The best is the most probable one of all that were tried; `force`: a free force among them.
    """
    models = [(tuple(m["effects"]), m["log_odds"]) for m in evidence.get("models", ())]
    if force:
        models.append(((FREE_FORCE,), evidence.get("free_force_log_odds")))
    models = [(effects, odds) for effects, odds in models if odds is not None]
    if () not in [effects for effects, _ in models]:
        models.append(((), 0.0))  # odds are against the base model
    models.sort(key=lambda m: -m[1])
    best = models[0][1]
    kept = models[:MOST]
    base = next(m for m in models if not m[0])
    if base not in kept:
        kept = [*kept[:-1], base]
    return [(effects, best - odds) for effects, odds in kept]


def chosen(diagnosis: Mapping[str, Any]) -> frozenset[str]:
    """Effects of the model that the verdict stands for; a proved filter is in all of them."""
    if diagnosis.get("verdict") == "unknown":
        return frozenset([FREE_FORCE])
    return frozenset(e["id"] for e in diagnosis.get("effects", ()) if e["id"] != "smoothing")


@styled
def _ranking(
    models: Sequence[tuple[tuple[str, ...], float]], picked: frozenset[str], decisive: float | None
) -> Figure:
    labels = ["\n+ ".join(map(title_of, effects)) or "base model" for effects, _ in models]
    rows, end = row_places(labels)
    figure = new_figure(_ROW * (end + 0.5) + _FRAME)
    axis = figure.subplots()
    behind = np.array([b for _, b in models])
    weight = np.exp(-behind) / np.exp(-behind).sum()
    colours = [
        BLACK if not effects else AFTER if picked == set(effects) else GREY for effects, _ in models
    ]
    axis.hlines(rows, 0.0, behind, color=colours, lw=1.2)
    axis.scatter(behind, rows, c=colours, s=28, zorder=3)
    if decisive is not None:
        axis.axvline(decisive, color=RED, lw=1.0, ls=(0, (4, 3)))
        axis.text(decisive, -0.75, " decisive", color=RED, fontsize=8, ha="left", va="center")
    axis.set_xscale("symlog", linthresh=_LINEAR)
    axis.set_xlim(-0.4, max(float(behind.max()), _LINEAR) * 1.4)
    axis.xaxis.set_major_formatter("{x:g}")
    rows_axis(axis, labels, above=1.1)
    axis.set_xlabel("log odds behind the best model (nats)")
    axis.set_title("models tried, best first", loc="left")
    _beside(axis, "probability", [probability(float(w)) for w in weight])
    return figure


def _beside(axis: Axes, title: str, cells: Sequence[str]) -> None:
    """A column of text on the right, a cell at every row."""
    side = axis.secondary_yaxis("right")
    side.set_yticks(axis.get_yticks(), cells)
    side.tick_params(length=0, pad=8)
    side.spines["right"].set_visible(False)
    axis.annotate(
        title, (1.0, 1.0), (8.0, 6.0), xycoords="axes fraction", textcoords="offset points"
    )


def _known(limit: Mapping[str, Any]) -> bool:
    sizes = [limit.get(k) for k in ("upper95", "detection_limit", "practical_size")]
    return all(s is not None and np.isfinite(s) and s > 0 for s in sizes)


@styled
def _limits(limits: Sequence[Mapping[str, Any]]) -> Figure:
    """Upper limit and detection limit of every effect over the size that would matter."""
    rows = np.arange(len(limits))
    figure = new_figure(_ROW * len(limits) + _FRAME + 0.3)
    axis = figure.subplots()
    size = np.array([x["practical_size"] for x in limits])
    upper, detected = (
        np.array([x[k] for x in limits]) / size for k in ("upper95", "detection_limit")
    )
    colours = [_ANSWERS.get(str(x.get("answer")), GREY) for x in limits]
    axis.hlines(rows, np.minimum(upper, detected), np.maximum(upper, detected), color=colours, lw=1)
    axis.scatter(upper, rows, c=colours, s=28, zorder=3, label="95 % upper limit")
    axis.scatter(detected, rows, c=colours, s=60, marker="|", zorder=3, label="detection limit")
    axis.axvline(1.0, color=BLACK, lw=0.9, ls=(0, (4, 3)))
    _frame(axis, limits)
    figure.legend(loc="outside lower center", ncols=2)
    return figure


def _frame(axis: Axes, limits: Sequence[Mapping[str, Any]]) -> None:
    """Names on the left, upper limits in their units on the right."""
    axis.set_xscale("log")
    rows_axis(axis, [title_of(x["id"]) for x in limits])
    axis.set_xlabel("size over the size that would matter in practice")
    axis.set_title("effects that were not found", loc="left")
    _beside(axis, "95 % upper limit", [_size(x) for x in limits])


def _size(limit: Mapping[str, Any]) -> str:
    return quantity(float(limit["upper95"]), str(limit["unit"]))
