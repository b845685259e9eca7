"""Recordings in files as instruments write them: when such a file is met, and how it is read."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from bayesimpact.data.readers import text
from bayesimpact.data.readers.choose import Wanted, choose
from bayesimpact.data.readers.formats import (
    check_size,
    folder_content,
    is_instrument_file,
    read_channels,
)
from bayesimpact.data.schema import RecordingTable
from bayesimpact.data.table import Table
from bayesimpact.errors import InputError

_KEYS = ("channel", "time_column", "time_unit", "block", "skip_rows", "encoding")


def is_foreign(source: Path, entry: RecordingTable, data: bytes) -> bool:
    """False for a text of this package's own kind: comments, a header row, columns.

    True by the ending of the file, by a key that only other files need, or for a text whose header
    names units in brackets or in a row of their own, or stands in a comment.
    """
    asked = any(getattr(entry, key) is not None for key in _KEYS) or isinstance(entry.column, int)
    return is_instrument_file(source) or asked or text.is_labelled(data)


def read_foreign(source: Path, entry: RecordingTable, data: bytes) -> Table:
    """The channel that an entry means, in SI units; `InputError` as `choose` and the readers."""
    column = entry.column
    if column is not None and entry.channel is not None:
        found = f'column = "{column}" and channel = "{entry.channel}"'
        raise InputError(f"{source}, key channel", found, "one of them; they mean the same")
    if is_instrument_file(source) and source.suffix.lower() != ".lvm":
        for key in ("skip_rows", "encoding"):
            if getattr(entry, key) is not None:
                raise InputError(f"{source}, key {key}", "a key of text files", "none of it here")
    channels = read_channels(source, data, encoding=entry.encoding, skip_rows=entry.skip_rows or 0)
    wanted = replace(
        _wanted(entry, entry.channel if column is None else column),
        unit=entry.unit,
        quantity=entry.quantity,
    )
    return choose(source, channels, wanted)


def read_input(source: Path, entry: RecordingTable, data: bytes) -> Table:
    """The channel that an entry's input means, in SI units, on the response's clock.

    `InputError` as `choose` and the readers; for an input without a column.
    """
    given = entry.input
    if given is None or given.column is None:
        accepted = "the name of a column in quotes, or its number counted from 1"
        raise InputError(f"{source}, input, key column", "nothing", accepted)
    channels = read_channels(source, data, encoding=entry.encoding, skip_rows=entry.skip_rows or 0)
    wanted = replace(_wanted(entry, given.column), kind=given.kind, free=given.gain == "free")
    return choose(source, channels, wanted)


def _wanted(entry: RecordingTable, column: str | int | None) -> Wanted:
    """A column on the clock and in the stretch that an entry states."""
    return Wanted(
        column=column,
        time_column=entry.time_column,
        time_unit=entry.time_unit,
        block=entry.block,
        sample_rate=entry.sample_rate_hz,
        start=entry.start_s,
        end=entry.end_s,
        resample=entry.resample,
        alone=entry.is_alone,
    )


def file_bytes(source: Path, where: str) -> bytes | None:
    """Content of a store that is a folder; None for a file, once its size proved readable."""
    if source.is_dir() and source.suffix.lower() == ".zarr":
        check_size(source, where)
        return folder_content(source)
    if source.is_file():
        check_size(source, where)
    return None
