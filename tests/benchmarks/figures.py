"""Draws the evidence page's plots from the stored results: `python tests/benchmarks/figures.py`.

peers.svg: time of one simulation against its error. samplers.svg: effective draws per second.
added.svg: the same for the steps of added effects. trials.svg: what the diagnosis said of every
concealed effect, against its size. detection_power.svg, limits.svg: how large an effect must be to
be found and named, and how that falls with the number of recordings.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

if __name__ == "__main__":  # imports go by the tests' folder, not by this one
    sys.path[0] = str(Path(__file__).resolve().parents[1])

import matplotlib as mpl
from benchmarks.detection_power_figures import limits_figure, power_figure
from benchmarks.tables import stored
from matplotlib.figure import Figure

HERE = Path(__file__).resolve().parent
INK, ACCENT = "0.35", "tab:red"
STYLES = (("o", "C0"), ("s", "C1"), ("D", "C2"), ("v", "C4"), ("^", "C5"), ("<", "C9"))


def peers_figure(content: dict[str, Any]) -> Figure:
    """Work against precision of every peer; ours and the recurrence, being exact, as lines."""
    figure = Figure(figsize=(7.0, 4.0), layout="constrained")
    axis = figure.add_subplot()
    for (marker, colour), (name, points) in zip(STYLES, content["curves"].items(), strict=False):
        errors, seconds = zip(*((p["error_m"], p["seconds"]) for p in points), strict=True)
        axis.loglog(errors, seconds, marker=marker, color=colour, ms=4, lw=1, label=name)
    for name, style in (("plain recurrence", "--"), ("ours", "-")):
        colour = ACCENT if name == "ours" else INK
        height = 1e-6 * content["peers"][name]["us"]
        axis.axhline(height, color=colour, ls=style, lw=1.5, label=f"{name} (exact)")
    axis.axvline(content["accuracy_m"], color=INK, lw=0.5)
    axis.invert_xaxis()
    axis.set_xlabel("largest error, m (more accurate to the right)")
    axis.set_ylabel("one simulation, s")
    axis.set_title(f"{content['samples']} samples, {content['contacts']} contacts", loc="left")
    figure.legend(loc="outside right upper", frameon=False, fontsize="small")
    return figure


def samplers_figure(content: dict[str, Any]) -> Figure:
    """Effective draws per second of every sampler that agrees with ours."""
    rows = {n: r for n, r in content["samplers"].items() if r["ess_per_s"] is not None}
    names = sorted(rows, key=lambda name: rows[name]["ess_per_s"])
    rates = [rows[name]["ess_per_s"] for name in names]
    figure = Figure(figsize=(7.0, 0.8 + 0.4 * len(names)), layout="constrained")
    axis = figure.add_subplot()
    colours = [ACCENT if name.startswith("ours") else INK for name in names]
    bars = axis.barh(names, rates, color=colours, height=0.6)
    axis.bar_label(bars, [f"{rate:,.0f}" for rate in rates], padding=3)
    axis.set_xscale("log")
    axis.set_xlim(min(rates) / 3, max(rates) * 4)
    axis.set_xlabel("effective draws per second, worst parameter")
    axis.spines[["top", "right"]].set_visible(False)
    return figure


ANSWERS = {  # outcome -> label, marker, colour
    "named": ("named", "o", "#0072B2"),
    "ambiguous": ("ambiguous", "D", "#E69F00"),
    "called unknown": ("called unknown", "s", "#8A8A8A"),
    "wrong name": ("wrong name", "X", "#D55E00"),
    "missed": ("missed", "X", "#000000"),
}


def trials_figure(content: dict[str, Any]) -> Figure:
    """One mark per concealed effect of the catalogue: row, size, outcome; open marks in pairs."""
    rows = [a for a in content["answers"] if a["kind"] in ("single", "pair")]
    effects = content["settings"]["effects"]
    figure = Figure(figsize=(7.0, 0.9 + 0.24 * len(effects)), layout="constrained")
    axis = figure.add_subplot()
    for outcome, (label, marker, colour) in ANSWERS.items():
        for alone in (True, False):
            points = [
                (strength, effects.index(effect) + (-0.13 if alone else 0.13))
                for a in rows
                if a["outcome"] == outcome and (a["kind"] == "single") == alone
                for effect, strength in zip(a["planted"], a["strengths"], strict=True)
            ]
            if points:
                x, y = zip(*points, strict=True)
                face = colour if alone else "none"
                words = f"{label}, {'alone' if alone else 'one of two'}"
                axis.scatter(
                    x, y, 22, marker=marker, edgecolors=colour, facecolors=face, label=words
                )
    axis.set_yticks(range(len(effects)), [e.replace("_", " ") for e in effects])
    axis.set_ylim(len(effects) - 0.4, -0.6)
    axis.set_xscale("log")
    axis.xaxis.set_major_formatter("{x:g}")
    axis.set_xlabel("size, detection limits (a filter shows in the noise, however small)")
    axis.grid(axis="y", color="0.9", lw=0.5)
    axis.set_axisbelow(True)
    axis.spines[["top", "right"]].set_visible(False)
    figure.legend(loc="outside upper right", frameon=False, fontsize="small", ncols=3)
    return figure


def added_figure(content: dict[str, Any]) -> Figure:
    """Work against precision of the steps: one line per effect, the package's steps filled."""
    figure = Figure(figsize=(7.0, 4.0), layout="constrained")
    axis = figure.add_subplot()
    here = content["scales"].index(1.0)
    for i, (effect, row) in enumerate(content["effects"].items()):
        errors, costs = [max(e, 1e-16) for e in row["error_m"]], row["ns_per_sample"]
        colour, style = f"C{i % 10}", ("-", "--")[i // 10 % 2]
        axis.loglog(errors, costs[: len(errors)], style, color=colour, lw=1, marker="o", ms=3,
                    mfc="none", label=effect.replace("_", " "))  # fmt: skip
        axis.plot(errors[here], costs[here], "o", color=colour, ms=5)
    axis.axvline(1e-9, color=INK, lw=0.5)
    axis.axhline(40, color=INK, lw=0.5)
    axis.invert_xaxis()
    axis.set_xlabel("largest error, m (more accurate to the right)")
    axis.set_ylabel("ns per sample")
    figure.legend(loc="outside right upper", frameon=False, fontsize="small")
    return figure


FIGURES = {
    "peers": peers_figure,
    "added": added_figure,
    "samplers": samplers_figure,
    "trials": trials_figure,
    "detection_power": power_figure,
    "limits": limits_figure,
}


STORES = {"limits": "detection_power"}  # figure -> result, where the names differ


def draw(folder: Path = HERE) -> None:
    """Write both plots; the same result gives the same file."""
    with mpl.rc_context({"svg.hashsalt": "bayesimpact", "svg.fonttype": "none"}):
        for name, figure in FIGURES.items():
            figure(stored(STORES.get(name, name))).savefig(
                folder / f"{name}.svg", metadata={"Date": None}
            )


if __name__ == "__main__":
    draw()
