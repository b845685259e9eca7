"""Commands under a full disk, a folder that cannot be written, two runs at once, and SIGTERM."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from campaigns import TOML, decay, write
from campaigns import csv as as_csv
from small_rig import record

from bayesimpact.cli import main
from bayesimpact.data.lock import locked
from bayesimpact.data.read import load_campaign
from bayesimpact.errors import interruption_kept
from bayesimpact.inference.identify import identify
from bayesimpact.inference.posterior import _fingerprint
from bayesimpact.trial.rig.files import write_campaign

COMMAND = str(Path(sys.executable).with_name("bayesimpact"))
LIMITED = """
import resource, sys
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]),) * 2)
from bayesimpact.cli import main
main(sys.argv[2:])
"""


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("campaign")
    write_campaign(folder, record(seed=3, duration=1.0))
    return folder


def ended(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str]:
    with pytest.raises(SystemExit) as end:
        main([str(a) for a in arguments])
    return int(end.value.code or 0), capsys.readouterr().err


@pytest.mark.long
@pytest.mark.parametrize(("size", "code"), [(0, 2), (60_000, 1)])
def test_a_full_disk_ends_in_one_message(
    size: int, code: int, campaign: Path, tmp_path: Path
) -> None:
    """The largest file that may be written is so small: the library that writes NetCDF used to end
    the whole process.
    """
    done = subprocess.run(
        [sys.executable, "-c", LIMITED, str(size), "fit", str(campaign), "--out", str(tmp_path)],
        capture_output=True,
        text=True,
    )
    lines = [x for x in done.stderr.splitlines() if x.startswith("bayesimpact:")]
    assert (done.returncode, len(lines)) == (code, 1), done.stderr
    assert "too large" in lines[0] and ("to begin again: bayesimpact fit" in lines[0]) == (
        code == 1
    )
    assert "Traceback" not in done.stderr
    assert not list(tmp_path.glob(".*.nc*")), "half a file is left"


def test_an_output_folder_that_cannot_be_made(
    capsys: pytest.CaptureFixture[str], campaign: Path, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("here")
    code, error = ended(capsys, "fit", campaign, "--out", tmp_path / "file" / "out", "--quiet")
    assert code == 2 and error.count("\n") == 1 and "not a directory" in error


def test_a_read_only_output_folder(
    capsys: pytest.CaptureFixture[str],
    campaign: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The lock is the first file: where it cannot be made, nothing is begun."""

    def refused(path: object, *arguments: object) -> int:
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr("bayesimpact.data.lock.os.open", refused)
    code, error = ended(capsys, "sample", campaign, "--out", tmp_path, "--quiet")
    assert code == 2 and error.count("\n") == 1 and "permission denied" in error


def test_two_runs_into_one_folder(
    capsys: pytest.CaptureFixture[str], campaign: Path, tmp_path: Path
) -> None:
    with locked(tmp_path):
        for command in ("fit", "sample", "diagnose"):
            code, error = ended(capsys, command, campaign, "--out", tmp_path, "--quiet")
            assert code == 2 and f"process {os.getpid()}" in error and error.count("\n") == 1


def test_a_chain_that_is_a_file(
    capsys: pytest.CaptureFixture[str], campaign: Path, tmp_path: Path
) -> None:
    (tmp_path / "chain").write_text("no folder")
    code, error = ended(capsys, "sample", campaign, "--out", tmp_path, "--quiet")
    assert code == 2 and error.count("\n") == 1 and "chain" in error


@pytest.mark.long
@pytest.mark.usefixtures("coarse_figures")
def test_a_figure_that_fails_costs_nothing_else_and_report_finishes_it(
    capsys: pytest.CaptureFixture[str],
    campaign: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def search_figure(results: object) -> dict[str, object]:
        raise KeyError("g")

    with monkeypatch.context() as broken:
        broken.setattr("bayesimpact.report.figures.save.search_figure", search_figure)
        code, error = ended(capsys, "fit", campaign, "--out", tmp_path, "--quiet")
    assert code == 3 and error.count("\n") == 1 and "bayesimpact report" in error
    page = (tmp_path / "report.html").read_text()
    assert "KeyError: &#39;g&#39;" in page and page.count("<img") == 2
    with monkeypatch.context() as broken:
        broken.setattr("bayesimpact.report.write.render", search_figure)
        code, error = ended(capsys, "report", tmp_path, "--quiet")
    assert code == 3 and error.count("\n") == 1
    assert "unfinished report" in (tmp_path / "report.html").read_text()
    assert ended(capsys, "report", tmp_path, "--quiet") == (0, "")
    assert (tmp_path / "report.html").read_text().count("<img") == 3


@pytest.mark.long
def test_sigterm_is_like_ctrl_c_and_says_how_to_go_on(campaign: Path, tmp_path: Path) -> None:
    process = subprocess.Popen(
        [COMMAND, "sample", str(campaign), "--out", str(tmp_path)],
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stderr is not None
    while not (tmp_path / ".bayesimpact.lock").exists() and process.poll() is None:
        time.sleep(0.02)
    process.send_signal(signal.SIGTERM)
    error = process.stderr.read()
    process.stderr.close()
    assert process.wait() == 130, error
    last = error.splitlines()[-1]
    assert last.startswith("bayesimpact: interrupted") and "Traceback" not in error
    again = f"to begin again: bayesimpact sample {campaign} --out {tmp_path} --seed 0"
    assert last.endswith(again), "no draws are kept before the sampler has saved some"


def test_an_interruption_right_after_the_lock_says_how_to_go_on(
    campaign: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def interrupted(folder: Path) -> None:
        assert (folder / ".bayesimpact.lock").exists()
        raise KeyboardInterrupt

    monkeypatch.setattr("bayesimpact.console.clear_unfinished", interrupted)
    code, error = ended(capsys, "fit", campaign, "--out", tmp_path)
    assert code == 130
    assert f"to begin again: bayesimpact fit {campaign} --out {tmp_path}" in error.splitlines()[-1]


@pytest.mark.parametrize(
    ("command", "drawn", "told"),
    [
        (("diagnose", "--quick"), "chain/before", False),
        (("diagnose",), "", False),
        (("diagnose",), "chain/before", True),
        (("sample",), "chain", True),
        (("fit",), "chain", False),
    ],
)
def test_an_interruption_promises_only_draws_that_are_there(
    command: tuple[str, ...],
    drawn: str,
    told: bool,
    campaign: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def interrupted(folder: Path) -> None:
        if drawn:
            (folder / drawn).mkdir(parents=True)
            (folder / drawn / "block-000000.npz").write_bytes(b"")
        raise KeyboardInterrupt

    monkeypatch.setattr("bayesimpact.console.clear_unfinished", interrupted)
    name, *flags = command
    code, error = ended(capsys, name, campaign, "--out", tmp_path, *flags)
    last = error.splitlines()[-1]
    assert code == 130 and ("--resume" in last) == ("draws so far are kept" in last) == told
    assert ("nothing to resume; to begin again" in last) != told


def test_an_interruption_outlives_a_clean_up_that_fails() -> None:
    """A progress bar interrupted while it took its lock ended in AttributeError, exit code 1."""
    with pytest.raises(KeyboardInterrupt), interruption_kept():
        try:
            raise KeyboardInterrupt
        finally:
            raise AttributeError("no lock to release")
    with pytest.raises(AttributeError), interruption_kept():
        raise AttributeError("no interruption")


def test_a_comment_in_the_campaign_does_not_matter_and_a_case_does(tmp_path: Path) -> None:
    plain = TOML.split("[[recording]]")[0] + "stop = false\n"
    toml = plain + '[[recording]]\nfile = "a.csv"\n'
    prints = []
    for text, samples in (
        (toml, decay()),
        ("# a remark\n" + toml, decay()),
        (toml.replace("0.503", "0.504"), decay()),
        (toml, 1.01 * decay()),
    ):
        folder = tmp_path / str(len(prints))
        found = identify(
            load_campaign(write(folder, text, a=noisy(samples))), rng=None, search=False
        )
        prints.append(_fingerprint(found.fit))
    assert prints[0] == prints[1]
    assert [k for k in prints[0] if prints[0][k] != prints[2][k]][-1:] == ["mass"]
    assert prints[0]["samples"] != prints[3]["samples"]
    assert json.dumps(prints[0])


def noisy(samples: object) -> str:
    import numpy as np

    values = np.asarray(samples)
    return as_csv(values + 5e-6 * np.random.default_rng(1).standard_normal(values.size))
