"""A small file of every format is read as the contract's own CSV is."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import instrument_files as made
import numpy as np
import pytest
from campaigns import decay, write

from bayesimpact.data.read import load_campaign
from bayesimpact.data.readers.formats import read_channels
from bayesimpact.errors import InputError

ONE = 'name = "rig"\nmass_kg = 0.5\nstop = false\n[[recording]]\nfile = "{}"\n'


def _folder(tmp_path: Path, name: str, keys: str = "") -> Path:
    return write(tmp_path, ONE.format(name) + keys, a=None, b=None)


@pytest.mark.parametrize("kind", made.FILES)
def test_every_format(tmp_path: Path, kind: str) -> None:
    name, writer, keys = made.FILES[kind]
    writer(tmp_path / name)
    campaign = load_campaign(_folder(tmp_path, name, keys))
    (recording,) = campaign.recordings
    assert (recording.name, recording.quantity) == ("a", "displacement")
    assert recording.interval == pytest.approx(2e-3, rel=1e-6)
    assert recording.start == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(recording.samples, decay(), rtol=2e-11, atol=1e-13)
    assert len(campaign.sha256) == 64


def test_one_folder_of_all_formats(tmp_path: Path) -> None:
    head, _, entry = ONE.partition("[[recording]]")
    toml = head
    for number, (name, writer, keys) in enumerate(made.FILES.values()):
        file = Path(name).with_stem(f"r{number}").name
        writer(tmp_path / file)
        toml += "[[recording]]" + entry.format(file) + keys
    campaign = load_campaign(write(tmp_path, toml, a=None, b=None))
    assert [r.name for r in campaign.recordings] == [f"r{i}" for i in range(len(made.FILES))]
    for recording in campaign.recordings:
        np.testing.assert_allclose(recording.samples, decay(), rtol=2e-11, atol=1e-13)


def test_windows_of_one_file(tmp_path: Path) -> None:
    made.tdms(tmp_path / "log.tdms")
    one, other = "start_s = 0\nend_s = 0.5\n", "start_s = 0.55\n"
    again = '[[recording]]\nfile = "log.tdms"\n'
    first, second = load_campaign(_folder(tmp_path, "log.tdms", one + again + other)).recordings
    assert (first.name, second.name) == ("log-0s", "log-0.55s")
    np.testing.assert_allclose(first.samples, decay()[:251], rtol=1e-11)
    np.testing.assert_allclose(second.samples, decay()[275:], rtol=1e-11)
    assert second.start == pytest.approx(0.55)


def test_channels_of_one_file(tmp_path: Path) -> None:
    both = np.column_stack([made.TIMES, made.MM, 2 * made.MM])
    rows = [",".join(map(repr, row)) for row in both.tolist()]
    (tmp_path / "log.csv").write_text("\n".join(["Time [s],near [mm],far [mm]", *rows]))
    keys = 'column = "near"\n[[recording]]\nfile = "log.csv"\ncolumn = "far"\n'
    first, second = load_campaign(_folder(tmp_path, "log.csv", keys)).recordings
    assert (first.name, second.name) == ("log-near", "log-far")
    np.testing.assert_allclose(second.samples, 2 * first.samples, rtol=1e-12)


def test_names_of_ones_own(tmp_path: Path) -> None:
    made.tdms(tmp_path / "log.tdms")
    keys = 'name = "release 1"\n'
    assert load_campaign(_folder(tmp_path, "log.tdms", keys)).recordings[0].name == "release 1"


def test_pattern(tmp_path: Path) -> None:
    for i in (10, 2, 1):
        made.npz(tmp_path / f"run{i}.npz")
    campaign = load_campaign(_folder(tmp_path, "run*.npz"))
    assert [r.name for r in campaign.recordings] == ["run1", "run2", "run10"]
    with pytest.raises(InputError, match="no file of this pattern"):
        load_campaign(_folder(tmp_path, "ran*.npz"))


@pytest.mark.parametrize(
    ("head", "asked"),
    [
        ("Time ( s ),Voltage ( V )", "Voltage ( V )"),
        ("Time ( s ),Voltage ( V )", "Voltage (V)"),
        ("Time ( s ),Voltage ( V )", "Voltage[V]"),
        ("Time [s],Weg am Ende [\N{MICRO SIGN}V]", "Weg  am Ende [\N{MICRO SIGN}V]"),
        ("Time [s],x/V", "x/V"),
        ("Time [s],laser tip", "laser  tip"),
        ("time_s,laser tip (raw)", "laser tip(raw)"),
    ],
)
def test_a_column_is_called_as_in_its_file_whatever_blanks(
    tmp_path: Path, head: str, asked: str
) -> None:
    made.text(head)(tmp_path / "a.csv")
    keys = f'column = "{asked}"\nunit = "mm"\n'
    (recording,) = load_campaign(_folder(tmp_path, "a.csv", keys)).recordings
    np.testing.assert_allclose(recording.samples, decay(), rtol=1e-11)


def test_blanks_choose_between_columns_that_differ_by_them(tmp_path: Path) -> None:
    rows = [f"{t:.6g},0,{x:.12g}" for t, x in zip(made.TIMES, made.MM, strict=True)]
    for time in ("time_s", "Time [s]"):
        (tmp_path / "a.csv").write_text("\n".join([f"{time},ab,a b", *rows]) + "\n")
        keys = 'column = "{}"\nunit = "mm"\n'
        (recording,) = load_campaign(_folder(tmp_path, "a.csv", keys.format("a b"))).recordings
        np.testing.assert_allclose(recording.samples, decay(), rtol=1e-11)
        with pytest.raises(InputError, match="there 2 times"):
            load_campaign(_folder(tmp_path, "a.csv", keys.format("a  b")))
    other = keys.format("x [N]")  # a unit that is not the column's
    made.text("Time [s],x [V]")(tmp_path / "a.csv")
    with pytest.raises(InputError, match="there 0 times"):
        load_campaign(_folder(tmp_path, "a.csv", other))


def test_empty_cells_outside_the_window(tmp_path: Path) -> None:
    rows = [f"{t:.6g},{x:.12g}" for t, x in zip(made.TIMES, made.MM, strict=True)]
    rows[500:] = [row.split(",")[0] + "," for row in rows[500:]]
    (tmp_path / "a.csv").write_text("Time [s],x [mm]\n" + "\n".join(rows) + "\n")
    (recording,) = load_campaign(_folder(tmp_path, "a.csv", "end_s = 0.9\n")).recordings
    np.testing.assert_allclose(recording.samples, decay()[:451], rtol=1e-11)
    with pytest.raises(InputError, match=r"line 502, channel x.*no finite number"):
        load_campaign(_folder(tmp_path, "a.csv"))


def test_units_and_sensor_of_channels(tmp_path: Path) -> None:
    made.uff(tmp_path / "a.uff")
    (channel,) = read_channels(tmp_path / "a.uff", (tmp_path / "a.uff").read_bytes())
    assert (channel.name, channel.unit) == ("displacement_4:3", "mm")
    assert (channel.sensor, channel.block) == ("laser at the tip", "1")


@pytest.mark.parametrize(
    ("kind", "library"),
    [("TDMS", "nptdms"), ("UFF58", "pyuff"), ("LVM", "lvm_read"), ("Excel", "openpyxl"),
     ("Parquet", "pandas"), ("Parquet", "pyarrow.parquet"), ("Zarr", "zarr")],
)  # fmt: skip
def test_missing_library(
    tmp_path: Path, kind: str, library: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    name, writer, keys = made.FILES[kind]
    writer(tmp_path / name)
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(InputError, match=r"pip install 'bayesimpact\[formats\]'") as refusal:
        load_campaign(_folder(tmp_path, name, keys))
    assert name in str(refusal.value)


def test_lvm_leaves_nothing_behind(tmp_path: Path) -> None:
    made.lvm(tmp_path / "a.lvm")
    load_campaign(_folder(tmp_path, "a.lvm"))
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.lvm", "campaign.toml"]


def _real_recordings() -> Path:
    beside = Path(__file__).resolve().parents[2].parent / "shared" / "recordings"
    return Path(os.environ.get("BAYESIMPACT_RECORDINGS", beside))


@pytest.mark.skipif(not _real_recordings().is_dir(), reason="the real recordings are not here")
def test_real_instrument_files(tmp_path: Path) -> None:
    board = _real_recordings() / "pcb_ringdown" / "board_4_3_impact_05.lvm"
    time, first, second, _ = read_channels(board, board.read_bytes())
    assert np.median(np.diff(time.samples)) == pytest.approx(5e-6, rel=1e-6)
    assert (first.samples[0], second.samples[0]) == (146.646210, 86.173867)
    box = _real_recordings() / "silverbox" / "SNLS80mV.csv"
    keys = 'column = "V2"\nunit = "m"\nsample_rate_hz = 610.3515625\n'
    (recording,) = load_campaign(_folder(tmp_path, box.as_posix(), keys), [box.parent]).recordings
    assert recording.samples.size == 131_072
    assert recording.samples[1] == 0.012971
