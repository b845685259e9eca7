"""NumPy files (.npy, .npz): arrays of numbers only, never pickled objects."""

from __future__ import annotations

import zipfile
from io import BytesIO
from pathlib import Path

import numpy as np

from bayesimpact.data.readers.channel import (
    Channel,
    check_bytes,
    check_values,
    interval_among,
    split,
)
from bayesimpact.data.readers.hdf5 import clocked


def read(path: Path, content: bytes) -> list[Channel]:
    """The arrays of a file by their names; scalars called fs, dt, ... are the clock."""
    if content[:2] != b"PK":
        return split("array", _array(path, BytesIO(content)))
    named = {}
    with zipfile.ZipFile(BytesIO(content)) as archive:
        check_bytes(sum(item.file_size for item in archive.infolist()), path)
        for item in archive.infolist():
            if item.filename.endswith(".npy"):
                member = BytesIO(archive.read(item))
                named[item.filename.removesuffix(".npy")] = _array(path, member)
    interval = interval_among((k, v) for k, v in named.items() if v.size == 1)
    found: list[Channel] = []
    for name, array in named.items():
        found += [clocked(channel, interval, "") for channel in split(name, array)]
    return found


def _array(path: Path, stream: BytesIO) -> np.ndarray:
    version = np.lib.format.read_magic(stream)
    header = {(1, 0): np.lib.format.read_array_header_1_0}.get(
        version, np.lib.format.read_array_header_2_0
    )
    shape, _, _ = header(stream)
    check_values(int(np.prod(shape, dtype=object)), path)
    stream.seek(0)
    array: np.ndarray = np.load(stream, allow_pickle=False)
    return array
