"""A sampling run on disk: what it was started with, and one file per block of steps.

Every file is written beside its final name and renamed: a kill at any moment leaves whole files
only. Plain arrays in npz, no pickles. Every block carries the identity of its run and its place in
it, so that none of another run, and none in another's place, is ever taken for its own; what
follows a block that cannot be used is dropped and sampled anew, which gives the same draws.
"""

from __future__ import annotations

import hashlib
import json
import os
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.files import atomic, clear_unfinished
from bayesimpact.errors import InputError

_START = "start.npz"
_BLOCK = "block-{:06d}.npz"
_DAMAGE = (OSError, ValueError, EOFError, KeyError, NotImplementedError, RuntimeError,
           zipfile.BadZipFile, zlib.error)  # fmt: skip


def write_arrays(path: Path, arrays: Mapping[str, Any]) -> None:
    """Writes an npz file of plain arrays that is either there in full or not at all."""
    if any(array.dtype.hasobject for array in arrays.values()):
        raise TypeError("object arrays would need pickles")
    with atomic(path) as temporary, open(temporary, "wb") as stream:
        np.savez(stream, **arrays)
        stream.flush()
        os.fsync(stream.fileno())


def read_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """Reads an npz file.

    Raises
    ------
    InputError : the file is damaged
    """
    try:
        with open(path, "rb") as stream, np.load(stream, allow_pickle=False) as content:
            return {name: content[name] for name in content.files}
    except _DAMAGE as error:
        raise InputError(
            str(path), f"a damaged file ({error})", "a file of a saved run; or start anew"
        ) from error


def identity(settings: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> str:
    """What tells one run from another: SHA-256 of all that it was started with."""
    digest = hashlib.sha256(json.dumps(dict(settings), sort_keys=True).encode())
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        digest.update(f"{name} {array.dtype.str} {array.shape}".encode())
        digest.update(array.tobytes())
    return digest.hexdigest()


class ChainFolder:
    """The folder of one run.

    Parameters
    ----------
    folder : created when missing
    """

    def __init__(self, folder: Path) -> None:
        self.folder = Path(folder)
        self.run = ""
        self.dropped = ""
        """Why saved blocks were not used, in words; empty when all were."""

    def begin(self, settings: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
        """Forgets any earlier run and writes what this one starts from."""
        self.folder.mkdir(parents=True, exist_ok=True)
        # The start goes first: blocks without a start are no run.
        (self.folder / _START).unlink(missing_ok=True)
        for path in self.folder.glob("block-*.npz"):
            path.unlink()
        clear_unfinished(self.folder)
        self.run = identity(settings, arrays)
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
        path = self.folder / _START
        arrays = read_arrays(path)
        try:
            saved = _flat(json.loads(str(arrays.pop("settings"))))
        except (KeyError, ValueError, AttributeError):
            accepted = "the start of a saved run; or start anew without resuming"
            raise InputError(str(path), "a file of another kind", accepted) from None
        asked = _flat(json.loads(json.dumps(dict(settings))))
        for key in sorted(asked.keys() | saved.keys()):
            if saved.get(key) != asked.get(key):
                raise InputError(
                    str(self.folder),
                    f"a saved run with {key} = {saved.get(key)!r}",
                    f"{key} = {asked.get(key)!r}, to resume; or start anew without resuming",
                )
        self.run = identity(settings, arrays)
        return arrays

    def add(self, index: int, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Saves block `index`, counted from zero."""
        own = {"run": np.array(self.run), "place": np.array(index)}
        write_arrays(self.folder / _BLOCK.format(index), {**arrays, **own})

    def blocks(self) -> Iterator[dict[str, NDArray[Any]]]:
        """The saved blocks of this run in order, up to the first one that is none.

        That one and all later ones are deleted; `dropped` then says why.
        """
        index = 0
        while (path := self.folder / _BLOCK.format(index)).exists():
            try:
                content = self._own(path, index)
            except InputError as error:
                self._drop(index, f"{path.name} is {error.found}")
                return
            yield content
            index += 1
        if self._later(index):
            self._drop(index, f"{path.name} is missing")

    def refuse(self, index: int, why: str) -> None:
        """Delete block `index` and all later ones: its content does not fit."""
        self._drop(index, f"{_BLOCK.format(index)} is {why}")

    def _own(self, path: Path, index: int) -> dict[str, NDArray[Any]]:
        content = read_arrays(path)
        run, place = str(content.pop("run", "")), content.pop("place", np.array(-1))
        if run != self.run:
            raise InputError(str(path), "of another run", "this run's")
        if place.shape != () or int(place) != index:
            raise InputError(str(path), f"block {place} of the run", f"block {index}")
        return content

    def _later(self, index: int) -> list[Path]:
        paths = self.folder.glob("block-*.npz")
        return [path for path in paths if path.name >= _BLOCK.format(index)]

    def _drop(self, index: int, why: str) -> None:
        later = self._later(index)
        for path in sorted(later, reverse=True):
            path.unlink()
        self.dropped = f"{self.folder}: {why}; sampled anew from there ({len(later)} dropped)"


def _flat(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Settings with those of inner tables beside the outer ones."""
    flat: dict[str, Any] = {}
    for key, value in settings.items():
        flat |= value if isinstance(value, dict) else {key: value}
    return flat
