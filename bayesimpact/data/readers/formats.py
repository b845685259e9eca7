"""Which reader reads which file, and what becomes of one that cannot be read."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from bayesimpact.data.readers.channel import MAX_BYTES, Channel
from bayesimpact.errors import BayesimpactError, InputError


@dataclass(frozen=True)
class Format:
    """One kind of file: its name in messages, the module that reads it and the function there."""

    title: str
    module: str
    function: str = "read"


_MATLAB, _UFF = Format("a MATLAB file", "matlab"), Format("a UFF file", "uff")
_HDF5, _NETCDF = Format("an HDF5 file", "hdf5"), Format("a NetCDF file", "labelled")
_EXCEL, _PARQUET = Format("an Excel workbook", "excel"), Format("a Parquet file", "parquet")
_NUMPY = Format("a NumPy file", "arrays")
FORMATS: dict[str, Format] = {
    ".mat": _MATLAB,
    ".uff": _UFF,
    ".unv": _UFF,
    ".uf": _UFF,
    ".tdms": Format("a TDMS file", "tdms"),
    ".lvm": Format("an LVM file", "lvm"),
    ".h5": _HDF5,
    ".hdf5": _HDF5,
    ".hdf": _HDF5,
    ".wav": Format("a WAV file", "wav"),
    ".xlsx": _EXCEL,
    ".xlsm": _EXCEL,
    ".nc": _NETCDF,
    ".cdf": _NETCDF,
    ".zarr": Format("a Zarr store", "labelled", "read_zarr"),
    ".parquet": _PARQUET,
    ".pq": _PARQUET,
    ".npy": _NUMPY,
    ".npz": _NUMPY,
}
"""By the ending of the file's name; whatever is not here is text."""
REFUSED = {
    ".xls": "a workbook saved as .xlsx",
    ".pkl": "an array saved as .npy or .npz; pickles are not read, for they may run programs",
    ".pickle": "an array saved as .npy or .npz; pickles are not read, for they may run programs",
}


def read_channels(
    path: Path, content: bytes, *, encoding: str | None = None, skip_rows: int = 0
) -> list[Channel]:
    """All channels of an instrument's file.

    Parameters
    ----------
    path : its ending says the format; for messages otherwise
    content : the file's bytes
    encoding, skip_rows : of a text

    Raises
    ------
    InputError
        for a file that cannot be read or holds no channel, and where a library is missing.
    """
    ending = path.suffix.lower()
    if ending in REFUSED:
        raise InputError(str(path), f"a file {ending}", REFUSED[ending])
    if not content:
        raise InputError(str(path), "an empty file", "recorded channels")
    kind = FORMATS.get(ending)
    textual = kind is None or (ending == ".lvm" and (encoding is not None or skip_rows > 0))
    title = "a text" if textual or kind is None else kind.title
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            if textual or kind is None:
                from bayesimpact.data.readers import text

                found = text.read(path, content, encoding or "utf-8", skip_rows)
            else:
                module = import_module(f"bayesimpact.data.readers.{kind.module}")
                read: Callable[[Path, bytes], list[Channel]] = getattr(module, kind.function)
                found = read(path, content)
    except BayesimpactError:
        raise
    except Exception as error:  # whatever a library meets in a damaged file
        first = (str(error).strip().splitlines() or [error.__class__.__name__])[0][:160]
        accepted = f"{title}, whole and undamaged"
        raise InputError(str(path), f"content that cannot be read ({first})", accepted) from None
    if not found:
        raise InputError(str(path), f"{title} without a channel", "recorded channels")
    return found


def is_instrument_file(path: Path) -> bool:
    """True for a file that is not plain text, by its ending."""
    return path.suffix.lower() in FORMATS or path.suffix.lower() in REFUSED


def check_size(path: Path, where: str) -> None:
    """Refuse a file (or a folder's files together) larger than is read."""
    files = [path] if path.is_file() else [f for f in path.rglob("*") if f.is_file()]
    size = sum(file.stat().st_size for file in files)
    if size > MAX_BYTES:
        found = f"{size:,} bytes at {path}"
        raise InputError(where, found, f"at most {MAX_BYTES:,} bytes")


def folder_content(path: Path) -> bytes:
    """Names and contents of a store's files, one after another: what its hash is made of."""
    files = sorted(f for f in path.rglob("*") if f.is_file())
    return b"".join(f.relative_to(path).as_posix().encode() + f.read_bytes() for f in files)
