"""From instrument files to a diagnosis in a process of its own, with nobody there to answer."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from nptdms import ChannelObject, TdmsWriter
from scipy.io import savemat
from small_rig import record

from bayesimpact.data.recording import Recording


def _csv(path: Path, recording: Recording) -> None:
    pairs = zip(recording.times.tolist(), (recording.samples * 1e3).tolist(), strict=True)
    rows = [f"{t:.6f},{x:.6f}" for t, x in pairs]
    path.write_text("\n".join(["Time [s],Displacement [mm]", *rows]) + "\n")


def _mat(path: Path, recording: Recording) -> None:
    savemat(path, {"t": recording.times, "x": recording.samples * 1e3})


def _tdms(path: Path, recording: Recording) -> None:
    said = {"wf_increment": recording.interval, "wf_start_offset": 0.0, "unit_string": "mm"}
    force = ChannelObject("log", "force", 0.0 * recording.samples, {"unit_string": "N"})
    with TdmsWriter(str(path)) as writer:
        writer.write_segment([force, ChannelObject("log", "tip", recording.samples * 1e3, said)])


def _run(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """A command in `folder` without a terminal, its stdin closed."""
    command = [sys.executable, "-I", "-m", "bayesimpact", *arguments]
    return subprocess.run(
        command,
        cwd=folder,
        text=True,
        capture_output=True,
        start_new_session=True,  # no terminal to fall back on
        preexec_fn=lambda: os.close(0),
        timeout=900,
        check=False,
    )


def _new(folder: Path, ending: str, writer: Callable[[Path, Recording], None]) -> str:
    """Files of two releases onto one obstacle, and the campaign from them; what was said."""
    for recording in record(seed=3, duration=1.0).recordings[:2]:
        writer(folder / f"{recording.name}.{ending}", recording)
    said = ["--mass", "0.503"] + ["--unit", "mm"] * (ending == "mat")
    made = _run(folder, "new", "rig", f"a.{ending}", f"b.{ending}", *said)
    assert made.returncode == 0, made.stderr
    return made.stdout


KINDS = pytest.mark.parametrize(
    ("ending", "writer"), [("csv", _csv), ("mat", _mat), ("tdms", _tdms)]
)


@KINDS
def test_a_campaign_is_made_that_can_be_read(
    tmp_path: Path, ending: str, writer: Callable[[Path, Recording], None]
) -> None:
    assert "ready for: bayesimpact check rig, bayesimpact diagnose rig" in _new(
        tmp_path, ending, writer
    )
    checked = _run(tmp_path, "check", "rig")
    assert checked.returncode == 0, checked.stderr
    assert not checked.stderr


@pytest.mark.slow
@KINDS
def test_it_is_diagnosed(
    tmp_path: Path, ending: str, writer: Callable[[Path, Recording], None]
) -> None:
    _new(tmp_path, ending, writer)
    diagnosed = _run(tmp_path, "diagnose", "rig", "--quick")
    assert diagnosed.returncode == 0, diagnosed.stderr
    found = json.loads((tmp_path / "rig" / "diagnose" / "diagnosis.json").read_text())
    assert found["verdict"] == "adequate"
    assert found["parameters"]["before"]["k1"]["median"] == pytest.approx(808.6, rel=0.01)
    assert (tmp_path / "rig" / "diagnose" / "report.html").is_file()
