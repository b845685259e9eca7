"""What the examples share: their arguments, their figures, and the nine bundled recordings."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bayesimpact.data.bundled import bundled_campaign
from bayesimpact.data.campaign import Campaign
from bayesimpact.data.read import load_campaign
from bayesimpact.data.recording import Recording
from bayesimpact.report.figures.style import styled

__all__ = ["BLACK", "COLOURS", "DASHES", "GREY", "K2", "MASS", "TABLE_2", "arguments", "of_case"]
__all__ += ["panels", "paper_campaign", "save", "styled"]

# Okabe and Ito's palette, one colour per elastic beam, one line style per recording.
COLOURS = {"1": "#0072B2", "2": "#D55E00", "3": "#009E73"}
GREY, BLACK = "#8A8A8A", "#000000"
DASHES = ("-", (0, (5, 1.5)), (0, (1.5, 1.5)))

#: Table 2 of Tian et al.: what the bundled recordings were simulated with. SI units.
MASS = 0.503
TABLE_2 = {"c1": 0.148, "k1": 808.556, "c2": 2.085, "g": 1.1e-3}
K2 = {"1": 5350.156, "2": 4776.275, "3": 2959.249}


def arguments(question: str, argv: Sequence[str] | None) -> argparse.Namespace:
    """Every example takes --out FOLDER and --quick."""
    parser = argparse.ArgumentParser(description=question)
    parser.add_argument("--out", type=Path, default=Path("figures-of-examples"), metavar="FOLDER")
    parser.add_argument("--quick", action="store_true", help="coarser, for a first look")
    return parser.parse_args(argv)


def panels(
    rows: int, columns: int, size: tuple[float, float], share: str = ""
) -> tuple[Figure, list[Axes]]:
    """A figure and its panels, row by row; `share` names the axes that are shared ("x", "y")."""
    figure = Figure(figsize=size, layout="constrained", dpi=150)
    axes = figure.subplots(rows, columns, squeeze=False, sharex="x" in share, sharey="y" in share)
    return figure, list(axes.ravel())


def save(figure: Figure, folder: Path, name: str) -> Path:
    """Write the figure as PNG and say where."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.png"
    figure.savefig(path)
    print(f"figure: {path}")
    return path


def paper_campaign() -> Campaign:
    """The nine bundled recordings."""
    return load_campaign(bundled_campaign("paper"))


def of_case(campaign: Campaign, case: str) -> list[Recording]:
    """The recordings of one beam."""
    return [recording for recording in campaign.recordings if recording.case == case]
