"""Excel workbooks (.xlsx): by openpyxl; a sheet is a block."""

from __future__ import annotations

import zipfile
from io import BytesIO
from pathlib import Path

from bayesimpact.data.readers.channel import Channel, check_bytes, check_values, library
from bayesimpact.data.readers.grid import Cell, channels_of
from bayesimpact.errors import InputError


def read(path: Path, content: bytes) -> list[Channel]:
    """Columns of numbers of every sheet that has some."""
    openpyxl = library("openpyxl", "openpyxl", path)
    with zipfile.ZipFile(BytesIO(content)) as archive:
        check_bytes(sum(item.file_size for item in archive.infolist()), path)
    book = openpyxl.load_workbook(BytesIO(content), read_only=True, data_only=True)
    found: list[Channel] = []
    refusal: InputError | None = None
    for sheet in book.worksheets:
        sheet.reset_dimensions()  # what the file says of its size need not be true
        rows: list[list[Cell]] = []
        count = 0
        for row in sheet.iter_rows(values_only=True):
            rows.append([_cell(value) for value in row])
            count += len(row)
            check_values(count, path)
        try:
            found += _sheet(path, rows, str(sheet.title))
        except InputError as error:
            refusal = refusal or error
    if not found and refusal is not None:
        raise refusal
    return found


def _sheet(path: Path, rows: list[list[Cell]], title: str) -> list[Channel]:
    width = max((len(row) for row in rows), default=0)
    level = [row + [None] * (width - len(row)) for row in rows]
    while level and all(row[-1] is None for row in level) and width > 1:
        level, width = [row[:-1] for row in level], width - 1
    where = f"{path}, sheet {title}"
    return channels_of(where, level, list(range(1, len(level) + 1)), title)


def _cell(value: object) -> Cell:
    if value is None or isinstance(value, str):
        return value
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    return str(value)
