"""One run at a time in a folder: a lock of the operating system, which ends with its process.

A crash or a kill leaves the empty file behind but not the lock, so nothing has to be cleared away.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from bayesimpact.errors import InputError

LOCK_FILE = ".bayesimpact.lock"


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold an existing folder for this process.

    Raises
    ------
    InputError : another process holds it
    OSError : the folder cannot be written
    """
    handle = os.open(folder / LOCK_FILE, os.O_RDWR | os.O_CREAT, 0o666)
    try:
        if not _taken(handle):
            owner = os.pread(handle, 32, 0).decode("ascii", "replace").strip()
            process = f" (process {owner})" if owner else ""
            found = f"another run at work in this folder{process}"
            raise InputError(str(folder), found, "another folder, or to wait until it is done")
        os.ftruncate(handle, 0)
        os.pwrite(handle, str(os.getpid()).encode("ascii"), 0)
        yield
    finally:
        os.close(handle)  # and with it the lock


def _taken(handle: int) -> bool:
    try:
        import fcntl
    except ImportError:  # a system without such locks: the user must take care
        return True
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # a file system without locks
        return True
    return True
