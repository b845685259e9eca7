"""Python's collector of unreachable cycles, held back while figures are drawn.

Drawing makes objects by the hundred thousand and keeps most of them until the figure is done: the
collector looked through all of them again and again, for a seventh of the time.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def held_back() -> Iterator[None]:
    """No collection inside; afterwards the collector is as it was."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()
