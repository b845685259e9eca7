"""What the evidence page's tables share: stored results, rows and columns."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

HERE = Path(__file__).resolve().parent


def stored(name: str) -> dict:
    """Content of a stored result."""
    return json.loads((HERE / f"{name}.json").read_text(encoding="utf-8"))


def grid(head: Iterable[str], rows: Iterable[Iterable[str]], foot: str) -> str:
    """A table, and a line below it."""
    cells = [tuple(head), *map(tuple, rows)]
    lines = [f"| {' | '.join(row)} |" for row in cells]
    lines.insert(1, "|---" * len(cells[0]) + "|")
    return "\n".join([*lines, "", foot])
