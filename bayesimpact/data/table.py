"""Reads one recording's text file: comment lines, a header row, columns of numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.clock import check_mean_rate, check_rate, taken_evenly
from bayesimpact.data.even_clock import on_clock
from bayesimpact.data.fields import fields, unquoted
from bayesimpact.data.quantity import RESPONSE_COLUMNS, UNITS, Quantity
from bayesimpact.data.readers.channel import name_and_unit, says_time
from bayesimpact.data.readers.guess import named_quantity
from bayesimpact.data.window import unbroken, window
from bayesimpact.errors import InputError

TIME_COLUMNS = {"time_s": 1.0, "time_ms": 1e-3}


@dataclass(frozen=True, eq=False)
class Table:
    """What one file holds, in SI units.

    Attributes
    ----------
    samples : (n,)
    interval : s
    start : time of the first sample on the file's clock, s; 0 for a file without a time column
    quantity : what the samples are
    used : (n,) False where an uneven clock left a gap; None where every sample counts
    input : (n,) a measured input in SI units, see `bayesimpact.data.input`; None without one
    unit, input_unit : that the readings and the input were taken for, in the file; "" where nothing
        said one
    assumed_seconds : nothing said the unit of the time stamps, and they were taken for s
    stamped_late : readings taken over to an even clock follow one another evenly as they are
    repeated : readings left out because the probe had answered with the one before again
    """

    samples: NDArray[np.float64]
    interval: float
    start: float
    quantity: Quantity
    used: NDArray[np.bool_] | None = None
    input: NDArray[np.float64] | None = None
    unit: str = ""
    input_unit: str = ""
    assumed_seconds: bool = False
    stamped_late: bool = False
    repeated: int = 0


@dataclass(frozen=True)
class _Layout:
    """Where in a row the numbers stand."""

    names: tuple[str, ...]
    separator: str | None
    time: int | None
    response: int
    unit: str


def read_table(
    path: Path,
    content: bytes,
    *,
    column: str | None = None,
    unit: str | None = None,
    sample_rate: float | None = None,
    resample: bool = False,
    alone: bool = False,
    span: tuple[float | None, float | None] = (None, None),
) -> Table:
    """Parse the content of a recording's file.

    Parameters
    ----------
    path : only for messages
    content : the file's bytes, UTF-8
    column, unit : name and unit (a key of `UNITS`) of the response column, where it is not one of
        `RESPONSE_COLUMNS` or there are several
    sample_rate : Hz, for a file without a time column
    resample : the clock is uneven: take the readings over to even times
    alone : no input or other channel has to stay on the clock of the rows
    span : start and end of what is used, s; readings and spacing outside are not checked

    Raises
    ------
    InputError
        with the file and, where one is at fault, the line.
    """
    lines = _lines(path, content)
    header = next((i for i, line in enumerate(lines) if _is_content(line)), None)
    if header is None:
        raise InputError(
            str(path), "no header row and no samples", "a header row and rows of numbers"
        )
    layout = _layout(path, header + 1, lines[header], column, unit)
    numbers, rows = _numbers(path, lines, header + 1, layout)
    quantity, factor = UNITS[layout.unit]
    samples = numbers[:, -1] * factor
    if layout.time is None:
        if sample_rate is None:
            accepted = f"a column {' or '.join(TIME_COLUMNS)}, or sample_rate_hz in campaign.toml"
            clock = next((name for name in layout.names if says_time(name)), None)
            if clock is not None:
                accepted += f', or time_column = "{clock}" and time_unit there'
            found = f"no time column among {', '.join(layout.names)}"
            raise InputError(f"{path}, header row", found, accepted)
        interval = 1.0 / sample_rate
        first, last = window((interval, 0.0), samples.size, *span)
        _check_finite(path, lines, layout, samples[first:last], rows[first:last])
        return Table(samples[first:last], interval, first * interval, quantity, unit=layout.unit)
    times = numbers[:, 0] * TIME_COLUMNS[layout.names[layout.time]]
    first, last = window(times, samples.size, *span)
    if resample:
        first, last = unbroken(times, samples, first, last)
    times, samples, rows = times[first:last], samples[first:last], rows[first:last]
    _check_finite(path, lines, layout, samples, rows)
    if sample_rate is not None and not resample and taken_evenly(times, samples):
        check_mean_rate(path, times, sample_rate)
        return Table(samples, 1.0 / sample_rate, float(times[0]), quantity, unit=layout.unit)
    even = on_clock(path, times, samples, rows, resample=resample, alone=alone)
    check_rate(path, even.interval, sample_rate)
    start = float(times[0])
    return Table(
        even.samples, even.interval, start, quantity, even.used,
        unit=layout.unit, stamped_late=even.stamped_late, repeated=even.repeated,
    )  # fmt: skip


def squeezed(name: str) -> str:
    """A column's name without its blanks, which a reader of a header does not see."""
    return "".join(name.split())


def _is_content(line: str) -> bool:
    bare = line.replace('"', "").strip()
    return bool(bare) and not bare.startswith("#")


def _lines(path: Path, content: bytes) -> list[str]:
    if not content.strip():
        raise InputError(str(path), "an empty file", "a header row and rows of numbers")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        found = f"a byte that is not UTF-8 (0x{content[error.start]:02x})"
        raise InputError(
            f"{path}, line {line}", found, "a text file in UTF-8, columns of numbers"
        ) from None
    if "\0" in text:
        raise InputError(str(path), "binary content", "a text file in UTF-8, columns of numbers")
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def _separator(line: str) -> str | None:
    bare = unquoted(line)
    return next((mark for mark in (";", "\t", ",") if mark in bare), None)


def _layout(path: Path, line: int, header: str, column: str | None, unit: str | None) -> _Layout:
    separator = _separator(header)
    names = tuple(name.strip() for name in fields(header.strip(), separator))
    where = f"{path}, line {line}"
    if all(_is_number(name) for name in names):
        accepted = f"a header row with a time column ({', '.join(TIME_COLUMNS)}) and a response"
        raise InputError(
            where,
            f"numbers ({header.strip()}) in place of the header row",
            f"{accepted} column ({', '.join(RESPONSE_COLUMNS)})",
        )
    times = [i for i, name in enumerate(names) if name in TIME_COLUMNS]
    if len(times) > 1:
        found = "two time columns: " + ", ".join(names[i] for i in times)
        raise InputError(where, found, f"one of {', '.join(TIME_COLUMNS)}")
    time = times[0] if times else None
    response = _response_column(where, names, column, unit, time)
    known = RESPONSE_COLUMNS.get(names[response])
    if unit is not None and known is not None and unit != known:
        raise InputError(
            f"{where}, column {names[response]}",
            f'unit = "{unit}" in campaign.toml',
            f'unit = "{known}", or no unit',
        )
    if unit is None and known is None:
        known = _unit_by_name(names[response])
    if unit is None and known is None:
        accepted = f"with column = ... also unit = ... ({', '.join(UNITS)})"
        raise InputError(f"{where}, column {names[response]}", "no unit for it", accepted)
    return _Layout(names, separator, time, response, unit or known or "")


def _unit_by_name(name: str) -> str | None:
    """The unit that ends a column's name, unless the name says another quantity than it."""
    unit, said = name_and_unit(name)[1], named_quantity(name)
    return unit if unit in UNITS and said in (None, UNITS[unit][0]) else None


def _response_column(
    where: str, names: Sequence[str], column: str | None, unit: str | None, time: int | None
) -> int:
    if column is not None:
        found = [i for i, name in enumerate(names) if name == column]
        found = found or [i for i, n in enumerate(names) if squeezed(n) == squeezed(column)]
        if len(found) == 1 and found[0] != time:
            return found[0]
        state = f'column = "{column}", which is ' + (
            "the time column" if time in found else f"there {len(found)} times"
        )
        others = [name for i, name in enumerate(names) if i != time]
        raise InputError(where, state, f"one of this file's columns: {', '.join(others)}")
    known = [i for i, name in enumerate(names) if name in RESPONSE_COLUMNS]
    if not known and unit is not None:
        known = [i for i in range(len(names)) if i != time]
    if len(known) == 1:
        return known[0]
    columns = ", ".join(names)
    if known:
        raise InputError(
            where,
            f"several response columns ({columns})",
            'one, or column = "..." in campaign.toml',
        )
    near = [
        n for name in names[:50] for n in get_close_matches(name[:50], RESPONSE_COLUMNS, 1, 0.75)
    ]
    accepted = f"one of {', '.join(RESPONSE_COLUMNS)}, or column and unit in campaign.toml"
    hint = f" (did you mean {near[0]}?)" if near else ""
    raise InputError(where, f"no response column among {columns}{hint}", accepted)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _numbers(
    path: Path, lines: list[str], first: int, layout: _Layout
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Time (if any) and response as in the file, (n, 1 or 2), and their line numbers (n,).

    A response that is no finite number is NaN.
    """
    last = len(lines)
    while last > first and not lines[last - 1].strip():
        last -= 1
    body = lines[first:last]
    if layout.separator != ",":
        body = _decimal_points(path, body, first)
    values: list[list[float]] = []
    rows: list[int] = []
    for line, text in enumerate(body, first + 1):
        if not _is_content(text):
            if values and not text.strip():
                raise InputError(f"{path}, line {line}", "an empty line", "a row of numbers")
            continue
        values.append(_row(path, line, text, layout))
        rows.append(line)
    if len(values) < 2:
        found = "only a header row" if not values else "one sample"
        raise InputError(str(path), found, "a header row and rows of numbers")
    return np.array(values), np.array(rows)


def _decimal_points(path: Path, body: list[str], first: int) -> list[str]:
    """Decimal commas to points, where no comma separates columns; never both in one file."""
    comma = point = 0
    for line, text in enumerate(body, first + 1):
        if _is_content(text):
            comma = comma or (line if "," in text else 0)
            point = point or (line if "." in text else 0)
    if comma and point:
        found = f"a comma in a number, and a point in line {point}"
        accepted = "decimal points throughout, or decimal commas throughout"
        raise InputError(f"{path}, line {comma}", found, accepted)
    return [text.replace(",", ".") for text in body] if comma else body


def _row(path: Path, line: int, text: str, layout: _Layout) -> list[float]:
    row = fields(text, layout.separator)
    if len(row) != len(layout.names):
        accepted = f"{len(layout.names)} fields as in the header ({', '.join(layout.names)})"
        if layout.separator == ",":
            accepted += "; decimal commas need semicolons between the columns"
        found = f'{len(row)} fields ("{text.strip()}")'
        raise InputError(f"{path}, line {line}", found, accepted)
    response = _number(row[layout.response])
    if layout.time is None:
        return [response]
    time = _number(row[layout.time])
    if math.isnan(time):
        raise _no_number(path, line, layout, layout.time, row)
    return [time, response]


def _number(field: str) -> float:
    """A finite number, else NaN."""
    try:
        number = float(field)
    except ValueError:
        return math.nan
    return number if math.isfinite(number) and "_" not in field else math.nan


def _check_finite(
    path: Path,
    lines: Sequence[str],
    layout: _Layout,
    samples: NDArray[np.float64],
    rows: NDArray[np.int64],
) -> None:
    wrong = np.flatnonzero(np.isnan(samples))
    if wrong.size:
        line = int(rows[wrong[0]])
        row = fields(lines[line - 1], layout.separator)
        raise _no_number(path, line, layout, layout.response, row)


def _no_number(
    path: Path, line: int, layout: _Layout, column: int, row: Sequence[str]
) -> InputError:
    field = row[column].strip()
    found = f'"{field}"' if field else "an empty field"
    where = f"{path}, line {line}, column {layout.names[column]}"
    return InputError(where, found, "a finite number")
