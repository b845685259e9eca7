"""HDF5: by h5py; data sets as channels, groups as blocks, attributes as units and clock."""

from __future__ import annotations

from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

from bayesimpact.data.readers.channel import (
    Channel,
    check_values,
    interval_among,
    library,
    name_and_unit,
    spelt,
    split,
)

MAGIC = b"\x89HDF\r\n\x1a\n"


def read(path: Path, content: bytes) -> list[Channel]:
    """Every data set of real numbers; links to other files are not followed."""
    h5py = library("h5py", "h5py", path)
    found: list[Channel] = []
    with h5py.File(BytesIO(content), "r") as file:
        sets: list[Any] = []
        # visititems meets neither soft nor external links
        file.visititems(lambda _, item: sets.append(item) if hasattr(item, "shape") else None)
        numeric = [s for s in sets if s.dtype.kind in "fiu" and s.shape is not None]
        numeric = [s for s in numeric if not s.external and not s.is_virtual]
        check_values(sum(s.size for s in numeric), path)
        for item in numeric:
            found += _channels(item, [s for s in numeric if s.parent == item.parent])
    return found


def _channels(item: Any, siblings: list[Any]) -> list[Channel]:
    """Channels of one data set; scalars beside it may state the rate."""
    if item.size < 2:
        return []
    attributes = dict(item.attrs)
    scalars = [(_last(s.name), s[()]) for s in siblings if s.size == 1]
    interval = interval_among([*attributes.items(), *item.parent.attrs.items(), *scalars])
    unit = next((attributes[k] for k in ("unit", "units", "unit_str") if k in attributes), "")
    unit = unit.decode(errors="replace") if isinstance(unit, bytes) else str(unit)
    block = item.parent.name.strip("/")
    return [clocked(c, interval, unit) for c in split(_last(item.name), item[()], block=block)]


def _last(path: str) -> str:
    return path.rsplit("/", 1)[-1]


def clocked(channel: Channel, interval: float | None, unit: str) -> Channel:
    """The channel with an even clock, unless it is one, and with the unit in its name or beside."""
    name, own = name_and_unit(channel.name)
    unit = spelt(own or unit)
    timed = replace(channel, name=name, unit=unit)
    if timed.is_time:
        return timed
    # a unit beside the variables (a field `unit`) is not that of its time stamps
    return replace(timed, interval=interval)
