"""The input of a [[recording]]: the column that its table names, on the clock of the response."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.foreign import read_input
from bayesimpact.data.input import Input, checked
from bayesimpact.data.recording import Recording
from bayesimpact.data.schema import RecordingTable
from bayesimpact.data.table import Table
from bayesimpact.errors import InputError


def with_input(source: Path, entry: RecordingTable, data: bytes, table: Table) -> Table:
    """The response's table with the samples of the entry's input, if it has one.

    Raises
    ------
    InputError
        as the readers, and for an input that does not cover the response.
    """
    if entry.input is None:
        return table
    other = read_input(source, entry, data)
    # where windows of channels differ, both are cut to what they share
    shift = round((other.start - table.start) / table.interval)
    first, end = max(shift, 0), min(table.samples.size, other.samples.size + shift)
    if end - first < table.samples.size:
        found = f"{other.samples.size} samples for {table.samples.size} of the response"
        raise InputError(f"{source}, key input", found, "an input for every sample of the response")
    return replace(table, input=other.samples[first - shift : end - shift])


def check_quantities(where: str, recordings: Sequence[Recording]) -> None:
    """Refuse inputs in a campaign where a probe reads a velocity or an acceleration."""
    driven = [r.name for r in recordings if r.input is not None]
    other = [r for r in recordings if r.order > 0]
    if driven and other:
        found = f"an input of {driven[0]}, and {other[0].name} of {other[0].quantity}"
        accepted = "with an input, recordings of displacement or angle throughout"
        raise InputError(f"{where}, key input", found, accepted)


def input_of(where: str, entry: RecordingTable, values: NDArray[np.float64] | None) -> Input | None:
    """The input of an entry from its column (n,), SI units; None without one."""
    given = entry.input
    if given is None or values is None:
        return None
    if given.scale == 0.0:
        raise InputError(f"{where}, input, key scale", "0", "a number other than 0")
    samples = given.scale * (values - values.mean() if given.remove_mean else values)
    made = Input(samples, given.kind, given.gain == "free", given.hold == "band_limited")
    return checked(where, made)
