"""A sampling run on disk: what it was started with, and one file per block of steps.

Every file is written beside its final name and renamed: a kill at any moment leaves whole files
only. Plain arrays in npz, no pickles.
"""

from __future__ import annotations

import json
import os
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.errors import InputError

_START = "start.npz"
_BLOCK = "block-{:06d}.npz"
_UNFINISHED = ".unfinished"


def write_arrays(path: Path, arrays: Mapping[str, Any]) -> None:
    """Writes an npz file of plain arrays that is either there in full or not at all."""
    if any(array.dtype.hasobject for array in arrays.values()):
        raise TypeError("object arrays would need pickles")
    unfinished = path.with_name(path.name + _UNFINISHED)
    with open(unfinished, "wb") as stream:
        np.savez(stream, **arrays)
        stream.flush()
        os.fsync(stream.fileno())
    os.replace(unfinished, path)


def read_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """Reads an npz file.

    Raises
    ------
    InputError : the file is damaged
    """
    try:
        with open(path, "rb") as stream, np.load(stream, allow_pickle=False) as content:
            return {name: content[name] for name in content.files}
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile) as error:
        raise InputError(
            str(path), f"a damaged file ({error})", "a file of a saved run; or start anew"
        ) from error


class ChainFolder:
    """The folder of one run.

    Parameters
    ----------
    folder : created when missing
    """

    def __init__(self, folder: Path) -> None:
        self.folder = Path(folder)

    def begin(self, settings: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
        """Forgets any earlier run and writes what this one starts from."""
        self.folder.mkdir(parents=True, exist_ok=True)
        # The start goes first: blocks without a start are no run.
        (self.folder / _START).unlink(missing_ok=True)
        for path in self.folder.glob("block-*.npz"):
            path.unlink()
        for path in self.folder.glob("*" + _UNFINISHED):
            path.unlink()
        text = np.array(json.dumps(dict(settings), sort_keys=True))
        write_arrays(self.folder / _START, {**arrays, "settings": text})

    def started(self) -> bool:
        """Is there a run to resume?"""
        return (self.folder / _START).is_file()

    def start(self, settings: Mapping[str, Any]) -> dict[str, NDArray[Any]]:
        """The arrays that the saved run started from.

        Raises
        ------
        InputError : it was started with other settings or other data
        """
        arrays = read_arrays(self.folder / _START)
        saved = json.loads(str(arrays.pop("settings")))
        asked = json.loads(json.dumps(dict(settings)))
        for key in sorted(asked.keys() | saved.keys()):
            if saved.get(key) != asked.get(key):
                raise InputError(
                    str(self.folder),
                    f"a saved run with {key} = {saved.get(key)!r}",
                    f"{key} = {asked.get(key)!r}, to resume; or start anew without resuming",
                )
        return arrays

    def add(self, index: int, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Saves block `index`, counted from zero."""
        write_arrays(self.folder / _BLOCK.format(index), arrays)

    def blocks(self) -> Iterator[dict[str, NDArray[Any]]]:
        """The saved blocks in order, without a gap."""
        index = 0
        while (path := self.folder / _BLOCK.format(index)).is_file():
            yield read_arrays(path)
            index += 1
