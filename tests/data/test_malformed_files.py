"""Damaged and unusable instrument files: one clear message each, and nothing else."""

from __future__ import annotations

import io
import pickle
import struct
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import h5py
import instrument_files as made
import numpy as np
import openpyxl
import pandas as pd
import pytest
import xarray as xr
from campaigns import decay, write
from click.testing import CliRunner
from scipy.io import savemat, wavfile

from bayesimpact.cli import main
from bayesimpact.data.read import load_campaign
from bayesimpact.data.readers import channel
from bayesimpact.errors import InputError

ONE = 'name = "rig"\nmass_kg = 0.5\nstop = false\n[[recording]]\nfile = "{}"\n'
Change = Callable[[Path], object]


def _cut(kind: str, keep: float = 0.6) -> Change:
    """The file of a kind without its end."""

    def write_part(path: Path) -> None:
        made.FILES[kind][1](path)
        data = path.read_bytes()
        path.write_bytes(data[: int(keep * len(data))])

    return write_part


def _bytes(data: bytes) -> Change:
    return lambda path: path.write_bytes(data)


def _csv(*lines: str, end: str = "") -> Change:
    return lambda path: (made.text(*lines)(path), path.write_text(path.read_text() + end))


def _mat(**variables: object) -> Change:
    return lambda path: savemat(path, variables)


def _h5(**sets: object) -> Change:
    def write_sets(path: Path) -> None:
        with h5py.File(path, "w") as file:
            for name, values in sets.items():
                file[name] = values

    return write_sets


def _objects(path: Path) -> None:
    np.save(path, np.array([{"a": 1}, None], dtype=object), allow_pickle=True)


def _objects_zip(path: Path) -> None:
    np.savez(path, x=np.array([{"a": 1}], dtype=object))


def _sheet(rows: list[list[object]]) -> Change:
    def write_book(path: Path) -> None:
        book = openpyxl.Workbook()
        for row in rows:
            book.active.append(row)
        book.save(path)

    return write_book


def _holed_sheet(path: Path) -> None:
    pairs = [[float(t), float(x)] for t, x in zip(made.TIMES, made.MM, strict=True)]
    _sheet([["Time [s]", "x [mm]"], *pairs[:99], [], *pairs[99:]])(path)


def _worded(path: Path) -> None:
    made.text("Time [s],x [mm]")(path)
    path.write_text(path.read_text().replace("\n0.1,", "\nx,"))


def _holed(path: Path) -> None:
    values = made.MM.copy()
    values[40] = np.nan
    with h5py.File(path, "w") as file:
        file["x_mm"] = values
        file["x_mm"].attrs["fs"] = 500.0


def _uneven(path: Path) -> None:
    times = made.TIMES.copy()
    times[300:] += 0.1
    savemat(path, {"t": times, "x_mm": made.MM})


UNREADABLE = "content that cannot be read"
RATE = "sample_rate_hz = 500\n"
BAD: dict[str, tuple[str, Change, str, tuple[str, ...]]] = {
    "MATLAB cut": ("a.mat", _cut("MATLAB 5"), "", (UNREADABLE, "MATLAB ")),
    "MATLAB text": ("a.mat", _bytes(b"hello\n" * 90), "", (UNREADABLE, "MATLAB ")),
    "MATLAB of text only": ("a.mat", _mat(note="x"), "", ("without a channel",)),
    "MATLAB two responses": ("a.mat", _mat(x_mm=made.MM, z_mm=made.MM), RATE, ("several", "z_mm")),
    "MATLAB no unit": ("a.mat", _mat(x=made.MM, fs=500.0), 'column = "x"\n', ("no unit", "mm")),
    "MATLAB no clock": ("a.mat", _mat(x_mm=made.MM), "", ("no clock", "sample_rate_hz")),
    "MATLAB uneven": ("a.mat", _uneven, "", ("sample 301", "a gap")),
    "MATLAB complex": ("a.mat", _mat(x_mm=made.MM + 1j), RATE, ("without a channel",)),
    "MATLAB 7.3 cut": ("a.mat", _cut("MATLAB 7.3"), "", (UNREADABLE, "MATLAB ")),
    "HDF5 cut": ("a.h5", _cut("HDF5"), "", (UNREADABLE, "an HDF5 file, whole")),
    "HDF5 text": ("a.h5", _bytes(b"no such thing"), "", (UNREADABLE, "HDF5 ")),
    "HDF5 empty group": ("a.h5", _h5(), "", ("without a channel",)),
    "HDF5 NaN": ("a.h5", _holed, "", ("sample 41", "channel x_mm", "no finite number")),
    "HDF5 other block": ("a.h5", made.hdf5, 'block = "run 2"\n', ("key block", '"run 2"', "run 1")),
    "HDF5 force": (
        "a.h5",
        lambda p: xr.Dataset({"v": ("time", made.MM, {"units": "N"})}).to_netcdf(
            p, engine="h5netcdf"
        ),
        f'column = "v"\n{RATE}',
        ("channel v", "the unit N", "unit = ... in campaign.toml (m, cm, mm, um"),
    ),
    "UFF text": ("a.uff", _bytes(b"    -1\n    58\nnothing\n"), "", ("a UFF file",)),
    "UFF cut": ("a.uff", _cut("UFF58", 0.3), "", ("a UFF file",)),
    "TDMS cut": ("a.tdms", _cut("TDMS", 0.02), "", ("a TDMS file",)),
    "TDMS without its end": ("a.tdms", _cut("TDMS", 0.9), "", (UNREADABLE, "less data", "a TDMS")),
    "TDMS text": ("a.tdms", _bytes(b"TDSmnothing"), "", ("a TDMS file",)),
    "LVM cut": ("a.lvm", _cut("LVM", 0.005), "", ("an LVM file",)),
    "LVM no numbers": ("a.lvm", _bytes(b"a\tb\nc\td\n"), "", ("no columns of numbers",)),
    "WAV text": ("a.wav", _bytes(b"RIFF____WAVE"), "", (UNREADABLE, "WAV ")),
    "WAV no unit": ("a.wav", made.wav, "channel = 1\n", ("channel track_1", "no unit")),
    "WAV silence": (
        "a.wav",
        lambda p: wavfile.write(p, 500, np.zeros(600)),
        'unit = "mm"\n',
        ("all equal 0",),
    ),
    "Excel text": ("a.xlsx", _bytes(b"PK\3\4nothing"), "", (UNREADABLE, "an Excel")),
    "Excel cut": ("a.xlsx", _cut("Excel"), "", (UNREADABLE, "Excel ")),
    "Excel words": ("a.xlsx", _sheet([["a", "b"], ["c", "d"], ["e", "f"]]), "", ("numbers",)),
    "Excel hole": (
        "a.xlsx",
        _holed_sheet,
        "",
        ("sheet Sheet, line 101", "an empty line"),
    ),
    "old Excel": ("a.xls", _bytes(b"\xd0\xcf\x11\xe0"), "", ("a file .xls", ".xlsx")),
    "NetCDF cut": ("a.nc", _cut("NetCDF 3", 0.02), "", (UNREADABLE, "NetCDF ")),
    "NetCDF 4 cut": ("a.nc", _cut("NetCDF 4"), "", (UNREADABLE, "NetCDF ")),
    "Zarr empty": ("a.zarr", Path.mkdir, "", ("a.zarr", "found")),
    "Zarr file": ("a.zarr", _bytes(b"x"), "", (UNREADABLE, "Zarr ")),
    "Parquet cut": ("a.parquet", _cut("Parquet"), "", (UNREADABLE, "Parquet ")),
    "Parquet of words": (
        "a.parquet",
        lambda p: pd.DataFrame({"a": ["x", "y"]}).to_parquet(p),
        "",
        ("without a channel",),
    ),
    "pickle": ("a.pkl", _bytes(pickle.dumps([1])), "", ("a file .pkl", "programs")),
    "NumPy objects": ("a.npy", _objects, "", (UNREADABLE, "NumPy ")),
    "NumPy objects, zipped": ("a.npz", _objects_zip, "", (UNREADABLE, "NumPy ")),
    "NumPy cut": ("a.npy", _cut("npy"), "", (UNREADABLE, "NumPy ")),
    "empty": ("a.tdms", _bytes(b""), "", ("an empty file",)),
    "no such column": (
        "a.csv",
        _csv("Time [s],x [mm]"),
        'column = "y"\n',
        ('column = "y"', "there 0 times", "Time [s], x [mm]"),
    ),
    "no such number": ("a.csv", _csv(), "column = 3\n", ("column = 3", "0 times")),
    "unit contradicts": ("a.csv", _csv("Time [s],x [mm]"), 'unit = "m"\n', ('"m"', '"mm"')),
    "rates disagree": (
        "a.csv",
        _csv("Time [s],x [mm]"),
        "sample_rate_hz = 1000\n",
        ("1000", "500 Hz", "both agreeing"),
    ),
    "text inside": (
        "a.csv",
        _worded,
        "",
        ("line 52", '"x, ', "between rows of numbers", "skip_rows"),
    ),
    "text below": ("a.csv", _csv("Time [s],x [mm]", end="end of file\n"), "", ("line 602",)),
    "more fields": ("a.csv", _csv("Time [s],x [mm]", end="1.2,3,4\n"), "", ("602", "3 fields")),
    "all skipped": ("a.csv", _csv(), "skip_rows = 1000\n", ("key skip_rows", "1000 of 601 lines")),
    "unknown encoding": ("a.csv", _csv(), 'encoding = "klingon"\n', ("encoding", '"klingon"')),
    "no text encoding": ("a.csv", _csv(), 'encoding = "zlib"\n', ("encoding", '"zlib"')),
    "wrong encoding": (
        "a.csv",
        lambda p: p.write_bytes("Höhe".encode("latin-1")),
        'encoding = "utf-8"\n',
        ("not utf-8",),
    ),
    "encoding of a binary": ("a.h5", made.hdf5, 'encoding = "utf-8"\n', ("key encoding", "text")),
    "time of volts": (
        "a.csv",
        _csv("Voltage [V],x [mm]"),
        "time_column = 1\n",
        ("key time_column", "the unit V", "s, ms"),
    ),
    "time as response": (
        "a.csv",
        _csv("Time [s],x [mm]"),
        'time_column = "x"\n',
        ("key time_column", "the response itself"),
    ),
    "both names": (
        "a.csv",
        _csv("Time [s],x [mm]"),
        'column = "x"\nchannel = "x"\n',
        ("key channel", "mean the same"),
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", BAD)
def test_refused_with_one_message(
    tmp_path: Path, kind: str, capfd: pytest.CaptureFixture[str]
) -> None:
    name, change, keys, words = BAD[kind]
    change(tmp_path / name)
    write(tmp_path, ONE.format(name) + keys, a=None, b=None)
    before = sorted(tmp_path.rglob("*"))
    result = CliRunner().invoke(main, ["check", str(tmp_path)])
    assert result.exit_code == 2, result.output
    message = (result.stderr + capfd.readouterr().err).strip()
    assert len(message.splitlines()) == 1 and message.startswith("bayesimpact: ")
    assert [word for word in (name, "found", "accepted", *words) if word not in message] == []
    assert sorted(tmp_path.rglob("*")) == before


def _zip_bomb(path: Path) -> None:
    made.excel(path) if path.suffix == ".xlsx" else made.npz(path)
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("filling.npy", bytes(4_000_000))


def _mat_bomb(path: Path) -> None:
    """A compressed variable that is far larger than the file."""
    packed = zlib.compress(struct.pack("<II", 14, 4_000_000) + bytes(4_000_000))
    head = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    path.write_bytes(head + struct.pack("<II", 15, len(packed)) + packed)


def _wide_set(path: Path) -> None:
    with h5py.File(path, "w") as file:  # chunks that were never written take no room
        file.create_dataset("x", shape=(10**6,), chunks=(1000,), dtype="f8")


def _promise(path: Path) -> None:
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        stream, {"descr": "<f8", "fortran_order": False, "shape": (10**6,)}
    )
    path.write_bytes(stream.getvalue())


@pytest.mark.parametrize(
    ("name", "bomb", "words"),
    [
        ("a.xlsx", _zip_bomb, "bytes of content"),
        ("a.npz", _zip_bomb, "bytes of content"),
        ("a.mat", _mat_bomb, "bytes of content"),
        ("a.h5", _wide_set, "1,000,000 numbers"),
        ("a.nc", _wide_set, "1,000,000 numbers"),
        ("a.npy", _promise, "1,000,000 numbers"),
    ],
)
def test_sizes_are_bounded_before_reading(
    tmp_path: Path, name: str, bomb: Change, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(channel, "MAX_BYTES", 2_000_000)
    monkeypatch.setattr(channel, "MAX_VALUES", 500_000)
    bomb(tmp_path / name)
    write(tmp_path, ONE.format(name), a=None, b=None)
    with pytest.raises(InputError, match=f"{name}: found .*{words}; accepted: at most"):
        load_campaign(tmp_path)


def test_no_program_in_a_file_runs(tmp_path: Path) -> None:
    class Program:
        def __reduce__(self) -> tuple:
            return (Path.touch, (tmp_path / "ran",))

    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        stream = io.BytesIO()
        np.save(stream, np.array([Program()], dtype=object), allow_pickle=True)
        archive.writestr("x.npy", stream.getvalue())
    made.lvm(tmp_path / "b.lvm")
    (tmp_path / "b.lvm.pkl").write_bytes(pickle.dumps(Program()))
    write(tmp_path, ONE.format("a.npz"), a=None, b=None)
    with pytest.raises(InputError):
        load_campaign(tmp_path)
    write(tmp_path, ONE.format("b.lvm"), a=None, b=None)
    np.testing.assert_allclose(load_campaign(tmp_path).recordings[0].samples, decay(), rtol=1e-9)
    assert not (tmp_path / "ran").exists()
