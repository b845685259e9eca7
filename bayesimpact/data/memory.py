"""Campaigns from samples in memory: arrays, DataFrames, xarray; checked as files are."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.clock import check_rate
from bayesimpact.data.even_clock import on_clock
from bayesimpact.data.period import crossing_period
from bayesimpact.data.quantity import RESPONSE_COLUMNS, UNITS, is_angular, order_of, unit_of
from bayesimpact.data.read import build_campaign
from bayesimpact.data.recording import Recording
from bayesimpact.data.schema import RecordingTable, parse_campaign
from bayesimpact.data.table import TIME_COLUMNS, Table
from bayesimpact.data.window import unbroken, window
from bayesimpact.errors import InputError

Floats = NDArray[np.float64]
FASTEST = 100.0
"""Largest peak speed of an oscillator that is believed, m/s.

The stress in a vibrating spring grows with its speed, strain = speed / wave speed (F. V. Hunt,
"Stress and strain limits on the attainable velocity in mechanical vibration", J. Acoust. Soc. Am.
32, 1960): 5 km/s and a strain of 1 % give 50 m/s, beyond which a metal spring yields. Millimetres
taken for metres exceed twice that above 2.5 Hz and 6.5 mm.
"""
_NUMBERS = "finite numbers, (n,), two or more"
_OWN = ("samples", "times_s", "used")
_OF_FILES = frozenset(
    ("file", "column", "channel", "block", "skip_rows", "encoding", "time_column", "time_unit")
)


def campaign_from_arrays(
    recordings: Iterable[Recording | Mapping[str, Any]],
    name: str,
    mass: float,
    tables: Mapping[str, Any],
    door: str = "Campaign.from_arrays",
) -> Campaign:
    """`Campaign.from_arrays`; `door` is what messages call the caller."""
    if isinstance(recordings, Mapping | str) or not isinstance(recordings, Iterable):
        accepted = "a list of recordings, each a Recording or a mapping with name, samples, unit"
        raise InputError(f"{door}, recordings", f"a {type(recordings).__name__}", accepted)
    given = [_entry(f"{door}, recording {i}", r) for i, r in enumerate(recordings, 1)]
    plain = [{k: _plain(v) for k, v in entry.items() if k not in _OWN} for entry in given]
    for entry in plain:
        if isinstance(entry.get("input"), dict):
            entry["input"] = {k: v for k, v in entry["input"].items() if k not in _OWN}
    document = {"name": name, "mass_kg": mass, **tables}
    document = {key: _plain(value) for key, value in document.items()} | {"recording": plain}
    table = parse_campaign(document, door)
    by_name = {entry["name"]: entry for entry in given}

    def read(entry: RecordingTable, where: str) -> tuple[str, Table]:
        samples = _samples(where, entry, by_name[str(entry.name)])
        if entry.input is not None:
            samples = _with_input(where, entry, samples, by_name[str(entry.name)])
        _check_speed(where, samples)
        return where, samples

    return build_campaign(door, table, read)


def campaign_from_dataframe(
    frame: Any,
    name: str,
    mass: float,
    recordings: Sequence[Mapping[str, Any]],
    tables: Mapping[str, Any],
) -> Campaign:
    """`Campaign.from_dataframe`."""
    door = "Campaign.from_dataframe"
    if not hasattr(frame, "columns"):
        raise InputError(door, f"a {type(frame).__name__}", "a pandas DataFrame")
    frame = frame.reset_index() if frame.index.name in TIME_COLUMNS else frame
    columns = [str(column) for column in frame.columns]
    if recordings:
        entries = [_column_entry(door, frame, columns, entry) for entry in recordings]
        return campaign_from_arrays(entries, name, mass, tables, door)
    responses = [column for column in columns if column in RESPONSE_COLUMNS]
    if len(responses) != 1:
        found = f"the columns {', '.join(columns)}"
        accepted = f"one of {', '.join(RESPONSE_COLUMNS)}, or recordings = [...] with column, unit"
        raise InputError(door, found, accepted)
    entries = []
    groups = frame.groupby("recording", sort=False) if "recording" in columns else [("a", frame)]
    for key, rows in groups:
        entry: dict[str, Any] = {"name": str(key), "column": responses[0]}
        if "case" in columns:
            cases = list(dict.fromkeys(rows["case"].tolist()))
            if len(cases) != 1:
                found = f"the cases {', '.join(map(str, cases))}"
                raise InputError(f"{door}, recording {key}", found, "one case per recording")
            entry["case"] = str(cases[0])
        entry["unit"] = RESPONSE_COLUMNS[responses[0]]
        entries.append(_column_entry(door, rows, columns, entry))
    return campaign_from_arrays(entries, name, mass, tables, door)


def campaign_from_xarray(data: Any, name: str, mass: float, tables: Mapping[str, Any]) -> Campaign:
    """`Campaign.from_xarray`."""
    door = "Campaign.from_xarray"
    if hasattr(data, "data_vars"):
        entries = [_array_entry(door, str(key), data[key]) for key in data.data_vars]
    elif not hasattr(data, "coords"):
        raise InputError(door, f"a {type(data).__name__}", "an xarray Dataset or DataArray")
    elif "recording" in data.dims:
        rows = (data.isel(recording=i) for i in range(data.sizes["recording"]))
        entries = [_array_entry(door, str(r.coords["recording"].item()), r, True) for r in rows]
    else:
        entries = [_array_entry(door, str(data.name or "a"), data)]
    return campaign_from_arrays(entries, name, mass, tables, door)


def _entry(where: str, given: object) -> dict[str, Any]:
    """The keys of one recording, with `file` as the schema wants it."""
    if isinstance(given, Recording):
        entry: dict[str, Any] = {"name": given.name, "unit": given.unit, "samples": given.samples}
        if given.case:
            entry["case"] = given.case
        entry["times_s"] = given.start + given.times
        entry["used"] = given.used
        entry["gain"] = "free" if given.free_gain else "known"
        entry["motion"] = given.motion_name or None
        entry["high_pass_hz"] = given.high_pass or None
        if given.input is not None:
            gain = "free" if given.input.free else "known"
            stated = "first_order" if given.input.lines_stated else None
            hold = "band_limited" if given.input.band_limited else stated
            entry["input"] = {
                "samples": given.input.samples, "kind": given.input.kind, "gain": gain,
                "hold": hold, "absolute": given.input.absolute,
            }  # fmt: skip
    elif isinstance(given, Mapping):
        entry = {str(key): value for key, value in given.items()}
    else:
        accepted = "a Recording, or a mapping with name, samples, unit"
        raise InputError(where, f"a {type(given).__name__}", accepted)
    if not isinstance(entry.get("name"), str):
        found = "nothing" if "name" not in entry else repr(entry["name"])
        raise InputError(f"{where}, key name", found, "a name for the parameters, in quotes")
    where = f"{where} ({entry['name']})"
    for key in _OF_FILES.intersection(entry):
        raise InputError(f"{where}, key {key}", "a key of recordings in files", "name and samples")
    if entry.get("samples") is None:
        raise InputError(f"{where}, key samples", "nothing", "numbers, (n,)")
    if entry.get("unit") is None:
        raise InputError(f"{where}, key unit", "nothing", f"{', '.join(UNITS)}, in quotes")
    return {**entry, "file": entry["name"]}


def _samples(where: str, entry: RecordingTable, given: Mapping[str, Any]) -> Table:
    samples = _floats(f"{where}, key samples", given["samples"])
    quantity, factor = UNITS[entry.unit or ""]
    used = _mask(f"{where}, key used", given.get("used"), samples.size)
    if given.get("times_s") is None:
        if entry.sample_rate_hz is None:
            raise InputError(where, "no clock", "times_s (n,), or sample_rate_hz")
        interval = 1.0 / entry.sample_rate_hz
        first, last = window((interval, 0.0), samples.size, entry.start_s, entry.end_s)
        _check_finite(f"{where}, key samples", samples[first:last], first)
        used = None if used is None else used[first:last]
        return Table(samples[first:last] * factor, interval, first * interval, quantity, used)
    times = _floats(f"{where}, key times_s", given["times_s"])
    if times.size != samples.size:
        found = f"{times.size} times of {samples.size} samples"
        raise InputError(f"{where}, key times_s", found, "a time for every sample")
    first, last = window(times, samples.size, entry.start_s, entry.end_s)
    if entry.resample:
        first, last = unbroken(times, samples, first, last)
    rows = np.arange(first, last, dtype=np.int64)
    times, samples = times[first:last], samples[first:last]
    _check_finite(f"{where}, key times_s", times, first)
    _check_finite(f"{where}, key samples", samples, first)
    used = None if used is None else used[first:last]
    if entry.resample and used is not None:  # what does not count is a gap in the clock
        times, samples, rows, used = times[used], samples[used], rows[used], None
    even = on_clock(
        where,
        times,
        samples * factor,
        rows,
        "sample",
        resample=entry.resample,
        alone=entry.is_alone,
    )
    check_rate(where, even.interval, entry.sample_rate_hz)
    used = even.used if used is None else used
    return Table(
        even.samples, even.interval, float(times[0]), quantity, used, repeated=even.repeated
    )


def _with_input(where: str, entry: RecordingTable, table: Table, given: Mapping[str, Any]) -> Table:
    """The table with the input's samples, taken over to its clock as the response's are."""
    where = f"{where}, input, key samples"
    values = given["input"].get("samples")
    if values is None:
        raise InputError(where, "nothing", "numbers, (n,), SI units")
    samples = _floats(where, values)
    if samples.size != np.size(given["samples"]):
        found = f"{samples.size} values for {np.size(given['samples'])} samples"
        raise InputError(where, found, "one for every sample")
    of_input = entry.model_copy(update={"unit": "m"})
    other = _samples(where, of_input, {**given, "samples": samples})
    return replace(table, input=other.samples)


def _mask(where: str, given: Any, size: int) -> NDArray[np.bool_] | None:
    """Which samples count, (n,); None where all do."""
    if given is None:
        return None
    mask = np.asarray(given)
    if mask.dtype.kind != "b" or mask.shape != (size,):
        found = f"an array of {mask.dtype}, shape {mask.shape}"
        raise InputError(where, found, f"true or false for every sample, ({size},)")
    if int(mask.sum()) < 2:
        raise InputError(where, f"{int(mask.sum())} samples that count", "two or more")
    return mask


def _floats(where: str, values: Any) -> Floats:
    """Two or more numbers, (n,), finite or not."""
    if isinstance(values, np.ma.MaskedArray):
        values = np.ma.filled(values.astype(np.float64), np.nan)
    array = np.asarray(values)
    if array.dtype.kind not in "fiu":
        raise InputError(where, f"an array of {array.dtype}", _NUMBERS)
    if array.ndim != 1 or array.size < 2:
        raise InputError(where, f"an array of shape {array.shape}", _NUMBERS)
    return array.astype(np.float64)


def _check_finite(where: str, values: Floats, first: int) -> None:
    """Refuse a value that is no finite number; `first` is the position of the first one."""
    wrong = np.flatnonzero(~np.isfinite(values))
    if wrong.size:
        i = int(wrong[0])
        raise InputError(f"{where}, sample {first + i}", f"{values[i]}", _NUMBERS)


def _check_speed(where: str, table: Table) -> None:
    period = crossing_period(table.samples, table.interval)
    order = order_of(table.quantity)
    if period is None or is_angular(table.quantity) or order == 2:
        return  # an impact's peak acceleration says nothing of the speed
    amplitude = float(np.max(np.abs(table.samples - np.median(table.samples))))
    speed = amplitude * (2.0 * np.pi / period) ** (1 - order)
    if speed > FASTEST:
        unit = unit_of(table.quantity)
        found = f"{amplitude:.3g} {unit} at {1 / period:.3g} Hz, a speed of {speed:.3g} m/s"
        accepted = f"the unit of the samples ({', '.join(UNITS)}), and speeds below {FASTEST:g} m/s"
        raise InputError(f"{where}, key unit", found, accepted)


def _column_entry(
    door: str, frame: Any, columns: Sequence[str], entry: Mapping[str, Any]
) -> dict[str, Any]:
    """An entry of `from_arrays` from a column of a frame."""
    column = entry.get("column")
    if column not in columns:
        accepted = f"one of the frame's columns: {', '.join(columns)}"
        raise InputError(
            f"{door}, recording {entry.get('name')}, key column", repr(column), accepted
        )
    filled = {key: value for key, value in entry.items() if key != "column"}
    filled.setdefault("name", column)
    filled["samples"] = _numeric(frame[column])
    given = filled.get("input")
    if isinstance(given, Mapping) and "samples" not in given:
        if given.get("column") not in columns:
            where = f"{door}, recording {filled['name']}, input, key column"
            accepted = f"one of the frame's columns: {', '.join(columns)}"
            raise InputError(where, repr(given.get("column")), accepted)
        filled["input"] = {**given, "samples": _numeric(frame[given["column"]])}
    times = [name for name in TIME_COLUMNS if name in columns]
    if times and "times_s" not in filled:
        filled["times_s"] = _numeric(frame[times[0]]) * TIME_COLUMNS[times[0]]
    return filled


def _numeric(column: Any) -> NDArray[Any]:
    """A column as an array; pandas' own missing values become NaN."""
    if column.dtype.kind in "fiu":
        return np.asarray(column.to_numpy(dtype=np.float64, na_value=np.nan))
    return np.asarray(column)


def _array_entry(door: str, name: str, array: Any, filled: bool = False) -> dict[str, Any]:
    """An entry of `from_arrays` from a DataArray along time."""
    where = f"{door}, recording {name}"
    if array.dims != ("time",):
        raise InputError(where, f"the dimensions {', '.join(map(str, array.dims))}", "time")
    samples = np.asarray(array.values)
    if filled and samples.dtype.kind == "f":
        there = np.flatnonzero(~np.isnan(samples))
        samples = samples[: there[-1] + 1 if there.size else 0]
    entry: dict[str, Any] = {"name": name, "samples": samples, "unit": array.attrs.get("units")}
    case = array.coords["case"].item() if "case" in array.coords else array.attrs.get("case")
    if case is not None:
        entry["case"] = str(case)
    if "time" in array.coords:
        entry["times_s"] = _seconds(where, array.coords["time"])[: samples.size]
    return entry


def _seconds(where: str, time: Any) -> NDArray[Any]:
    values = np.asarray(time.values)
    if values.dtype.kind == "M":
        values = values - values[0]
    if values.dtype.kind == "m":
        return np.asarray(values / np.timedelta64(1, "ns")) * 1e-9
    unit = str(time.attrs.get("units", "s"))
    if unit not in ("s", "ms"):
        raise InputError(f"{where}, coordinate time", f'units "{unit}"', "s, ms, or datetimes")
    return values * (1e-3 if unit == "ms" else 1.0)


def _plain(value: Any) -> Any:
    """The same with NumPy's scalars and read-only mappings as Python's own, however deep."""
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value.item() if isinstance(value, np.generic) else value
