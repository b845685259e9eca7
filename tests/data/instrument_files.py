"""Small files of every format, made by the libraries that read them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import openpyxl
import pandas as pd
import pyuff
import xarray as xr
from campaigns import decay
from nptdms import ChannelObject, TdmsWriter
from scipy.io import savemat, wavfile

INTERVAL = 2e-3
TIMES = np.arange(600) * INTERVAL
MM = decay() * 1e3
VOLT = np.cos(TIMES)
UNIT = 'unit = "mm"\n'


def mat_v5(path: Path) -> None:
    savemat(path, {"t": TIMES, "probe": MM, "u": VOLT[:100]}, do_compression=True)


def mat_structure(path: Path) -> None:
    run = {"x_mm": MM[:, None], "fs": 500.0, "force": VOLT}
    savemat(path, {"rig": {"run1": run, "note": "text"}})


def mat_v73(path: Path) -> None:
    with h5py.File(path, "w", userblock_size=512) as file:
        file["probe"] = MM[None, :]
        file["Fs"] = np.array([[500.0]])
    data = bytearray(path.read_bytes())
    data[:20] = b"MATLAB 7.3 MAT-file "
    path.write_bytes(bytes(data))


def hdf5(path: Path) -> None:
    with h5py.File(path, "w") as file:
        data = file.create_dataset("run 1/laser", data=MM, compression="gzip")
        data.attrs.update(units="mm", dt=INTERVAL)
        file["run 1/force"] = VOLT
        file["run 1"]["elsewhere"] = h5py.ExternalLink("other.h5", "/x")


def uff(path: Path) -> None:
    said = pyuff.prepare_58(
        func_type=1, rsp_node=4, rsp_dir=3, ref_node=1, ref_dir=0, data=MM, x=TIMES,
        abscissa_spacing=1, abscissa_inc=INTERVAL, abscissa_min=0.0, num_pts=MM.size,
        abscissa_spec_data_type=17, abscissa_axis_units_lab="s", ordinate_spec_data_type=8,
        ordinate_axis_units_lab="mm", id1="laser at the tip", ord_data_type=4, binary=0,
        orddenom_spec_data_type=0, z_axis_spec_data_type=0,
    )  # fmt: skip
    pyuff.UFF(str(path)).write_sets(said, "add")


def tdms(path: Path) -> None:
    said = {"wf_increment": INTERVAL, "wf_start_offset": 0.0, "unit_string": "mm"}
    with TdmsWriter(str(path)) as writer:
        writer.write_segment(
            [ChannelObject("log", "laser", MM, said), ChannelObject("log", "force", VOLT)]
        )


def lvm(path: Path) -> None:
    head = [
        "LabVIEW Measurement\t", "Writer_Version\t2", "Reader_Version\t2", "Separator\tTab",
        "Decimal_Separator\t.", "Multi_Headings\tNo", "X_Columns\tNo", "Time_Pref\tRelative",
        "***End_of_Header***\t", "", "Channels\t2\t\t", "Samples\t600\t600\t",
        "Y_Unit_Label\tmm\tN\t", "X0\t0.0\t0.0\t", f"Delta_X\t{INTERVAL}\t{INTERVAL}\t",
        "***End_of_Header***\t\t\t", "X_Value\tlaser\tforce\tComment",
    ]  # fmt: skip
    rows = [f"\t{a:.12g}\t{b:.12g}" for a, b in zip(MM, VOLT, strict=True)]
    path.write_text("\n".join(head + rows) + "\n")


def bare_lvm(path: Path) -> None:
    rows = [f"{t:.6E}\t{a:.12g}\t" for t, a in zip(TIMES, MM, strict=True)]
    rows[0] += "0.28"
    path.write_text("\n".join(rows) + "\n")


def wav(path: Path) -> None:
    wavfile.write(path, 500, np.column_stack([MM, VOLT]))


def excel(path: Path) -> None:
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.title = "run 1"
    sheet.append(["Instrument", "probe 7"])
    sheet.append([])
    sheet.append(["Time", "Weg", "Kraft"])
    sheet.append(["s", "mm", "N"])
    for row in zip(TIMES, MM, VOLT, strict=True):
        sheet.append([float(value) for value in row])
    book.create_sheet("notes").append(["nothing here"])
    book.save(path)


def _dataset() -> xr.Dataset:
    variables = {"laser": ("time", MM, {"units": "mm"}), "force": ("time", VOLT, {"units": "N"})}
    return xr.Dataset(variables, coords={"time": ("time", TIMES * 1e3, {"units": "ms"})})


def netcdf3(path: Path) -> None:
    _dataset().to_netcdf(path, engine="scipy", format="NETCDF3_64BIT")


def netcdf4(path: Path) -> None:
    _dataset().to_netcdf(path, engine="h5netcdf")


def zarr(path: Path) -> None:
    _dataset().to_zarr(path, consolidated=False)


def parquet(path: Path) -> None:
    pd.DataFrame({"Time [s]": TIMES, "Weg [mm]": MM, "note": "x"}).to_parquet(path)


def npz(path: Path) -> None:
    np.savez_compressed(path, x_mm=MM, fs=500.0)


def npy(path: Path) -> None:
    np.save(path, MM)


def _rows(separator: str, comma: bool = False) -> list[str]:
    rows = [f"{t:.9g}{separator}{a:.12g}" for t, a in zip(TIMES, MM, strict=True)]
    return [row.replace(".", ",") for row in rows] if comma else rows


def text(*head: str, separator: str = ",", comma: bool = False, tail: str = "") -> Callable:
    """A writer of a text with these lines at its head."""

    def write(path: Path, encoding: str = "utf-8") -> None:
        rows = [row + tail for row in _rows(separator, comma)]
        path.write_bytes(("\n".join([*head, *rows]) + "\n").encode(encoding))

    return write


def _encoded(write: Callable, encoding: str) -> Callable[[Path], None]:
    return lambda path: write(path, encoding)


LMS = text("LMS Test.Lab export", "", "Point;tip:+Z", "Date;12.5.2024", "Time [s];Disp [mm]",
           separator=";", comma=True)  # fmt: skip
FILES: dict[str, tuple[str, Callable[[Path], Any], str]] = {
    "MATLAB 5": ("a.mat", mat_v5, 'column = "probe"\nunit = "mm"\n'),
    "MATLAB structure": ("a.mat", mat_structure, ""),
    "MATLAB 7.3": ("a.mat", mat_v73, UNIT),
    "HDF5": ("a.h5", hdf5, ""),
    "HDF5 block": ("a.h5", hdf5, 'channel = "laser"\nblock = "run 1"\n'),
    "UFF58": ("a.uff", uff, ""),
    "TDMS": ("a.tdms", tdms, ""),
    "LVM": ("a.lvm", lvm, ""),
    "LVM, bare columns": ("a.lvm", bare_lvm, f"time_column = 1\ncolumn = 2\n{UNIT}"),
    "WAV": ("a.wav", wav, f"channel = 1\n{UNIT}"),
    "Excel": ("a.xlsx", excel, ""),
    "NetCDF 3": ("a.nc", netcdf3, ""),
    "NetCDF 4": ("a.nc", netcdf4, ""),
    "Zarr": ("a.zarr", zarr, ""),
    "Parquet": ("a.parquet", parquet, ""),
    "npz": ("a.npz", npz, ""),
    "npy": ("a.npy", npy, f"sample_rate_hz = 500\n{UNIT}"),
    "units in the header": ("a.csv", text("Time [s],Displacement [mm]"), ""),
    "units in parentheses": ("a.txt", text("Time (s)\tx (mm)", separator="\t"), ""),
    "units after a slash": ("a.txt", text("t/s;Weg/mm", separator=";", comma=True), ""),
    "units in a second row": ("a.csv", text("Time,Laser", "s,mm"), ""),
    "NI": (
        "a.csv",
        text("waveform,Untitled", "t0,1.1.2024 12:00", "delta t,0.002", "", "time [s],Y [mm]"),
        "",
    ),
    "Polytec": (
        "a.txt",
        text("Polytec PSV", "Source File Name:\trun.svd", "Usr. Signal: Displacement",
             "Time\tDisplacement", "[ s ]\t[ mm ]", separator="\t"),
        "",
    ),
    "Keyence": (
        "a.csv",
        text("LK-Navigator,Ver 1.0", "Sampling cycle,2000us", "No,", "t,OUT1(mm)"),
        "",
    ),
    "LMS": ("a.csv", LMS, ""),
    "without a header": ("a.csv", text(), f"time_column = 1\ncolumn = 2\n{UNIT}"),
    "skipped lines": (
        "a.csv",
        text("3,4", "5,6", "time,laser"),
        f'skip_rows = 2\ntime_column = "time"\n{UNIT}',
    ),
    "Latin-1": (
        "a.csv",
        _encoded(text("Zeit [s];Höhe [mm]", separator=";"), "latin-1"),
        'encoding = "latin-1"\n',
    ),
    "UTF-16": ("a.csv", _encoded(text("Time [s];x [mm]", separator=";"), "utf-16"),
               'encoding = "utf-16"\n'),
    "decimal commas, blanks": ("a.dat", text("Time[s] x[mm]", separator="  ", comma=True), ""),
    "trailing separators": ("a.csv", text("Time [s],x [mm],", tail=","), ""),
    "commented header": ("a.txt", text("# Time [s], x [mm]"), ""),
}  # fmt: skip
"""What it is -> file name, what writes it, keys of its [[recording]]."""
