"""Figures that notebooks show: only pyplot, which the package does not use, teaches them to."""

from __future__ import annotations

import io
from functools import partial

from matplotlib.figure import Figure


def inline(figure: Figure) -> Figure:
    """The same figure, with what a notebook asks an object for to show it as a picture."""
    figure._repr_png_ = partial(_png, figure)  # type: ignore[attr-defined]
    return figure


def _png(figure: Figure) -> bytes:
    stream = io.BytesIO()
    figure.savefig(stream, format="png")
    return stream.getvalue()
