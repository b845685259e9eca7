"""Results as files: nothing lost, nothing half written, nothing unreadable believed."""

from __future__ import annotations

import json
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from synthetic import make_results

from bayesimpact.data.files import atomic
from bayesimpact.errors import InputError
from bayesimpact.report.archive import FIT_FILE, RESULTS_FILE, load_results, save_results
from bayesimpact.report.codec import decode, encode
from bayesimpact.report.results import Draws, Results


def assert_same(a: Any, b: Any, path: str = "results") -> None:
    """Equal in every field; arrays bit for bit, NaN equal to NaN."""
    if is_dataclass(a):
        assert type(a) is type(b), path
        for f in fields(a):
            assert_same(getattr(a, f.name), getattr(b, f.name), f"{path}.{f.name}")
    elif isinstance(a, np.ndarray):
        np.testing.assert_array_equal(a, b, err_msg=path)
        assert a.dtype == b.dtype, path
    elif isinstance(a, tuple):
        assert isinstance(b, tuple) and len(a) == len(b), path
        for i, (x, y) in enumerate(zip(a, b, strict=True)):
            assert_same(x, y, f"{path}[{i}]")
    elif isinstance(a, dict):
        assert a.keys() == b.keys(), path
        for key in a:
            assert_same(a[key], b[key], f"{path}.{key}")
    else:
        assert a == b or (a != a and b != b), path


def full_results() -> Results:
    """Results that fill every field."""
    results = make_results()
    assert results.draws is not None
    return replace(
        results,
        before=Draws("before", ("k1",), ("N/m",), np.ones((5, 1))),
        diagnosis={"verdict": "named", "location": None, "share": 0.5, "ids": ["a", "b"], "n": 3},
        diagnosis_arrays={"force": np.arange(6.0).reshape(2, 3)},
    )


@pytest.mark.parametrize("results", [full_results(), make_results(1, stop=False, sampled=False)])
def test_round_trip(results: Results, tmp_path: Path) -> None:
    save_results(results, tmp_path)
    assert_same(results, load_results(tmp_path))
    assert {f.name for f in tmp_path.iterdir()} == {RESULTS_FILE, FIT_FILE}


def test_infinities_and_awkward_names_survive(tmp_path: Path) -> None:
    results = make_results()
    odd = replace(results.recordings[0], name='a/b "ü".1', whiteness_p=float("inf"))
    results = replace(results, recordings=(odd,), log_posterior=float("-inf"))
    save_results(results, tmp_path)
    assert_same(results, load_results(tmp_path))


def test_fit_json_is_strict_and_complete(tmp_path: Path) -> None:
    results = make_results()
    save_results(results, tmp_path)

    def refuse(name: str) -> None:
        raise AssertionError(f"{name} is no JSON")

    content = json.loads((tmp_path / FIT_FILE).read_text(), parse_constant=refuse)
    assert list(content["parameters"]) == [row.name for row in results.rows] == content["names"]
    k1 = content["parameters"]["k1"]
    assert (k1["mode"], k1["sd"], k1["unit"]) == (808.556, 3e-3, "N/m")
    assert np.allclose(content["covariance"], results.covariance, rtol=0, atol=0)
    assert content["search"]["best"][-1] == results.search.best[-1]
    assert content["parameters"]["g"]["over_mass"] is None
    assert content["seed"] == 7 and len(content["checks"]) == len(results.checks)


def test_folder_without_results(tmp_path: Path) -> None:
    for folder in (tmp_path, tmp_path / "absent"):
        with pytest.raises(InputError, match="no results"):
            load_results(folder)


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    (tmp_path / RESULTS_FILE).write_text("hello")
    with pytest.raises(InputError, match="cannot be read"):
        load_results(tmp_path)
    save_results(make_results(1), tmp_path)
    data = (tmp_path / RESULTS_FILE).read_bytes()
    (tmp_path / RESULTS_FILE).write_bytes(data[: len(data) // 2])
    with pytest.raises(InputError, match="cannot be read"):
        load_results(tmp_path)
    (tmp_path / RESULTS_FILE).write_bytes(
        data.replace(b"bayesimpact/results/1", b"bayesimpact/results/9")
    )
    with pytest.raises(InputError, match="results/9"):
        load_results(tmp_path)


def test_interrupted_write_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "file.txt"
    path.write_text("old")
    with pytest.raises(KeyboardInterrupt), atomic(path) as temporary:
        temporary.write_text("half")
        raise KeyboardInterrupt
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]
    with atomic(path) as temporary:
        temporary.write_text("new")
        assert path.read_text() == "old"
    with path.open() as reader:
        with atomic(path) as temporary:
            temporary.write_text("newer")
        assert reader.read() == "new"  # whoever reads goes on reading the old file
    assert path.read_text() == "newer"
    assert path.stat().st_mode & 0o777 == (tmp_path / "file.txt").stat().st_mode & 0o777
    other = tmp_path / "plain.txt"
    other.write_text("")
    assert path.stat().st_mode == other.stat().st_mode  # not the private mode of a temporary file


@dataclass(frozen=True)
class Inner:
    size: int
    name: str


@dataclass(frozen=True)
class Outer:
    inners: tuple[Inner, ...]
    pair: tuple[float, float]
    maybe: Inner | None


@pytest.mark.parametrize(
    "text",
    [
        '{"inners": [], "pair": [1, 2]}',
        '{"inners": [], "pair": [1], "maybe": null}',
        '{"inners": [{"size": "x", "name": "a"}], "pair": [1, 2], "maybe": null}',
        '{"inners": [{"size": 1.5, "name": "a"}], "pair": [1, 2], "maybe": null}',
        '{"inners": [{"size": 1, "name": 2}], "pair": [1, 2], "maybe": null}',
        '{"inners": [], "pair": "12", "maybe": null}',
        '{"inners": [], "pair": [1, 2], "maybe": 3}',
        "[]",
    ],
)
def test_text_that_does_not_fit_the_record_is_refused(text: str) -> None:
    with pytest.raises(ValueError):
        decode(Outer, text, {})


def test_codec_keeps_types() -> None:
    outer = Outer((Inner(1, "é"), Inner(2, "")), (1.0, float("nan")), None)
    text, arrays = encode(outer)
    assert arrays == {}
    assert_same(outer, decode(Outer, text, {}))
    with pytest.raises(TypeError, match="object"):
        encode(Outer((), (object(), 1.0), None))  # type: ignore[arg-type]
