"""Figures drawn by two processes are those that one draws, in the same order."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from diagnosed import diagnosed

import bayesimpact
from bayesimpact.report.archive import save_results
from bayesimpact.report.figures.save import DPI, all_figures, drawers
from bayesimpact.report.figures.shares import read, save_all, started
from bayesimpact.report.html import png_size
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


def test_the_second_process_draws_every_other_group_and_obeys_no_working_folder(
    told: Results, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where this process would: started in a folder that is on its module path."""
    here = tmp_path / "here"
    here.mkdir()
    for name in ("json", "matplotlib", "bayesimpact", "sitecustomize"):
        (here / f"{name}.py").write_text("raise SystemExit(3)\n")
    monkeypatch.chdir(here)
    monkeypatch.setenv("PYTHONPATH", str(here))
    for entry in ("", ".", str(here)):
        monkeypatch.syspath_prepend(entry)
    other = started(tmp_path)
    assert other is not None
    names, _ = other.communicate()
    found = read(names, tmp_path)
    assert found is not None and found.keys() == set(range(1, len(drawers(told)), 2))


def test_both_processes_run_the_package_that_was_called(told: Results, tmp_path: Path) -> None:
    """Another one than the interpreter's own, whose every picture has fewer points."""
    few = replace(told, diagnosis_arrays={}, draws=None, before=None)
    save_results(few, tmp_path)
    other = tmp_path / "other" / "bayesimpact"
    shutil.copytree(Path(bayesimpact.__file__).parent, other)
    saving, dpi = other / "report" / "figures" / "save.py", DPI // 3
    saving.write_text(saving.read_text().replace(f"\nDPI = {DPI}\n", f"\nDPI = {dpi}\n"))
    subprocess.run(
        [sys.executable, "-P", "-m", "bayesimpact", "report", str(tmp_path), "--quiet"],
        env=os.environ | {"PYTHONPATH": str(other.parent)},
        check=True,
    )
    for name, figure in all_figures(few).items():
        width, _ = png_size((tmp_path / "figures" / f"{name}.png").read_bytes())
        assert abs(width - dpi * figure.get_size_inches()[0]) <= 1, name
