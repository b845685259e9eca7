"""The one way in which the package compiles: numba, cached under a stamp of the sources below.

numba's cache notices a change only in the file of the compiled function itself, not in the files
of the functions it calls. Here the stamp of a function covers its own file and every file of the
package that this one imports, directly or not, so a change anywhere below compiles it anew.
"""

from __future__ import annotations

import hashlib
import re
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numba.core import event
from numba.core.caching import NullCache
from numba.core.ccallback import CFunc
from numba.core.sigutils import normalize_signature

_normalize: Any = normalize_signature  # without annotations
# numba reads settings from a .numba_config.yaml of the working folder (a cache of foreign machine
# code among them): a name that no file can have takes that back.
_settings: Any = numba.core.config
_settings._config_fname = "\N{REPLACEMENT CHARACTER}/"
_settings.reload_config()
_ROOT = Path(__file__).parents[3]
_IMPORT = re.compile(r"^\s*from (bayesimpact[\w.]*) import (\([^)]*\)|[^\n]*)", re.MULTILINE)


@cache
def source_stamp(path: Path) -> str:
    """SHA-256 over a source file and all files of the package that it imports, directly or not."""
    digest = hashlib.sha256()
    for file in sorted(_dependencies(path)):
        digest.update(file.name.encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()


def _dependencies(path: Path) -> set[Path]:
    found, waiting = set(), [path]
    while waiting:
        file = waiting.pop()
        if file not in found and file.exists():
            found.add(file)
            for module, names in _IMPORT.findall(file.read_text(encoding="utf-8")):
                folder = _ROOT.joinpath(*module.split("."))
                waiting.append(folder.with_suffix(".py"))
                waiting += [folder / f"{name}.py" for name in re.findall(r"\w+", names)]
    return found


def compiled(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Decorate a function to be compiled on first call, with `numba.njit`'s options.

    Division by zero gives inf or NaN as in NumPy (no check in inner loops), never an exception.
    """
    usual: dict[str, Any] = {"cache": True, "error_model": "numpy", "no_cfunc_wrapper": True}

    def decorate(function: Callable[..., Any]) -> Any:
        return _stamped(numba.njit(**usual | options)(function), function)

    return decorate


def inner(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Decorate a function that only compiled functions call.

    It has no entry from Python, whose compilation takes as long as that of a small function: called
    from there, the interpreter crashes.
    """
    return compiled(no_cpython_wrapper=True, **options)


def compiled_callback(signature: Any) -> Callable[[Callable[..., Any]], Any]:
    """Decorate a function to be compiled at once as a C callback (`.address` is its pointer).

    A function typed into a session has no file beside which it could be cached.
    """

    def decorate(function: Callable[..., Any]) -> Any:
        parsed = _normalize(signature)
        callback: Any = CFunc(function, parsed, {}, {"error_model": "numpy"})
        if Path(function.__code__.co_filename).exists():
            callback.enable_caching()
        _stamped(callback, function).compile()  # `numba.cfunc` leaves no room for the stamp
        return callback

    return decorate


def _stamped(made: Any, function: Callable[..., Any]) -> Any:
    cache_file = getattr(made._cache, "_cache_file", None)
    if cache_file is not None:
        stamp = source_stamp(Path(function.__code__.co_filename))
        cache_file._source_stamp = stamp
        # compared before anything is unpickled: an older index may hold classes that are gone
        cache_file._version = f"{numba.__version__} {stamp}"
    return made


@compiled()
def typed(number: int) -> int:
    """The same number as one of its type: numba compiles every callee once more for a literal."""
    return int(np.int64(number))


@contextmanager
def compilation_announced(say: Callable[[str], None], after: float = 1.0) -> Iterator[None]:
    """Call `say` `after` so many seconds of whatever must be compiled, and at its end; a later run
    finds it in the cache.
    """
    listener: Any = _Announcer(say, after)
    with event.install_listener("numba:compile", listener):  # type: ignore[no-untyped-call]
        yield


@contextmanager
def compilation_left_out(clock: Callable[[], float]) -> Iterator[Callable[[], float]]:
    """A clock, s, that stands still while anything is compiled."""
    listener: Any = _Stopwatch(clock)
    with event.install_listener("numba:compile", listener):  # type: ignore[no-untyped-call]
        yield listener.left_out


class _Stopwatch(event.Listener):  # type: ignore[misc]
    """Adds up how long outermost functions, whosoever's they are, take to be compiled."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self.clock, self.seconds = clock, 0.0
        self.starts: list[float] = []

    def left_out(self) -> float:
        """The clock's reading less what compiling has taken; that of its begin while it goes on."""
        return (self.starts[0] if self.starts else self.clock()) - self.seconds

    def on_start(self, event: Any) -> None:
        self.starts.append(self.clock())

    def on_end(self, event: Any) -> None:
        if not self.starts:  # it was being compiled before this clock began
            return
        begun = self.starts.pop()
        if not self.starts:
            self.seconds += self.clock() - begun


class _Announcer(event.Listener):  # type: ignore[misc]
    """Speaks of outermost functions of the package, not of those that they call or short waits."""

    def __init__(self, say: Callable[[str], None], after: float) -> None:
        self.say, self.after = say, after
        self.starts: list[float] = []
        self.told = False
        self.waiting = threading.Timer(after, self._tell, [""])

    def _tell(self, words: str) -> None:
        if words:
            self.told = True
            self.say(words)

    def on_start(self, event: Any) -> None:
        if not self.starts:
            dispatcher = event.data["dispatcher"]
            kept = not isinstance(dispatcher._cache, NullCache)
            name = f"{dispatcher.py_func.__module__}.{dispatcher.py_func.__name__}"
            words = f"compiling {name}" + ", once: later runs find it in the cache" * kept
            self.told = False
            if not name.startswith("bayesimpact."):  # ArviZ compiles, too, for a moment
                words = ""
            self.waiting = threading.Timer(self.after, self._tell, [words])
            self.waiting.daemon = True
            self.waiting.start()
        self.starts.append(time.perf_counter())

    def on_end(self, event: Any) -> None:
        seconds = time.perf_counter() - self.starts.pop()
        if not self.starts:
            self.waiting.cancel()
            if self.told:
                self.say(f"compiled in {seconds:.1f} s")
