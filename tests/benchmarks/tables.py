"""What the evidence page's tables share: stored results, rows and columns."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

HERE = Path(__file__).resolve().parent
BUSY = 0.25  # cores busy with something else, from which on times are not to be trusted


def stored(name: str) -> dict:
    """Content of a stored result."""
    return json.loads((HERE / f"{name}.json").read_text(encoding="utf-8"))


def grid(head: Iterable[str], rows: Iterable[Iterable[str]], foot: str) -> str:
    """A table, and a line below it."""
    cells = [tuple(head), *map(tuple, rows)]
    lines = [f"| {' | '.join(row)} |" for row in cells]
    lines.insert(1, "|---" * len(cells[0]) + "|")
    return "\n".join([*lines, "", foot])


def measured(result: dict, *more: str) -> str:
    """Where and when, what was not installed, and whether something else ran."""
    parts = [result["machine"], *more, f"commit {result['commit']}", result["date"]]
    if (result.get("others") or 0.0) > BUSY:
        parts.append(f"{result['others']:.1f} of the cores busy with other work: to be repeated")
    if result.get("absent"):
        parts.append(f"not installed: {', '.join(result['absent'])}")
    return f"{', '.join(parts)}."
