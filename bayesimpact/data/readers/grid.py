"""Channels of a grid of cells: preamble, names, units and numbers, as instruments write them."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

import numpy as np

from bayesimpact.data.readers.channel import (
    LABEL_UNITS,
    TIME_UNITS,
    Channel,
    name_and_unit,
    says_time,
    spelt,
)
from bayesimpact.errors import InputError

Cell = str | float | None
_NO_UNIT = "[]()- "
_CLOCK = re.compile(
    r"(?:[\d./-]{6,10}[T ]\s*)?([01]?\d|2[0-3]):([0-5]\d):([0-5]\d(?:[.,]\d+)?)"
    r"(?:Z|[+-]\d{2}:?\d{2})?"
)
LOOKED_AT = 25
"""Rows in the middle of a grid that show which of its columns are numbers."""


def channels_of(
    path: object, rows: Sequence[Sequence[Cell]], numbers: Sequence[int], block: str = ""
) -> list[Channel]:
    """Channels of the rows of one sheet or text.

    Parameters
    ----------
    path : for messages
    rows : cells; text where they are not numbers, None or "" where they are empty
    numbers : line of every row, for messages
    block : name of the sheet

    Raises
    ------
    InputError
        when there are no two rows of numbers, or a row among them is not one.
    """
    first, last, width, numeric = _numbers_at(path, rows)
    if any(_fits(row, width, numeric) for row in rows[: max(0, first - 1)]):
        shown = ", ".join(str(cell) for cell in rows[first - 1] if not _empty(cell))
        problem = f'"{shown}" between rows of numbers' if shown else "an empty line"
        accepted = "a row of numbers; or skip_rows = the lines above the header"
        raise InputError(f"{path}, line {numbers[first - 1]}", problem, accepted)
    names, units = _labels(rows[:first], width)
    values = np.full((last - first, width), np.nan)
    for i, row in enumerate(rows[first:last]):
        if not any(not _empty(cell) for cell in row):
            where = f"{path}, line {numbers[first + i]}"
            raise InputError(where, "an empty line", "a row of numbers")
        if len(row) > width and any(not _empty(cell) for cell in row[width:]):
            where = f"{path}, line {numbers[first + i]}"
            raise InputError(where, f"{len(row)} fields", f"{width} fields as in the rows above")
        for j, cell in enumerate(row[:width]):
            if numeric[j]:
                values[i, j] = number(cell)
    lines = np.array(numbers[first:last], dtype=np.int64)
    found = []
    for j in range(width):
        if not names[j] and not np.isfinite(values[:, j]).any():
            continue
        name = names[j] or str(j + 1)
        found.append(Channel(name, values[:, j].copy(), units[j], block, rows=lines))
    return found


def has_units(rows: Sequence[Sequence[Cell]]) -> bool:
    """True for a header that names units in brackets or in a second row."""
    try:
        first, _, width, _ = _numbers_at("", rows)
    except InputError:
        return False
    names = [str(cell or "") for row in rows[:first] for cell in row]
    plain = all(name_and_unit(name)[0] == name for name in names)
    _, units = _labels(rows[:first], width)
    return not plain or (first > 1 and any(units))


def has_names(rows: Sequence[Sequence[Cell]]) -> bool:
    """True where a row above the numbers names every column."""
    try:
        first, _, width, _ = _numbers_at("", rows)
    except InputError:
        return False
    return all(_labels(rows[:first], width)[0])


def number(cell: Cell) -> float:
    """A finite number, or a time of day, s; NaN for anything else."""
    try:
        value = float(cell) if cell is not None else math.nan
    except ValueError:
        return _time_of_day(cell)
    return value if math.isfinite(value) and "_" not in str(cell) else math.nan


def _time_of_day(cell: Cell) -> float:
    """Seconds since midnight of `16:04:31.273`, with a date before it or none; NaN for others."""
    found = _CLOCK.fullmatch(cell.strip()) if isinstance(cell, str) else None
    if found is None:
        return math.nan
    hours, minutes, seconds = found.groups()
    return 3600.0 * int(hours) + 60.0 * int(minutes) + float(seconds.replace(",", "."))


def _empty(cell: Cell) -> bool:
    return cell is None or (isinstance(cell, str) and not cell.strip())


def _numbers_at(
    path: object, rows: Sequence[Sequence[Cell]]
) -> tuple[int, int, int, tuple[bool, ...]]:
    """First row of numbers, row after the last, number of columns, which columns are numbers."""
    last = len(rows)
    while last and all(_empty(cell) for cell in rows[last - 1]):
        last -= 1
    accepted = "rows of numbers, two or more"
    if last < 2:
        raise InputError(str(path), "no rows of numbers", accepted)
    middle = rows[last // 2 : last // 2 + LOOKED_AT]
    width = int(np.median([len(row) for row in middle]))
    seen = [[row[j] for row in middle if j < len(row) and not _empty(row[j])] for j in range(width)]
    numeric = tuple(not any(math.isnan(number(cell)) for cell in cells) for cells in seen)
    if not any(ok and cells for ok, cells in zip(numeric, seen, strict=True)):
        raise InputError(str(path), "no columns of numbers", accepted)
    first = last // 2
    while first > 0 and _fits(rows[first - 1], width, numeric):
        first -= 1
    if last - first < 2:
        raise InputError(str(path), "one row of numbers", accepted)
    return first, last, width, numeric


def _fits(row: Sequence[Cell], width: int, numeric: Sequence[bool]) -> bool:
    cells = [cell for cell, ok in zip(row, numeric, strict=False) if ok and not _empty(cell)]
    return len(row) == width and bool(cells) and not any(math.isnan(number(c)) for c in cells)


def _labels(above: Sequence[Sequence[Cell]], width: int) -> tuple[list[str], list[str]]:
    """Names and units of the columns from the rows above the numbers; "" where there are none."""
    heads = [
        [str(c or "").strip() for c in row] for row in above if any(not _empty(c) for c in row)
    ]
    heads = [row + [""] * (width - len(row)) for row in heads if width - 1 <= len(row) <= width]
    for row in heads:
        row[0] = row[0].lstrip("#% ")  # the mark of a comment
    below: list[str] = [""] * width
    if len(heads) > 1 and _is_units(heads[-1], heads[-2]):
        below = [spelt(cell) if cell.strip(_NO_UNIT) else "" for cell in heads.pop()]
    if not heads or not any(heads[-1]):
        return [""] * width, below
    names, units = zip(*(name_and_unit(cell.lstrip("#% ")) for cell in heads[-1]), strict=True)
    return list(names), [unit or other for unit, other in zip(units, below, strict=True)]


def _is_units(cells: Sequence[str], above: Sequence[str]) -> bool:
    """True for a row of units below a row of names; not all of them need be known here.

    Each is a known unit, or in brackets, or one of them is that of the time above it.
    """
    pairs = [(c, name) for c, name in zip(cells, above, strict=True) if c.strip(_NO_UNIT)]
    given = [spelt(cell) for cell, _ in pairs]
    if not given:
        return False
    bracketed = all(cell[0] + cell[-1] in ("[]", "()") for cell, _ in pairs)
    timed = any(
        unit in TIME_UNITS and says_time(name_and_unit(name)[0])
        for unit, (_, name) in zip(given, pairs, strict=True)
    )
    return bracketed or timed or all(unit in LABEL_UNITS for unit in given)
