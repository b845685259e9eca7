"""LabVIEW measurement files (.lvm): with LabVIEW's header by lvm-read, bare columns as text."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bayesimpact.data.readers import text
from bayesimpact.data.readers.channel import Channel, check_values, library, name_and_unit, spelt

HEADER = b"LabVIEW Measurement"


def read(path: Path, content: bytes) -> list[Channel]:
    """Channels of every segment (block "1", "2", ...), or of bare columns."""
    if HEADER not in content[:200]:
        return text.read(path, content)
    # read_str and not read: the latter leaves a pickle beside the file, and loads one
    data = library("lvm_read", "lvm-read", path).read_str(
        text.text_of(path, content, text.guessed_encoding(content))
    )
    found: list[Channel] = []
    for segment in range(int(data["Segments"])):
        found += _segment(path, data[segment], str(segment + 1), str(data.get("X_Columns", "One")))
    return found


def _segment(path: Path, segment: dict, block: str, x_columns: str) -> list[Channel]:
    values = np.asarray(segment["data"], dtype=np.float64)
    check_values(values.size, path)
    names = [str(name).strip() for name in segment["Channel names"]]
    units = [spelt(unit) for unit in segment.get("Y_Unit_Label", [])]
    intervals, starts = segment.get("Delta_X", []), segment.get("X0", [])
    found, y = [], 0
    for j, name in enumerate(names[: values.shape[1]]):
        if name == "Comment":
            continue
        if name == "X_Value":
            found.append(Channel("X_Value", values[:, j], "s", block))
            continue
        bare, unit = name_and_unit(name)
        step = float(intervals[y]) if y < len(intervals) else np.nan
        even = x_columns == "No" and np.isfinite(step) and step > 0.0
        found.append(
            Channel(
                bare,
                values[:, j],
                (units[y] if y < len(units) else "") or unit,
                block,
                interval=step if even else None,
                start=float(starts[y]) if even and y < len(starts) else 0.0,
            )
        )
        y += 1
    return found
