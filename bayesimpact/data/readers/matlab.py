"""MATLAB files: up to version 7 by SciPy, version 7.3 (an HDF5 file) by h5py."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat

from bayesimpact.data.readers import hdf5
from bayesimpact.data.readers.channel import (
    Channel,
    check_bytes,
    check_values,
    interval_among,
    split,
)

_COMPRESSED = 15
_PIECE = 2**20
_DEEPEST = 8
"""Structures within structures that are followed."""


def read(path: Path, content: bytes) -> list[Channel]:
    """Numeric variables and fields; a structure is a block, named by the way to it."""
    if content[512:520] == hdf5.MAGIC or content[:8] == hdf5.MAGIC:
        return hdf5.read(path, content)
    _check_compressed(path, content)
    variables = loadmat(BytesIO(content), squeeze_me=True, struct_as_record=False)
    named = {k: v for k, v in variables.items() if not k.startswith("__")}
    return list(_walk(path, named, "", 0))


def _check_compressed(path: Path, content: bytes) -> None:
    """Refuse a file whose compressed variables hold more than is read, by inflating in pieces."""
    order = "<" if content[126:128] == b"IM" else ">"
    at, total = 128, len(content)
    while at + 8 <= len(content):
        kind, size = struct.unpack_from(f"{order}II", content, at)
        if kind == _COMPRESSED:
            inflate, rest = zlib.decompressobj(), content[at + 8 : at + 8 + size]
            while rest and not inflate.eof:
                total += len(inflate.decompress(rest, _PIECE))
                check_bytes(total, path)
                rest = inflate.unconsumed_tail
        at += 8 + size


def _walk(path: Path, named: dict[str, Any], block: str, depth: int) -> Iterator[Channel]:
    scalars = [(k, v) for k, v in named.items() if np.size(v) == 1]
    interval = interval_among((k, v) for k, v in scalars if not _fields(v))
    units = {k: str(v) for k, v in named.items() if isinstance(v, str)}
    for name, value in named.items():
        fields = _fields(value)
        if fields and depth < _DEEPEST:
            yield from _walk(path, fields, f"{block}.{name}" if block else name, depth + 1)
        elif isinstance(value, np.ndarray) and value.dtype.kind in "fiub":
            check_values(value.size, path)
            unit = units.get(f"{name}_unit", units.get("unit", units.get("units", "")))
            for channel in split(name, value, block=block):
                yield hdf5.clocked(channel, interval, unit)


def _fields(value: Any) -> dict[str, Any]:
    """Fields of a structure by name; {} of anything else."""
    names = getattr(value, "_fieldnames", None)
    return {str(name): getattr(value, name) for name in names} if names else {}
