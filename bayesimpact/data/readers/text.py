"""Text of instruments: preambles, `Time [s]`, units in a second row, no header, decimal commas."""

from __future__ import annotations

import codecs
import re
from collections.abc import Sequence
from pathlib import Path

from bayesimpact.data.fields import fields, unquoted
from bayesimpact.data.readers.channel import Channel
from bayesimpact.data.readers.grid import Cell, channels_of, has_names, has_units, number
from bayesimpact.data.readers.runs import separate_runs
from bayesimpact.errors import InputError

LOOKED_AT = 25
"""Lines in the middle of a file that show what separates its columns."""


def read(path: Path, content: bytes, encoding: str = "utf-8-sig", skip: int = 0) -> list[Channel]:
    """Channels of a text, a block for each run; `skip` lines at its top are left out."""
    lines = text_of(path, content, encoding).split("\n")
    if skip >= len(lines):
        raise InputError(f"{path}, key skip_rows", f"{skip} of {len(lines)} lines", "fewer lines")
    rows, numbers = _cells(lines, skip)
    return separate_runs(channels_of(path, rows, numbers))


def is_labelled(content: bytes) -> bool:
    """True for a text whose header names units in brackets, or stands in a comment."""
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return False
    if "\0" in text:
        return False
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    rows, numbers = _cells(lines, 0)
    bare = (row for row, i in zip(rows, numbers, strict=True) if not _is_comment(lines[i - 1]))
    headless = all(number(cell) == number(cell) for cell in next(bare, ["no numbers"]))
    return has_units(rows) or (headless and has_names(rows))


def text_of(path: Path, content: bytes, encoding: str) -> str:
    """The text of a file, with line ends of Unix."""
    try:
        codecs.lookup(encoding)
        text = content.decode("utf-8-sig" if encoding.lower() in ("utf-8", "utf8") else encoding)
    except LookupError:
        accepted = "the name of an encoding, as utf-8, latin-1, cp1252, utf-16"
        raise InputError(f"{path}, key encoding", f'"{encoding}"', accepted) from None
    except UnicodeError as error:
        found = f"bytes that are not {encoding} ({error.__class__.__name__})"
        accepted = 'the encoding of the text, as encoding = "latin-1"'
        raise InputError(str(path), found, accepted) from None
    if "\0" in text:
        raise InputError(str(path), "binary content", "a text file, or its encoding")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def guessed_encoding(content: bytes) -> str:
    """Encoding by its mark, else UTF-8 where that fits, else Latin-1."""
    if content[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):
        return "utf-16"
    try:
        content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8"


def _cells(lines: Sequence[str], skip: int) -> tuple[list[list[Cell]], list[int]]:
    """Cells of all lines that are not comments, and their line numbers."""
    kept = [(i, line) for i, line in enumerate(lines, 1) if i > skip]
    while kept and not kept[-1][1].strip():
        kept.pop()
    middle = [line for _, line in kept[len(kept) // 2 :][:LOOKED_AT] if line.strip()]
    separator, decimal = _format([unquoted(line) for line in middle])
    quoted = [part for line in middle for part in line.split('"')[1::2]]
    points = any(re.search(r"\d\.\d", line) for line in middle)
    decimal = decimal or (not points and any(re.fullmatch(r"-?\d*,\d*", q) for q in quoted))
    rows: list[list[Cell]] = []
    numbers: list[int] = []
    for i, line in kept:
        commented = _is_comment(line)
        if commented and rows and any(number(cell) == number(cell) for cell in rows[-1]):
            continue  # a comment among the numbers
        plain = _comment(line) if commented else line
        cells: list[Cell] = [field.strip() for field in fields(plain, separator)]
        if decimal:
            cells = [_point(cell) for cell in cells]
        rows.append(cells)
        numbers.append(i)
    return rows, numbers


def _is_comment(line: str) -> bool:
    return line.lstrip(' \t"').startswith("#")


def _comment(line: str) -> str:
    """A comment without its marks; a quote before them is that of its first field."""
    bare = line.lstrip(' \t"')
    return line[: len(line) - len(bare)].lstrip() + bare.lstrip("#% ")


def _point(cell: Cell) -> Cell:
    """A decimal comma as a point, in numbers only."""
    if isinstance(cell, str) and cell.count(",") == 1 and "." not in cell:
        pointed = cell.replace(",", ".")
        return pointed if number(pointed) == number(pointed) else cell
    return cell


def _format(lines: Sequence[str]) -> tuple[str | None, bool]:
    """What separates the columns of these lines (None: blanks), and whether commas are decimal."""
    text = "\n".join(lines)
    for separator in (";", "\t"):
        if lines and all(separator in line for line in lines):
            return separator, "," in text
    if "," not in text:
        return None, False
    words = [word for line in lines for word in line.split()]
    blanks = all(len(line.split()) > 1 for line in lines)
    if all(word.count(",") <= 1 and not word.endswith(",") for word in words) and (
        blanks or ("." not in text and all(line.count(",") == 1 for line in lines))
    ):
        # "0,001 1,5": decimal commas between blanks; "0,001" alone stays two columns
        return (None, True) if blanks else (",", False)
    return ",", False
