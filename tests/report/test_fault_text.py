"""What `check` says of faults, and that the lines it prints do what it says."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from click.testing import CliRunner

from bayesimpact.cli import main
from bayesimpact.data.faults.find import find_faults, set_aside
from bayesimpact.data.read import load_campaign
from bayesimpact.report.archive import load_results

HEAD = 'name = "rig"\nmass_kg = 0.5\nstop = false\n'
ENTRY = '[[recording]]\nfile = "a.csv"\n'


def folder(path: Path) -> Path:
    rng = np.random.default_rng(0)
    t = np.arange(3000) * 1e-3
    x = -6e-3 * np.exp(-0.15 * t) * np.cos(2 * np.pi * 6.4 * t)
    x = np.concatenate([np.full(300, x[0]), x]) + 5e-6 * rng.standard_normal(3300)
    x[1200] += 1e-3
    x[2000:2030] = x[1999]
    rows = "".join(f"{100 + 1e-3 * i:.3f},{v:.9g}\n" for i, v in enumerate(x))
    (path / "a.csv").write_text("time_s,displacement_m\n" + rows)
    (path / "campaign.toml").write_text(HEAD + ENTRY)
    return path


def test_the_lines_printed_set_aside_what_was_found(tmp_path: Path) -> None:
    campaign = folder(tmp_path)
    told = CliRunner().invoke(main, ["check", str(campaign), "--out", str(tmp_path / "out")])
    assert told.exit_code == 0, told.output
    for words in ("recording_start", "recording_held", "recording_spikes", "at 101.2 s"):
        assert words in told.output
    keys = re.findall(r"^ {6}((?:start_s|end_s|exclude_s) = .*)$", told.output, re.MULTILINE)
    assert [key.split()[0] for key in keys] == ["start_s", "exclude_s"]
    expected = set_aside(load_campaign(campaign))[0].recordings[0]
    (campaign / "campaign.toml").write_text(HEAD + ENTRY + "\n".join(keys) + "\n")
    stated = load_campaign(campaign)
    assert find_faults(stated) == ()
    recording = stated.recordings[0]
    assert recording.used is not None and expected.used is not None
    np.testing.assert_array_equal(recording.used, expected.used)
    np.testing.assert_allclose(
        recording.samples[recording.used], expected.samples[expected.used], rtol=1e-12
    )
    assert (tmp_path / "out" / "check.png").stat().st_size > 10_000


def test_quiet_tells_of_faults_on_stderr_alone(tmp_path: Path) -> None:
    told = CliRunner().invoke(main, ["check", str(folder(tmp_path)), "--quiet"])
    assert told.exit_code == 0
    assert told.stdout == "" and "recording_spikes" in told.stderr


def test_keeping_is_said(tmp_path: Path) -> None:
    campaign = folder(tmp_path)
    (campaign / "campaign.toml").write_text('faults = "keep"\n' + HEAD + ENTRY)
    told = CliRunner().invoke(main, ["check", str(campaign)])
    assert 'kept in: campaign.toml says faults = "keep"' in told.stdout
    assert "exclude_s = " not in told.stdout


def test_a_fit_sets_faults_aside_and_its_report_says_so(tmp_path: Path) -> None:
    campaign = folder(tmp_path)
    told = CliRunner().invoke(main, ["fit", str(campaign), "--out", str(tmp_path / "fit")])
    assert told.exit_code == 0, told.output
    page = (tmp_path / "fit" / "report.html").read_text()
    assert "Set aside: a, " in page and "Shaded samples are set aside" in page
    results = load_results(tmp_path / "fit")
    assert results.recordings[0].count == results.recordings[0].samples.size - 32
    assert 0.9 < results.reduced_chi2 < 1.1
    assert results.rms < 5.5e-6
