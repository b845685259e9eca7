"""`bayesimpact new`: a campaign.toml from instrument files, never over another."""

from __future__ import annotations

from pathlib import Path

import instrument_files as made
import numpy as np
import pytest
from campaigns import csv, decay
from click.testing import CliRunner, Result

from bayesimpact.cli import main
from bayesimpact.data.read import load_campaign


def _new(folder: Path, *arguments: object) -> Result:
    return CliRunner().invoke(main, ["new", str(folder), *map(str, arguments)])


SILENT = "Time [s],Pos [mm],Load [N]"  # a channel that nothing was connected to
COMPLETE = [
    *("MATLAB structure", "HDF5", "UFF58", "TDMS", "LVM", "Excel", "NetCDF 3", "NetCDF 4", "Zarr"),
    *("Parquet", "npz", "units in the header", "units in a second row", "NI", "Polytec", "LMS"),
    *("Keyence", "Latin-1", "UTF-16", "decimal commas, blanks", "trailing separators"),
]


@pytest.mark.parametrize("kind", COMPLETE)
def test_files_that_say_all(tmp_path: Path, kind: str) -> None:
    name, writer, _ = made.FILES[kind]
    writer(tmp_path / name)
    result = _new(tmp_path / "new rig", tmp_path / name, "--plot")
    assert result.exit_code == 0, result.output
    assert "ready for: bayesimpact check" in result.output
    assert (tmp_path / "new rig" / "channels.png").stat().st_size > 1000
    campaign = load_campaign(tmp_path / "new rig")  # on its own: the file was copied there
    assert (campaign.name, campaign.mass, campaign.stop) == ("new rig", 1.0, False)
    np.testing.assert_allclose(campaign.recordings[0].samples, decay(), rtol=1e-9, atol=1e-13)
    assert campaign.recordings[0].interval == pytest.approx(2e-3, rel=1e-6)


def test_what_is_said_is_not_assumed(tmp_path: Path) -> None:
    made.tdms(tmp_path / "a.tdms")
    (tmp_path / "a.csv").write_text(csv())
    files = (tmp_path / "a.tdms", tmp_path / "a.csv")
    result = _new(tmp_path, *files, "--mass", 0.5, "--stop", "--case", "soft")
    assert result.exit_code == 0, result.output
    text = (tmp_path / "campaign.toml").read_text()
    assert "ASSUMED: " not in text.partition("\n")[2]
    campaign = load_campaign(tmp_path)
    assert (campaign.mass, campaign.cases) == (0.5, ("soft",))
    assert [r.name for r in campaign.recordings] == ["a", "a-2"]


def test_what_is_missing_is_said(tmp_path: Path) -> None:
    made.bare_lvm(tmp_path / "a.lvm")
    made.npy(tmp_path / "b.npy")
    result = _new(tmp_path, tmp_path / "a.lvm", tmp_path / "b.npy", "--no-stop")
    assert result.exit_code == 0, result.output
    text = (tmp_path / "campaign.toml").read_text()
    assert "time_column = 1  # ASSUMED: it rises evenly, in s" in text
    assert "column = 2" in text
    assert text.count('# unit = "mm"  # NEEDED') == 2
    assert "# sample_rate_hz = 1000.0  # NEEDED" in text
    assert "not yet complete" in result.output and "no unit for it" in result.output
    filled = text.replace('# unit = "mm"', 'unit = "mm"').replace("# sample_rate_hz = 1000.0",
                                                               "sample_rate_hz = 500")  # fmt: skip
    (tmp_path / "campaign.toml").write_text(filled)
    for recording in load_campaign(tmp_path).recordings:
        np.testing.assert_allclose(recording.samples, decay(), rtol=1e-9)


def test_what_is_assumed_of_several_files_is_said_once_and_of_which(tmp_path: Path) -> None:
    made.bare_lvm(tmp_path / "a.lvm")
    for name in "bcde":
        made.npy(tmp_path / f"{name}.npy")
    files = [tmp_path / "a.lvm", *(tmp_path / f"{name}.npy" for name in "bcde")]
    told = _new(tmp_path, *files, "--stop").output.partition("written: ")[2].splitlines()
    assert [line for line in told if "ASSUMED: recordings of one" in line] == [
        '  every file: case = "1"  # ASSUMED: recordings of one obstacle share a case'
    ]
    assert "  a.lvm: time_column = 1  # ASSUMED: it rises evenly, in s" in told
    (rate,) = (line for line in told if "sample_rate_hz" in line)
    assert rate.startswith("  4 of 5 files: sample_rate_hz = 1000.0  # NEEDED")
    assert sum("mass_kg" in line for line in told) == 1


def test_units_and_rates_can_be_said(tmp_path: Path) -> None:
    made.npy(tmp_path / "b.npy")
    result = _new(tmp_path, tmp_path / "b.npy", "--no-stop", "--unit", "mm", "--rate", 500)
    assert result.exit_code == 0 and "ready for" in result.output
    np.testing.assert_allclose(load_campaign(tmp_path).recordings[0].samples, decay(), rtol=1e-9)
    wrong = _new(tmp_path / "other", tmp_path / "b.npy", "--unit", "inch")
    assert wrong.exit_code == 2 and "--unit" in wrong.stderr and "mm" in wrong.stderr


def test_files_of_one_name_are_copied_apart(tmp_path: Path) -> None:
    for folder in ("one", "two", "home"):
        (tmp_path / folder).mkdir()
        made.tdms(tmp_path / folder / "a.tdms")
    files = [tmp_path / folder / "a.tdms" for folder in ("one", "home", "two")]
    result = _new(tmp_path / "home", *files)
    assert result.exit_code == 0, result.output
    assert sorted(p.name for p in (tmp_path / "home").iterdir()) == [
        "a-2.tdms", "a-3.tdms", "a.tdms", "campaign.toml"
    ]  # fmt: skip
    assert len(load_campaign(tmp_path / "home").recordings) == 3


def test_a_file_that_is_there_is_never_replaced(tmp_path: Path) -> None:
    made.tdms(tmp_path / "a.tdms")
    (tmp_path / "home").mkdir()
    (tmp_path / "home" / "a.tdms").write_text("mine")
    result = _new(tmp_path / "home", tmp_path / "a.tdms")
    assert result.exit_code == 2 and "something else of the name" in result.stderr
    assert (tmp_path / "home" / "a.tdms").read_text() == "mine"
    assert not (tmp_path / "home" / "campaign.toml").exists()
    (tmp_path / "home" / "a.tdms").write_bytes((tmp_path / "a.tdms").read_bytes())
    assert _new(tmp_path / "home", tmp_path / "a.tdms").exit_code == 0  # the same already


def test_a_campaign_is_never_replaced(tmp_path: Path) -> None:
    made.tdms(tmp_path / "a.tdms")
    (tmp_path / "campaign.toml").write_text("mine")
    result = _new(tmp_path, tmp_path / "a.tdms")
    assert result.exit_code == 2
    assert "a campaign already" in result.stderr
    assert (tmp_path / "campaign.toml").read_text() == "mine"


@pytest.mark.parametrize("name", ["nothing.mat", "cut.mat"])
def test_nothing_is_written_for_a_bad_file(tmp_path: Path, name: str) -> None:
    (tmp_path / "cut.mat").write_bytes(b"MATLAB 5.0")
    made.tdms(tmp_path / "a.tdms")
    result = _new(tmp_path / "new", tmp_path / "a.tdms", tmp_path / name)
    assert result.exit_code == 2
    assert name in result.stderr and "Traceback" not in result.stderr
    assert not (tmp_path / "new").exists()


def test_acceleration_is_read_and_said(tmp_path: Path) -> None:
    rows = [f"{t:.6g},{x:.9g}" for t, x in zip(made.TIMES, made.MM, strict=True)]
    (tmp_path / "a.csv").write_text("Time [s],Accel [g]\n" + "\n".join(rows))
    result = _new(tmp_path, tmp_path / "a.csv")
    assert result.exit_code == 0
    assert "Accel [g], 600 samples" in result.output
    assert "NEEDED" not in result.output
    (recording,) = load_campaign(tmp_path).recordings
    assert recording.quantity == "acceleration"
    np.testing.assert_allclose(recording.samples, made.MM * 9.80665, rtol=1e-7)


@pytest.mark.parametrize(
    ("header", "kind", "scale"),
    [
        ("Time [s],Pos [mm],Force [kN]", "force_N", 1e3),
        ("time_s,displacement_mm,force_N", "force_N", 1.0),
        ("time_s,displacement_mm,base_m_s2", "base_m_s2", 1.0),
        ("time_s,displacement_mm,temperature", None, 1.0),
        ("Time [s],Pos [mm],Table [m/s2]", None, 1.0),  # may be the base's, or anything's
        (SILENT, None, 1.0),
    ],
)
def test_a_measured_input_is_read_and_said(tmp_path: Path, header, kind, scale) -> None:
    drive = 0.01 * np.sin(40.0 * np.array(made.TIMES)) * (header != SILENT)
    rows = [f"{t:.6g},{x:.9g},{f:.9g}" for t, x, f in zip(made.TIMES, made.MM, drive, strict=True)]
    (tmp_path / "a.csv").write_text(header + "\n" + "\n".join(rows))
    result = _new(tmp_path, tmp_path / "a.csv")
    assert result.exit_code == 0
    assert ("it drove the motion" in result.output) == (kind is not None)
    (recording,) = load_campaign(tmp_path).recordings
    np.testing.assert_allclose(recording.samples, made.MM * 1e-3, rtol=1e-6)
    if kind is None:
        assert recording.input is None
    else:
        assert recording.input is not None and recording.input.kind == kind
        np.testing.assert_allclose(recording.input.samples, scale * drive, rtol=1e-6, atol=1e-12)
