"""The one way in which the package compiles: numba, cached on disk under a stamp of all the model's sources.

numba's cache notices a change only in the file of the compiled function itself, not in the files of
the functions it calls. Here they all share one stamp, a hash of every source file below `model/`, so a
change anywhere compiles everything anew.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba


@cache
def source_stamp() -> str:
    """SHA-256 over every Python file below `model/` (names and contents)."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.rglob("*.py")):
        digest.update(path.name.encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()


def compiled(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Decorate a function to be compiled on first call, with `numba.njit`'s options.

    Division by zero gives inf or NaN as in NumPy (no check in inner loops), never an exception.
    """

    def decorate(function: Callable[..., Any]) -> Any:
        return _stamped(numba.njit(**{"cache": True, "error_model": "numpy", **options})(function))

    return decorate


def compiled_callback(signature: Any) -> Callable[[Callable[..., Any]], Any]:
    """Decorate a function to be compiled at once as a C callback (`.address` is its pointer)."""

    def decorate(function: Callable[..., Any]) -> Any:
        return numba.cfunc(signature, cache=True)(function)

    return decorate


def _stamped(dispatcher: Any) -> Any:
    cache_file = getattr(dispatcher._cache, "_cache_file", None)
    if cache_file is not None:
        cache_file._source_stamp = source_stamp()
    return dispatcher
