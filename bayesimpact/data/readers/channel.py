"""One channel of an instrument file, its clock, and how much of a file is read at most."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.quantity import RESPONSE_COLUMNS, UNITS
from bayesimpact.errors import InputError

Floats = NDArray[np.float64]

MAX_BYTES = 2**31
"""Largest file, and largest content of a compressed file, that is read."""
MAX_VALUES = 2**27
"""Most numbers that are read of one file: 1 GiB of them."""

_UNITS = {
    "µm": "um", "μm": "um", "micron": "um", "microns": "um", "micrometer": "um",
    "centimeter": "cm", "centimetre": "cm", "cm/s^2": "cm/s2", "cm/s²": "cm/s2", "gal": "cm/s2",
    "millimeter": "mm", "millimetre": "mm", "meter": "m", "metre": "m", "meters": "m",
    "°": "deg", "degree": "deg", "degrees": "deg", "radian": "rad", "radians": "rad",
    "sec": "s", "second": "s", "seconds": "s", "msec": "ms", "µs": "us", "μs": "us",
    "m/s^2": "m/s2", "m/s²": "m/s2", "m/s/s": "m/s2", "m s-2": "m/s2", "mm/s^2": "mm/s2",
    "mm/s²": "mm/s2", "g's": "g", "gn": "g", "m s-1": "m/s", "rad/sec": "rad/s", "°/s": "deg/s",
    "rad/s^2": "rad/s2", "rad/s²": "rad/s2", "volts": "V", "volt": "V", "newton": "N",
}  # fmt: skip
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0}
_QUANTITY_UNITS = (
    *UNITS,
    *("nm", "mrad", "V", "mV", "N", "kN", "Hz", "A", "mA", "Pa", "bar", "degC"),
)
LABEL_UNITS = frozenset((*_QUANTITY_UNITS, *TIME_UNITS))
"""Units that a column's label or a row below it is understood to mean."""
_TIMES = frozenset(
    ("time", "t", "zeit", "temps", "tiempo", "tempo", "timestamp", "x_value", "x-value")
)
_WORD = re.compile(r"[^\W\d_]+")
_LABEL = re.compile(r"^(.*?)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\)|/\s*([^/\s]+(?:/[^/\s]+)?))$")
_BRACKETS = re.compile(r"\s*(?:\[([^\[\]]*)\]|\(([^()]*)\))(?=\s)")


BATCHED = 0.1
"""Of the steps of a column, that stand still: more are no slip of a clock."""


@dataclass(frozen=True, eq=False)
class Channel:
    """Samples of one sensor, as the file gives them.

    Attributes
    ----------
    name, unit : as the file says, the unit in this package's spelling; "" where it says nothing
    samples : (n,) in that unit; NaN where the file has no number
    block : group, sheet, structure or data set of the file that holds the channel
    sensor : what else the file says of the sensor
    interval, start : of an even clock, s; None without one
    times : (n,) s, of a clock that is written out, else None
    rows : (n,) line of each sample, for messages; None: samples are counted from 1
    """

    name: str
    samples: Floats
    unit: str = ""
    block: str = ""
    sensor: str = ""
    interval: float | None = None
    start: float = 0.0
    times: Floats | None = None
    rows: NDArray[np.int64] | None = None

    @property
    def is_time(self) -> bool:
        """True for a column of time stamps: named so, or never falling and named or in units so."""
        named = self.unit != "" or says_time(self.name)
        fits = self.unit in ("", *TIME_UNITS)
        return self.is_called_time or (fits and named and self.never_falls)

    @property
    def is_called_time(self) -> bool:
        """True for a name that nothing but time stamps has, whatever the numbers."""
        return self.name.lower().removesuffix("_s").removesuffix("_ms") in _TIMES and (
            self.unit in ("", *TIME_UNITS)
        )

    @property
    def never_falls(self) -> bool:
        """True where no number is below the one before it: a clock or a count, and no motion."""
        steps = np.diff(self.samples[np.isfinite(self.samples)])
        return bool(steps.size and steps.min() >= 0.0 and steps.max() > 0.0)

    @property
    def in_batches(self) -> bool:
        """True for stamps that stand still for many rows: when these were sent, not read."""
        return self.never_falls and bool(np.mean(np.diff(self.samples) == 0.0) > BATCHED)

    def seconds(self, unit: str | None = None) -> Floats:
        """The samples of a column of time stamps, s; `unit`, or else s, where it has none."""
        return self.samples * TIME_UNITS.get(self.unit or unit or "s", 1.0)

    @property
    def label(self) -> str:
        """Name and unit as a message shows them."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


def says_time(name: str) -> bool:
    """True for names such as `Time`, `t`, `Time A`, `Time Stamp`, `tiempo_s`."""
    words = [word for word in words_of(name) if len(word) > 1]  # "t 3" may be a temperature
    return name.lower() in _TIMES or any(word in _TIMES for word in words)


def words_of(name: str) -> list[str]:
    """The words of a name, in small letters."""
    return _WORD.findall(name.lower())


def spelt(unit: str) -> str:
    """A unit in this package's spelling."""
    unit = unit.strip().strip("[]()").strip()
    return _UNITS.get(unit, _UNITS.get(unit.lower(), unit))


def name_and_unit(label: str) -> tuple[str, str]:
    """Name and unit of `Time [s]`, `Weg (mm)`, `x/mm` or `displacement_mm`; "" for no unit.

    Words that follow the unit belong to the name, as the run in `Angle (rad) Run #3`.
    """
    label = label.strip()
    match = _LABEL.match(label)
    if match:
        unit = spelt(next(group for group in match.groups()[1:] if group is not None))
        if unit in LABEL_UNITS:
            return match.group(1).strip() or label, unit
    for match in _BRACKETS.finditer(label):
        unit = spelt(match.group(1) or match.group(2) or "")
        if unit in LABEL_UNITS:
            return (label[: match.start()] + label[match.end() :]).strip(), unit
    if label in RESPONSE_COLUMNS:
        return label, RESPONSE_COLUMNS[label]
    head, _, tail = label.rpartition("_")
    if head and tail in ("m", "cm", "mm", "um", "rad", "deg", "s", "ms", "us"):
        return label, tail
    return label, ""


def library(name: str, package: str, path: object) -> Any:
    """The module `name`; `InputError` with the command that installs it when it is missing."""
    try:
        return import_module(name)
    except ImportError:
        found = f"a file that needs {package}, which is not installed"
        accepted = "the file once the command pip install 'bayesimpact[formats]' has run"
        raise InputError(str(path), found, accepted) from None


def check_values(count: int, path: object) -> None:
    """Refuse more numbers than are read at most."""
    if count > MAX_VALUES:
        found = f"{count:,} numbers"
        raise InputError(str(path), found, f"at most {MAX_VALUES:,} in one file")


def check_bytes(count: int, path: object) -> None:
    """Refuse more bytes, after decompression, than are read at most."""
    if count > MAX_BYTES:
        raise InputError(str(path), f"{count:,} bytes of content", f"at most {MAX_BYTES:,}")


def as_floats(values: Any) -> Floats | None:
    """Real numbers of any kind as float64; None for anything else."""
    array = np.ma.getdata(values) if isinstance(values, np.ma.MaskedArray) else np.asarray(values)
    if array.dtype.kind not in "fiub" or array.dtype.itemsize > 16:
        return None
    floats = array.astype(np.float64)
    if isinstance(values, np.ma.MaskedArray):
        floats[np.ma.getmaskarray(values)] = np.nan
    return floats


def split(name: str, values: Any, **rest: Any) -> list[Channel]:
    """Channels of an array: one of (n,), (n, 1) or (1, n); one per row or column of a matrix."""
    floats = as_floats(values)
    if floats is None or floats.ndim > 2 or floats.size < 2:
        return []
    if floats.ndim == 1 or 1 in floats.shape:
        return [Channel(name, floats.reshape(-1), **rest)]
    columns = floats if floats.shape[0] >= floats.shape[1] else floats.T
    if columns.shape[1] > 1000:
        return []
    return [
        Channel(f"{name}_{i}", np.ascontiguousarray(columns[:, i - 1]), **rest)
        for i in range(1, columns.shape[1] + 1)
    ]


_RATES = frozenset(
    ("fs", "samplerate", "samplingrate", "samplingfrequency", "sampleratehz", "fshz")
)
_INTERVALS = frozenset(("dt", "ts", "deltat", "interval", "samplinginterval", "wfincrement"))


def interval_among(scalars: Iterable[tuple[str, Any]]) -> float | None:
    """Sampling interval, s, that a scalar called fs, sample_rate, dt, ... states; None without."""
    for name, value in scalars:
        plain = re.sub(r"[^a-z]", "", name.lower())
        try:
            number = float(np.asarray(value).reshape(-1)[0])
        except (TypeError, ValueError, IndexError):
            continue
        if np.isfinite(number) and number > 0.0:
            if plain in _RATES:
                return 1.0 / number
            if plain in _INTERVALS:
                return number
    return None
