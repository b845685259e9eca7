"""Small tables for notebooks, which show an object's `_repr_html_` in place of its `repr`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from math import floor, isfinite, log10


def html_table(caption: str, columns: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table; captions and cells are escaped, numbers have four digits."""
    head = "".join(f"<th>{escape(name)}</th>" for name in columns)
    body = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in rows)
    return (
        f"<table><caption>{escape(caption)}</caption>"
        f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    )


def _cell(value: object) -> str:
    text = f"{value:.4g}" if isinstance(value, float) else str(value)
    return f"<td>{escape(text)}</td>"


def resolved(value: float, width: float) -> str:
    """A number with two digits of its uncertainty, and four at least."""
    if not (isfinite(value) and isfinite(width) and value and width > 0.0):
        return f"{value:.4g}"
    beyond = floor(log10(abs(value))) - floor(log10(width))
    return f"{value:.{min(max(beyond + 2, 4), 15)}g}"
