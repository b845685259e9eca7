"""NetCDF and Zarr: through xarray; variables along one dimension, with its coordinate as clock."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from bayesimpact.data.readers.channel import (
    TIME_UNITS,
    Channel,
    as_floats,
    check_values,
    interval_among,
    library,
    name_and_unit,
    spelt,
    split,
)

_HOW = {"decode_times": False, "decode_timedelta": False}


def read(path: Path, content: bytes) -> list[Channel]:
    """Variables of a NetCDF file, classic (by SciPy) or version 4 (by h5netcdf)."""
    xarray = library("xarray", "xarray", path)
    engine = "scipy" if content[:3] == b"CDF" else "h5netcdf"
    if engine == "h5netcdf":
        # h5netcdf prints a traceback of its own for what is no HDF5 file
        library("h5py", "h5py", path).File(BytesIO(content), "r").close()
    with xarray.open_dataset(BytesIO(content), engine=engine, **_HOW) as data:
        return _channels(path, data)


def read_zarr(path: Path, content: bytes) -> list[Channel]:
    """Variables of a Zarr store, which is a folder; `content` (its files) is not used."""
    xarray = library("xarray", "xarray", path)
    library("zarr", "zarr", path)
    with xarray.open_dataset(path, engine="zarr", consolidated=None, chunks=None, **_HOW) as data:
        return _channels(path, data)


def _channels(path: Path, data: Any) -> list[Channel]:
    check_values(sum(int(data[name].size) for name in data.variables), path)
    interval = interval_among(data.attrs.items())
    found: list[Channel] = []
    for key in data.data_vars:
        variable = data[key]
        if variable.ndim not in (1, 2) or variable.dtype.kind not in "fiu":
            continue
        name, unit = name_and_unit(str(key))
        made = split(
            name,
            variable.values,
            unit=spelt(str(variable.attrs.get("units", ""))) or unit,
            sensor=str(variable.attrs.get("long_name", "")),
            interval=interval_among(variable.attrs.items()) or interval,
        )
        times = _times(data, variable)
        for channel in made:
            fits = times is not None and times.size == channel.samples.size
            found.append(_with_times(channel, times) if fits else channel)
    return found


def _with_times(channel: Channel, times: Any) -> Channel:
    from dataclasses import replace

    return replace(channel, times=times, interval=None)


def _times(data: Any, variable: Any) -> Any:
    """The coordinate along the longest dimension, s; None where it is no time."""
    dimension = max(variable.dims, key=lambda d: int(variable.sizes[d]))
    if dimension not in data.coords:
        return None
    coordinate = data.coords[dimension]
    values = as_floats(coordinate.values)
    said = str(coordinate.attrs.get("units", ""))
    unit = spelt(said.partition(" since ")[0])
    if values is None or (unit and unit not in TIME_UNITS and unit != "milliseconds"):
        return None
    if not unit and not Channel(str(dimension), values).is_time:
        return None
    return np.asarray(values * {**TIME_UNITS, "milliseconds": 1e-3, "": 1.0}[unit])
