"""The input of a [[recording]]: the column that its table names, on the clock of the response."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.foreign import read_input
from bayesimpact.data.input import Input, checked
from bayesimpact.data.quantity import UNITS, Quantity, is_angular, order_of, with_article
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
    samples = other.samples[first - shift : end - shift]
    return replace(table, input=samples, input_unit=other.unit)


def input_of(
    where: str,
    entry: RecordingTable,
    values: NDArray[np.float64] | None,
    quantity: Quantity,
    unit: str,
) -> Input | None:
    """The input of an entry from its column (n,), SI units; None without one.

    quantity : what the entry's probe reads
    unit : that the file states for the column; "" where it states none

    Raises
    ------
    InputError
        for an input that cannot be used, whose base does not tell what `absolute` asks for, or
        moves along a line where the probe reads a motion about an axis, or the other way round,
        with a known gain.
    """
    given = entry.input
    if given is None or values is None:
        return None
    if given.scale == 0.0:
        raise InputError(f"{where}, input, key scale", "0", "a number other than 0")
    known = {"force_N": (), "base_m_s2": (2,), "base_m": (0, 1, 2)}[given.kind]
    if given.absolute and order_of(quantity) not in known:
        found = f'true beside kind = "{given.kind}" and {with_article(quantity)}'
        accepted = "a base_m, or an acceleration beside a base_m_s2; else false: relative to it"
        raise InputError(f"{where}, input, key absolute", found, accepted)
    turns = unit in UNITS and is_angular(UNITS[unit][0])
    known_base = given.kind != "force_N" and given.gain == "known"
    if known_base and unit in UNITS and turns != is_angular(quantity):
        found = f"a base in {unit} beside {with_article(quantity)}"
        accepted = 'both along a line, or both about an axis, or gain = "free"'
        raise InputError(f"{where}, input, key column", found, accepted)
    samples = given.scale * (values - values.mean() if given.remove_mean else values)
    made = Input(
        samples,
        given.kind,
        free=given.gain == "free",
        band_limited=given.hold == "band_limited",
        absolute=given.absolute,
        lines_stated=given.hold == "first_order",
    )
    return checked(where, made)
