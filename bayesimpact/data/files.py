"""Files that are there in full or not at all: written beside their place, then moved there.

An interrupted run leaves the old file, and the next one clears away what a killed one had begun.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

UNFINISHED = ".bayesimpact-"  # begins the name of a file that is being written
_DEPTHS = ("", "*/", "*/*/")  # below a results folder, where files are written


@contextmanager
def atomic(path: Path) -> Iterator[Path]:
    """A temporary file in the same folder; it takes the place of `path` when the block succeeds."""
    handle, name = tempfile.mkstemp(
        dir=path.parent, prefix=f"{UNFINISHED}{path.name}.", suffix=path.suffix
    )
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(0o666 & ~_umask())
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def write_text(path: Path, text: str) -> None:
    """Write a text file in one go; what UTF-8 cannot say (bytes of a foreign path) becomes a ?."""
    write_bytes(path, text.encode("utf-8", "replace"))


def write_bytes(path: Path, content: bytes | memoryview) -> None:
    """Write a file in one go, down to the disk."""
    with atomic(path) as temporary, open(temporary, "wb") as stream:
        stream.write(content)
        stream.flush()
        os.fsync(stream.fileno())


def clear_unfinished(folder: Path) -> None:
    """Remove what killed runs left in a results folder, which is held by this process."""
    for depth in _DEPTHS:
        for file in folder.glob(f"{depth}{UNFINISHED}*"):
            if not file.name.endswith(".lock"):
                file.unlink(missing_ok=True)
