"""National Instruments TDMS: by npTDMS; a group is a block."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
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


@contextmanager
def _complaints() -> Iterator[list[str]]:
    """What npTDMS logs as a warning, collected in place of being printed."""
    said: list[str] = []
    logger = logging.getLogger("nptdms")
    handler = logging.Handler(logging.WARNING)
    handler.emit = lambda record: said.append(record.getMessage())  # type: ignore[method-assign]
    before = (list(logger.handlers), logger.propagate)
    logger.handlers, logger.propagate = [handler], False
    try:
        yield said
    finally:
        logger.handlers, logger.propagate = before


def read(path: Path, content: bytes) -> list[Channel]:
    """Every channel of numbers, scaled as the file says."""
    nptdms = library("nptdms", "npTDMS", path)
    with _complaints() as said_of_file:
        about = nptdms.TdmsFile.read_metadata(BytesIO(content)).groups()
        check_values(sum(len(channel) for group in about for channel in group.channels()), path)
        groups = nptdms.TdmsFile.read(BytesIO(content)).groups()
    if said_of_file:  # npTDMS reads what is left of a damaged file and merely logs that
        raise ValueError(said_of_file[0])
    found: list[Channel] = []
    for group in groups:
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
