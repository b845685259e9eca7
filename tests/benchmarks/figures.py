"""Draws the README's two plots from the stored results: `python tests/benchmarks/figures.py`.

peers.svg: time of one simulation against its error. samplers.svg: effective draws per second.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

if __name__ == "__main__":  # imports go by the tests' folder, not by this one
    sys.path[0] = str(Path(__file__).resolve().parents[1])

import matplotlib as mpl
from benchmarks.readme import stored
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


FIGURES = {"peers": peers_figure, "samplers": samplers_figure}


def draw(folder: Path = HERE) -> None:
    """Write both plots; the same result gives the same file."""
    with mpl.rc_context({"svg.hashsalt": "bayesimpact", "svg.fonttype": "none"}):
        for name, figure in FIGURES.items():
            figure(stored(name)).savefig(folder / f"{name}.svg", metadata={"Date": None})


if __name__ == "__main__":
    draw()
