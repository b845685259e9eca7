"""National Instruments TDMS: by npTDMS; a group is a block."""

from __future__ import annotations

from dataclasses import replace
from io import BytesIO
from pathlib import Path

from bayesimpact.data.readers.channel import (
    Channel,
    check_values,
    library,
    name_and_unit,
    spelt,
    split,
)


def read(path: Path, content: bytes) -> list[Channel]:
    """Every channel of numbers, scaled as the file says."""
    nptdms = library("nptdms", "npTDMS", path)
    groups = nptdms.TdmsFile.read_metadata(BytesIO(content)).groups()
    check_values(sum(len(channel) for group in groups for channel in group.channels()), path)
    found: list[Channel] = []
    for group in nptdms.TdmsFile.read(BytesIO(content)).groups():
        for channel in group.channels():
            if channel.dtype is None or channel.dtype.kind not in "fiu":
                continue
            said = channel.properties
            name, unit = name_and_unit(str(channel.name))
            step = float(said.get("wf_increment", 0.0) or 0.0)
            made = split(
                name,
                channel[:],
                unit=spelt(str(said.get("unit_string", "") or "")) or unit,
                block=str(group.name),
                sensor=str(said.get("NI_ChannelName", "") or ""),
            )
            if step > 0.0:
                start = float(said.get("wf_start_offset", 0.0) or 0.0)
                made = [replace(c, interval=step, start=start) for c in made]
            found += made
    return found
