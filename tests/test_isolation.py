"""Nothing in a working folder or beside recordings is ever imported, executed or obeyed."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from campaigns import write
from small_fleet import write_fleet

from bayesimpact.report.archive import save_results

PLANTED = (
    *(
        "json",
        "numpy",
        "matplotlib",
        "subprocess",
        "pathlib",
        "h5netcdf",
        "h5py",
        "numba",
        "csv",
        "hashlib",
        "threading",
        "signal",
    ),
    *("bayesimpact", "sitecustomize", "usercustomize", "click", "jinja2", "arviz", "scipy"),
)


def trap(folder: Path, marker: Path) -> None:
    """Modules that leave a mark when imported, and settings that would break every figure."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in PLANTED:
        code = f"open({str(marker)!r}, 'a').write({name!r} + chr(10))\n"
        (folder / f"{name}.py").write_text(code)
    (folder / "matplotlibrc").write_text("text.usetex: True\nfont.size: 77\n")
    (folder / ".numba_config.yaml").write_text(f"cache_dir: {folder}/cache\n")


@pytest.fixture
def diagnosed(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The made-up diagnosis of the report's tests."""
    monkeypatch.syspath_prepend(str(Path(__file__).parent / "report"))
    import diagnosed

    return diagnosed.diagnosed


def test_modules_beside_the_recordings_are_never_imported(tmp_path: Path, diagnosed: Any) -> None:
    marker, here, results = tmp_path / "marker", tmp_path / "here", tmp_path / "results"
    campaign = write(tmp_path / "campaign")
    for folder in (here, results, campaign):
        trap(folder, marker)
    few = replace(diagnosed(1, 1, sampled=False), diagnosis_arrays={}, before_backbone=None)
    save_results(few, results)
    command = str(Path(sys.executable).with_name("bayesimpact"))
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
    for arguments, place in (
        (["effects"], here),
        (["report", "."], results),
        (["check", str(campaign), "--out", str(tmp_path / "out")], campaign),
    ):
        done = subprocess.run(
            [command, *arguments], cwd=place, env=environment, capture_output=True, text=True
        )
        assert (done.returncode, done.stderr) == (0, ""), done.stderr
        assert not marker.exists(), marker.read_text()
    assert (results / "report.html").stat().st_size > 10_000
    assert not (here / "cache").exists() and not (campaign / "cache").exists()


@pytest.mark.long
def test_workers_import_nothing_from_the_working_folder(tmp_path: Path) -> None:
    """Dask's are new processes, started in the working folder."""
    marker, here = tmp_path / "marker", tmp_path / "here"
    fleet = write_fleet(tmp_path / "fleet", 1)
    trap(here, marker)
    command = str(Path(sys.executable).with_name("bayesimpact"))
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
    out = tmp_path / "out"
    arguments = ["fleet", str(fleet), "--workers", "2", "--quiet", "--out", str(out)]
    done = subprocess.run(
        [command, *arguments], cwd=here, env=environment, capture_output=True, text=True
    )
    assert not marker.exists(), marker.read_text()
    assert done.returncode == 0, done.stderr
    assert len((out / "fleet.csv").read_text().splitlines()) == 2
