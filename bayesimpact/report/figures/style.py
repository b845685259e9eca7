"""How all figures look: colours told apart by everyone, units on every axis, no pyplot."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import wraps
from textwrap import fill
from typing import Any, ParamSpec, TypeVar

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bayesimpact.model.units import Display, decimals, display, readable, reading, typeset
from bayesimpact.report.diagnosis.formula_text import letter
from bayesimpact.report.digits import Digits
from bayesimpact.report.names import split
from bayesimpact.report.results import RecordingResult, Results

Array = NDArray[np.float64]
P = ParamSpec("P")
R = TypeVar("R")
Told = tuple[float, Digits]
"""A median, SI, and the digits with which tables tell it."""

# Okabe and Ito (2008), Color Universal Design.
BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
BLUE, RED, PURPLE = "#0072B2", "#D55E00", "#CC79A7"
GREY = "#8A8A8A"
RECORDED, MODEL = SKY, RED
BEFORE, AFTER = ORANGE, BLUE
CYCLE = (BLUE, ORANGE, GREEN, PURPLE, RED, SKY, BLACK)

WIDTH = 10.0
"""Width of a figure, in."""
LINE = 0.6  # of a row: every further line of a name

# Only these of matplotlib's settings belong to a process, not to a figure.
_OF_THE_PROCESS = ("backend", "backend_fallback", "interactive", "toolbar", "timezone", "webagg")

STYLE: dict[Any, Any] = {
    # matplotlib reads a matplotlibrc of the working folder: its own defaults take that back
    **{
        key: value
        for key, value in matplotlib.rcParamsDefault.items()
        if not key.startswith((*_OF_THE_PROCESS, "tk.", "date.epoch", "docstring"))
    },
    "font.size": 9.0,
    "font.family": "DejaVu Sans",
    "axes.titlesize": 9.0,
    "axes.labelsize": 9.0,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "axes.edgecolor": "#444444",
    "xtick.color": "#444444",
    "ytick.color": "#444444",
    "axes.labelcolor": "#222222",
    "grid.color": "#D9D9D9",
    "grid.linewidth": 0.5,
    "lines.linewidth": 1.0,
    "axes.formatter.useoffset": False,
    "axes.unicode_minus": True,
    "pdf.fonttype": 42,
    "path.simplify_threshold": 0.5,
}

_POINTS = 1500  # columns of pixels across a panel, about


def styled(draw: Callable[P, R]) -> Callable[P, R]:
    """Draw under the package's style, without changing anybody else's."""

    @wraps(draw)
    def inner(*args: P.args, **kwargs: P.kwargs) -> R:
        with matplotlib.rc_context(STYLE):
            return draw(*args, **kwargs)

    return inner


def new_figure(height: float, width: float = WIDTH) -> Figure:
    """An empty figure of the package's width; height in in."""
    return Figure(figsize=(width, height), layout="constrained", dpi=150)


def response(results: Results, recording: RecordingResult | None = None) -> Display:
    """How the readings of a recording, or of the first, are shown: mm, mm/s, else in SI."""
    one = recording or results.recordings[0]
    return reading(one.quantity, one.unit)


def position(results: Results) -> Display:
    """How displacements (or angles) are shown, whatever the probe reads: mm (or rad)."""
    return Display(1.0, "rad") if results.angular else Display(1e3, "mm")


def response_word(results: Results, recording: RecordingResult | None = None) -> str:
    """What was recorded, for an axis."""
    return (recording or results.recordings[0]).quantity.replace("_", " ")


def position_word(results: Results) -> str:
    """Where the mass is, for an axis."""
    return "angle" if results.angular else "displacement"


def label(words: str, unit: str) -> str:
    """Axis label with its unit: "time (s)"."""
    shown = typeset(unit)
    return f"{words} ({shown})" if shown else words


def row_places(names: Sequence[str]) -> tuple[Array, float]:
    """Where rows stand, (N,), and where the last one ends: one apart, further where a name has
    several lines.
    """
    sizes = np.array([1.0 + LINE * name.count("\n") for name in names])
    return np.cumsum(sizes) - 0.5 * (sizes + 1.0), float(sizes.sum()) - 0.5


def rows_axis(axis: Axes, names: Sequence[str], *, above: float = 0.6) -> None:
    """One row per name from the top down, `above` rows of margin over the first; grid behind."""
    places, end = row_places(names)
    axis.set_yticks(places, names)
    axis.set_ylim(end + 0.1, -above)
    axis.grid(axis="x")
    axis.set_axisbelow(True)


def polyline(x: Array, y: Array, columns: int = _POINTS) -> tuple[Array, Array]:
    """A line through (n,) points, some 2 to 4 for every column of a panel where there are more.

    Long signals keep the smallest and the largest value of every block, in the order in which they
    come, so that no peak is lost.
    """
    block = x.size // columns
    if block < 4:
        return x, y
    whole = x.size // block * block
    grid = y[:whole].reshape(-1, block)
    ends = np.sort(np.stack([grid.argmin(axis=1), grid.argmax(axis=1)], axis=1), axis=1)
    index = (np.arange(grid.shape[0])[:, None] * block + ends).ravel()
    index = np.append(index, np.arange(whole, x.size))
    return x[index], y[index]


def symbol(name: str) -> str:
    """A parameter's name in mathtext: "k2[1]" becomes "$k_2$[1]"."""
    _, own, key = split(name)
    own = letter(name.partition("[")[0]) or own
    if own == "sigma":
        own = r"$\sigma$"
    elif len(own) == 2 and own[1].isdigit():
        own = f"${own[0]}_{own[1]}$"
    elif len(own) == 1:
        own = f"${own}$"
    return own + key


def full_symbol(name: str, columns: int) -> str:
    """`symbol`, after the effect that an added parameter belongs to, in lines of so many
    characters.
    """
    effect, _, _ = split(name)
    if not effect:
        return symbol(name)
    # mathematics is not to be broken: it has no blanks, as the case in brackets may have
    return fill(f"{effect}: {symbol(name)}", columns, break_long_words=False)


@dataclass(frozen=True)
class LabScale:
    """An axis for values that may differ only in their last digits.

    Attributes
    ----------
    offset, scale : plotted = (value - offset) * scale
    quantity, unit : what is plotted, as "k2 - 5350.4 N/m", and in which unit
    """

    offset: float
    scale: float
    quantity: str
    unit: str

    @property
    def label(self) -> str:
        """For an axis, on one line or two."""
        return label(self.quantity + ("\n" if self.offset else ""), self.unit).replace("\n ", "\n")

    def __call__(self, values: Array) -> Array:
        """Values in SI as plotted."""
        return np.asarray((values - self.offset) * self.scale)


def scaled(name: str, unit: str, values: Array, told: Told | None = None) -> LabScale:
    """The axis on which draws of a parameter can be read: from zero, or from their middle.

    `told` is the median in tables, with its digits: the middle is then that one as it stands there.
    """
    centre, extent = float(np.median(values)), float(np.ptp(values)) / 4
    if not extent > 0 or abs(centre) < 50 * extent:
        shown = readable(unit, float(np.max(np.abs(values))) if values.size else 0.0)
        return LabScale(0.0, shown.scale, symbol(name), shown.unit)
    about, fine = display(unit, abs(centre)), readable(unit, extent)
    if told is None:
        told = centre, Digits(about.scale, about.unit, decimals(extent * about.scale, 1))
    median, digits = told
    offset = round(median * digits.scale, digits.places) / digits.scale
    sign = "\N{MINUS SIGN}" if offset > 0 else "+"
    middle = f"{digits.value(abs(offset))} {typeset(digits.unit)}"
    return LabScale(offset, fine.scale, f"{symbol(name)} {sign} {middle}", fine.unit)
