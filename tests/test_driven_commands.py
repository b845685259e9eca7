"""The commands on a campaign of a free decay and a driven recording."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from driven_rigs import driven_rig
from driven_twin import driven_motion

from bayesimpact.cli import main
from bayesimpact.data.campaign import Campaign
from bayesimpact.data.input import Input
from bayesimpact.data.recording import Recording

TRUTH = {"mass": 0.5, "c1": 0.6, "k1": 800.0, "c2": 2.0, "g": 1.1e-3, "k2": 5000.0}
INTERVAL, SAMPLES, GAIN = 2e-3, 900, 2.5


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    times = np.arange(SAMPLES) * INTERVAL
    force = 1.5 * np.sin(2 * np.pi * (4.0 * times + 1.5 * times**2))
    rng = np.random.default_rng(5)
    recordings = []
    for name, start, push in (("free", -6e-3, 0.0 * force), ("driven", 1e-4, force)):
        motion, _ = driven_motion({**TRUTH, "y0": start, "v0": 0.0}, push, INTERVAL)
        given = None if name == "free" else Input(force / GAIN, free=True)
        samples = motion + 5e-6 * rng.standard_normal(SAMPLES)
        recordings.append(Recording(name, "1", samples, INTERVAL, input=given))
    folder = tmp_path_factory.mktemp("driven")
    Campaign("driven rig", TRUTH["mass"], tuple(recordings)).save(folder)
    return folder


def _run(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    with pytest.raises(SystemExit) as ended:
        main([str(a) for a in arguments])
    captured = capsys.readouterr()
    assert ended.value.code in (0, None), captured.err
    return captured.out


@pytest.mark.usefixtures("coarse_figures")
def test_check_fit_and_report(
    campaign: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said = _run(capsys, "check", campaign, "--out", tmp_path / "check")
    assert "input of driven: force_N" in said and "gain free" in said and "input_gain" in said
    _run(capsys, "fit", campaign, "--out", tmp_path)
    rows = json.loads((tmp_path / "fit.json").read_text())["parameters"]
    truth = {"k1": 800.0, "g": 1.1e-3, "k2[1]": 5000.0, "input_gain": GAIN}
    for name, value in truth.items():
        assert abs(rows[name]["mode"] - value) < 4.5 * rows[name]["sd"], name
    page = (tmp_path / "report.html").read_text()
    assert "With a measured input" in page and "gain of the measured input" in page


@pytest.mark.long
@pytest.mark.usefixtures("coarse_figures")
def test_a_quick_diagnosis(
    campaign: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _run(capsys, "diagnose", campaign, "--out", tmp_path, "--quick")
    found = json.loads((tmp_path / "diagnosis.json").read_text())
    assert found["verdict"] == "adequate"
    assert found["fit"]["after"]["reduced_chi2"] == pytest.approx(1.0, abs=0.3)
    _run(capsys, "report", tmp_path)


@pytest.mark.long
@pytest.mark.usefixtures("coarse_figures")
def test_an_accelerometer_on_a_mass_whose_base_moves(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rig = driven_rig(3, "acceleration", lambda y, v, touching: 3e6 * y**3)
    rig.campaign.save(tmp_path / "rig")
    assert "absolute = true" in (tmp_path / "rig" / "campaign.toml").read_text()
    said = _run(capsys, "check", tmp_path / "rig", "--out", tmp_path / "check")
    assert "recordings of acceleration" in said and "base_m, absolute" in said
    _run(capsys, "diagnose", tmp_path / "rig", "--out", tmp_path / "out", "--quick")
    found = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert [e["id"] for e in found["effects"]] == ["spring_cubic"]
    median = found["effects"][0]["parameters"]["spring_cubic.stiffness"]["median"]
    assert median == pytest.approx(3e6, rel=0.05)
    assert found["parameters"]["after"]["offset[a]"]["unit"] == "m/s2"
    assert found["parameters"]["after"]["y0[a]"]["unit"] == "m"
    page = (tmp_path / "out" / "report.html").read_text()
    assert "own motion is counted" in page and "only ratios to the mass" in page
