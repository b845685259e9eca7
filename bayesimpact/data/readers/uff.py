"""Universal file format, data sets 58 (functions at nodes): by pyuff; time responses only."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from bayesimpact.data.readers.channel import Channel, check_values, library, spelt

TIME_RESPONSE = 1
_QUANTITIES = {8: "displacement", 9: "force", 11: "velocity", 12: "acceleration"}
_UNSTATED = ("", "none", "unknown")


def read(path: Path, content: bytes) -> list[Channel]:
    """A channel per time response; its block is the number of the data set."""
    pyuff = library("pyuff", "pyuff", path)
    with tempfile.TemporaryDirectory() as folder:  # pyuff reads by name only
        copy = Path(folder) / "data.uff"
        copy.write_bytes(content)
        sets = pyuff.UFF(str(copy)).read_sets()
    found: list[Channel] = []
    for number, data in enumerate(sets if isinstance(sets, list) else [sets], 1):
        if data.get("type") == 58 and data.get("func_type") == TIME_RESPONSE:
            found.append(_channel(path, data, str(number)))
    return found


def _channel(path: Path, data: dict, block: str) -> Channel:
    samples = np.asarray(data["data"])
    check_values(samples.size, path)
    kind = _QUANTITIES.get(int(data.get("ordinate_spec_data_type", 0)), "")
    unit = str(data.get("ordinate_axis_units_lab", "") or "").strip()
    place = f"{data.get('rsp_node', '')}:{data.get('rsp_dir', '')}"
    even = int(data.get("abscissa_spacing", 1)) == 1
    return Channel(
        f"{kind or 'response'}_{place}",
        np.real(samples).astype(np.float64),
        "" if unit.lower() in _UNSTATED else spelt(unit),
        block,
        str(data.get("id1", "") or "").strip(),
        interval=float(data["abscissa_inc"]) if even else None,
        start=float(data.get("abscissa_min", 0.0)) if even else 0.0,
        times=None if even else np.asarray(data["x"], dtype=np.float64),
    )
