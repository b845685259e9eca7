"""Small tables for notebooks, which show an object's `_repr_html_` in place of its `repr`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

import numpy as np
from numpy.typing import NDArray

WIDTH, HEIGHT = 160, 28  # of a sketch, px


class Sketch(str):
    """HTML that stands in a cell as it is."""


def html_table(caption: str, columns: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table; captions and cells are escaped, numbers have four digits."""
    head = "".join(f"<th>{escape(name)}</th>" for name in columns)
    body = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in rows)
    return (
        f"<table><caption>{escape(caption)}</caption>"
        f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    )


def sketch(samples: NDArray[np.float64]) -> Sketch:
    """A small picture of readings: from the lowest to the highest of every column of pixels."""
    parts = [part[np.isfinite(part)] for part in np.array_split(samples, WIDTH)]
    ends = [(x, part.min(), part.max()) for x, part in enumerate(parts) if part.size]
    low, high = min(e[1] for e in ends), max(e[2] for e in ends)
    scale = (HEIGHT - 2) / (high - low) if high > low else 0.0
    lines = "".join(
        f"M{x + 0.5},{1 + (high - top) * scale:.1f}v{max((top - bottom) * scale, 1.0):.1f}"
        for x, bottom, top in ends
    )
    return Sketch(
        f'<svg width="{WIDTH}" height="{HEIGHT}" role="img" aria-label="samples in time">'
        f'<path d="{lines}" stroke="currentColor" fill="none"/></svg>'
    )


def _cell(value: object) -> str:
    if isinstance(value, Sketch):
        return f"<td>{value}</td>"
    text = f"{value:.4g}" if isinstance(value, float) else str(value)
    return f"<td>{escape(text)}</td>"
