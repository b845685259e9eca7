"""Figures drawn by two processes are those that one draws, in the same order."""

from __future__ import annotations

import subprocess
from dataclasses import replace
from pathlib import Path

import pytest
from diagnosed import diagnosed

from bayesimpact.report.archive import save_results
from bayesimpact.report.figures.save import all_figures
from bayesimpact.report.figures.shares import save_all
from bayesimpact.report.results import Results


@pytest.fixture
def told(tmp_path: Path) -> Results:
    results = replace(diagnosed(), sampler=None, backbone=None)
    save_results(results, tmp_path)
    return results


def test_two_processes_draw_what_one_does(told: Results, tmp_path: Path) -> None:
    pictures = save_all(told, tmp_path)
    assert list(pictures) == list(all_figures(told))
    files = {f.name for f in (tmp_path / "figures").iterdir()}
    assert files == {f"{name}.{kind}" for name in pictures for kind in ("png", "pdf")}
    for name, data in pictures.items():
        assert (tmp_path / "figures" / f"{name}.png").read_bytes() == data


def test_one_process_draws_all_where_no_other_starts(
    told: Results, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.executable", "/bin/false")
    begun: list[object] = []
    usual = subprocess.Popen

    def popen(*arguments: object, **options: object) -> object:
        begun.append(arguments)
        return usual(*arguments, **options)  # type: ignore[call-overload]

    monkeypatch.setattr(subprocess, "Popen", popen)
    assert list(save_all(told, tmp_path)) == list(all_figures(told))
    assert len(begun) == 1
