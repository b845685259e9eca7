"""What can go wrong, as types: everything raised on purpose is a `BayesimpactError`."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

# A message fills ten lines of a terminal at most: these are characters of its three parts.
WHERE, FOUND, ACCEPTED = 240, 260, 280


def seen(text: str, most: int) -> str:
    """Text from a file as a terminal may show it: control characters escaped, the middle left out
    where it is longer than `most` characters.
    """
    if len(text) > most:
        half = (most - 5) // 2
        text = f"{text[:half]} ... {text[-half:]}"
    if text.isprintable():
        return text
    shown = (c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)
    return "".join(shown)


class BayesimpactError(Exception):
    """Base of every error that the package raises on purpose."""


class InputError(BayesimpactError, ValueError):
    """Something handed in cannot be used; the command line turns it into exit code 2.

    Parameters
    ----------
    where : the file, line, key or argument at fault
    found : what was found there
    accepted : what would have been accepted
    """

    def __init__(self, where: str, found: str, accepted: str) -> None:
        parts = (seen(where, WHERE), seen(found, FOUND), seen(accepted, ACCEPTED))
        super().__init__("{}: found {}; accepted: {}".format(*parts))
        self.where = where
        self.found = found
        self.accepted = accepted


class SimulationError(BayesimpactError, RuntimeError):
    """A simulation ended with a failure code (see `bayesimpact.model.exact.simulate.CODES`)."""


def system_words(error: OSError) -> str:
    """What the operating system refused, and where, in one line."""
    place = "" if error.filename is None else f"{seen(os.fsdecode(error.filename), 300)}: "
    return f"{place}{(error.strerror or str(error)).lower()}"


@contextmanager
def terminated_like_ctrl_c() -> Iterator[None]:
    """A polite request to end (SIGTERM, as a scheduler or a shutdown sends it) is as Ctrl-C."""

    def interrupt(number: int, frame: Any) -> None:
        raise KeyboardInterrupt

    try:
        before = signal.signal(signal.SIGTERM, interrupt)
    except ValueError:  # not in the main thread: the caller has its own way
        yield
        return
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


@contextmanager
def interruption_kept() -> Iterator[None]:
    """Where a library's clean-up fails after Ctrl-C, what is raised is still the interruption."""
    try:
        yield
    except Exception as error:
        cause: BaseException | None = error
        while cause is not None and not isinstance(cause, KeyboardInterrupt):
            cause = cause.__cause__ or cause.__context__
        if cause is None:
            raise
        raise KeyboardInterrupt from error
