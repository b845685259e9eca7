"""Tables as lines of text, for terminals."""

from __future__ import annotations

from collections.abc import Sequence


def text_table(rows: Sequence[Sequence[str]], left: Sequence[int] = (0,)) -> list[str]:
    """Columns two blanks apart; those counted in `left` begin below one another, others end so."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    named = {i % len(widths) for i in left}
    return [
        "  ".join(
            cell.ljust(width) if i in named else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]
