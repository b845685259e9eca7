"""The stamp of a compiled function covers every file that it depends on, and no other."""

import pickle
import threading
from pathlib import Path

import numba
import pytest

from bayesimpact.model.jit import compiled


@pytest.fixture
def sources(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "bayesimpact" / "model"
    folder.mkdir(parents=True)
    (folder / "top.py").write_text("from bayesimpact.model.middle import (\n    f,\n)\n")
    (folder / "middle.py").write_text("from bayesimpact.model import absent, bottom\n")
    (folder / "bottom.py").write_text("x = 1\n")
    (folder / "other.py").write_text("x = 1\n")
    monkeypatch.setattr(compiled, "_ROOT", tmp_path)
    return folder


def stamp(path: Path) -> str:
    compiled.source_stamp.cache_clear()
    return compiled.source_stamp(path)


@pytest.mark.parametrize("name", ["top.py", "middle.py", "bottom.py"])
def test_a_change_below_changes_the_stamp(sources: Path, name: str) -> None:
    before = stamp(sources / "top.py")
    (sources / name).write_text((sources / name).read_text() + "y = 2\n")
    assert stamp(sources / "top.py") != before


def test_a_change_elsewhere_does_not(sources: Path) -> None:
    before = stamp(sources / "top.py")
    (sources / "other.py").write_text("x = 2\n")
    assert stamp(sources / "top.py") == before


def half(x: float) -> float:
    return 0.5 * x


def test_a_callback_has_the_same_stamp_as_any_compiled_function() -> None:
    compiled.source_stamp.cache_clear()
    callback = compiled.compiled_callback("float64(float64)")(half)
    assert callback.ctypes(3.0) == 1.5
    found = callback._cache._cache_file._source_stamp
    assert found == compiled.compiled()(half)._cache._cache_file._source_stamp
    assert found == compiled.source_stamp(Path(__file__))


def test_the_outermost_compilation_is_announced_once() -> None:
    @numba.njit  # type: ignore[untyped-decorator]
    def below(x: float) -> float:
        return x + 1.0

    @numba.njit  # type: ignore[untyped-decorator]
    def above(x: float) -> float:
        return 2.0 * below(x)

    above.py_func.__module__ = "bayesimpact.model.example"
    said: list[str] = []
    with compiled.compilation_announced(said.append, after=0.001):
        assert above(3.0) == above(3.0) == 8.0
        assert below(1) == 2.0  # of another package
    assert len(said) == 2
    assert said[0] == "compiling bayesimpact.model.example.above"  # this one is not kept
    assert said[1].startswith("compiled in ")
    with compiled.compilation_announced(said.append, after=60.0):
        assert above(1) == 4.0  # over in a moment: nothing that a user would wonder about
    waiting = [one for one in threading.enumerate() if isinstance(one, threading.Timer)]
    for one in waiting:
        one.join(5.0)
    assert len(said) == 2 and not any(one.is_alive() for one in waiting)
    above(1j)  # compiles anew, for complex numbers, and nobody listens
    assert len(said) == 2


def test_a_cache_of_older_sources_is_never_unpickled(tmp_path: Path) -> None:
    """It may hold classes that are gone: pulling a new version must not end in a traceback."""
    cache_file = compiled.compiled()(half)._cache._cache_file
    cache_file._index_path = str(tmp_path / "index.nbi")
    missing = b"cbayesimpact.model.tables\nGone\n."  # protocol 0: a global of that name
    older = pickle.dumps(numba.__version__), pickle.dumps(f"{numba.__version__} older")
    for version in older:
        (tmp_path / "index.nbi").write_bytes(version + missing)
        assert cache_file._load_index() == {}


def test_a_clock_stands_still_while_something_is_compiled() -> None:
    readings = iter(range(0, 1000, 10))

    @numba.njit  # type: ignore[untyped-decorator]
    def below(x: float) -> float:
        return x + 1.0

    @numba.njit  # type: ignore[untyped-decorator]
    def above(x: float) -> float:
        return below(x) + 1.0

    with compiled.compilation_left_out(lambda: next(readings)) as clock:
        assert clock() == 0
        assert above(1.0) == 3.0  # read at 10 and 40, and at 20 and 30 for what it calls
        assert clock() == 50 - 30
        assert above(2.0) == 4.0
        assert clock() == 60 - 30
