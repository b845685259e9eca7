"""Figures drawn by two processes are those that one draws, in the same order."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from diagnosed import diagnosed

from bayesimpact.report.archive import save_results
from bayesimpact.report.figures.save import all_figures, drawers
from bayesimpact.report.figures.shares import read, save_all, started
from bayesimpact.report.results import Results


@pytest.fixture
def told(tmp_path: Path) -> Results:
    results = replace(diagnosed(1, 1), sampler=None, backbone=None)
    save_results(results, tmp_path)
    return results


def test_two_processes_draw_what_one_does(told: Results, tmp_path: Path) -> None:
    pictures = save_all(told, tmp_path).pictures
    assert list(pictures) == list(all_figures(told))
    files = {f.name for f in (tmp_path / "figures").iterdir()}
    assert files == {f"{name}.{kind}" for name in pictures for kind in ("png", "pdf")}
    for name, data in pictures.items():
        assert (tmp_path / "figures" / f"{name}.png").read_bytes() == data


@pytest.mark.usefixtures("coarse_figures")
@pytest.mark.parametrize("interpreter", ["/bin/false", "/no/such/file"])
def test_one_process_draws_all_where_no_other_starts(
    told: Results, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, interpreter: str
) -> None:
    monkeypatch.setattr("sys.executable", interpreter)
    assert list(save_all(told, tmp_path).pictures) == list(all_figures(told))


def test_the_second_process_draws_every_other_group(told: Results, tmp_path: Path) -> None:
    other = started(tmp_path)
    assert other is not None
    names, _ = other.communicate()
    found = read(names, tmp_path)
    assert found is not None and found.keys() == set(range(1, len(drawers(told)), 2))
