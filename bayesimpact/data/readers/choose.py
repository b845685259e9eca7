"""From the channels of a file to the one that a recording asks for, in SI units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.clock import check_mean_rate, check_rate, taken_evenly
from bayesimpact.data.even_clock import on_clock
from bayesimpact.data.input import Kind, unit_factor
from bayesimpact.data.quantity import UNITS, Quantity, units_of
from bayesimpact.data.readers.channel import TIME_UNITS, Channel, name_and_unit
from bayesimpact.data.readers.guess import (
    clocks_of,
    guessed_response,
    named_response,
    other_responses,
    units_by_name,
)
from bayesimpact.data.table import Table, squeezed
from bayesimpact.data.window import unbroken, window
from bayesimpact.errors import InputError

Floats = NDArray[np.float64]
SHOWN = 12
"""Channels that a message lists."""


@dataclass(frozen=True)
class Wanted:
    """What a [[recording]] says of the channel it means.

    `column` and `time_column` are names, or numbers counted from 1 in the file's (or block's) own
    order; `start` and `end` in s. `kind`: what is wanted is an input of that kind, no response,
    and `free` says that its gain is an unknown. `alone`: nothing else has to stay on its clock.
    """

    column: str | int | None = None
    time_column: str | int | None = None
    time_unit: str | None = None
    block: str | int | None = None
    unit: str | None = None
    quantity: Quantity | None = None
    sample_rate: float | None = None
    start: float | None = None
    end: float | None = None
    resample: bool = False
    kind: Kind | None = None
    free: bool = False
    alone: bool = False


def choose(path: Path, channels: Sequence[Channel], wanted: Wanted) -> Table:
    """Samples and clock of the channel that is wanted.

    Raises
    ------
    InputError
        when no channel, or more than one, or no clock, or no unit fits; and for samples between
        start and end that are no numbers.
    """
    inside = _of_block(path, channels, wanted.block)
    channel = _response(path, inside, wanted)
    unit, quantity, factor = _quantity(path, channel, wanted)
    times, assumed = _times(path, channels, channel, wanted)
    first, last = window(times, channel.samples.size, wanted.start, wanted.end)
    if wanted.resample and not isinstance(times, tuple):
        first, last = unbroken(times, channel.samples, first, last)
    samples = channel.samples[first:last]
    _check_finite(path, channel, samples, first)
    if isinstance(times, tuple):
        interval, start = times
        return Table(samples * factor, interval, start + first * interval, quantity, unit=unit)
    stamps = times[first:last]
    rows = np.arange(first + 1, last + 1) if channel.rows is None else channel.rows[first:last]
    place = "sample" if channel.rows is None else "line"
    bad = np.flatnonzero(~np.isfinite(stamps))
    if bad.size:
        where = f"{path}, {place} {rows[bad[0]]}, time column"
        raise InputError(where, "no number", "a finite number")
    even = on_clock(
        path,
        stamps,
        samples * factor,
        rows.astype(np.int64),
        place,
        resample=wanted.resample,
        alone=wanted.alone,
    )
    check_rate(path, even.interval, wanted.sample_rate)
    return Table(
        even.samples, even.interval, float(stamps[0]), quantity, even.used,
        unit=unit, assumed_seconds=assumed, stamped_late=even.stamped_late,
        repeated=even.repeated,
    )  # fmt: skip


def listed(channels: Sequence[Channel]) -> str:
    """Channels as a message lists them."""
    several = len({c.block for c in channels}) > 1
    names = [f"{c.label} (block {c.block})" if several else c.label for c in channels]
    rest = f", and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
    return ", ".join(names[:SHOWN]) + rest


def _of_block(
    path: Path, channels: Sequence[Channel], block: str | int | None
) -> Sequence[Channel]:
    if block is None:
        return channels
    blocks = list(dict.fromkeys(c.block for c in channels))
    name = block if block in blocks else None
    if name is None and str(block).isdigit() and 1 <= int(block) <= len(blocks):
        name = blocks[int(block) - 1]
    if name is None:
        known = ", ".join(b or "(the file itself)" for b in blocks[:SHOWN])
        raise InputError(f"{path}, key block", f'"{block}"', f"one of the file's blocks: {known}")
    return [c for c in channels if c.block == name]


def _named(path: Path, channels: Sequence[Channel], key: str, asked: str | int) -> Channel:
    fitting = _called(channels, asked)
    if not fitting and str(asked).isdigit() and 1 <= int(asked) <= len(channels):
        fitting = [channels[int(asked) - 1]]
    if len(fitting) == 1:
        return fitting[0]
    shown = asked if isinstance(asked, int) else f'"{asked}"'
    found = f"{key} = {shown}, which is there {len(fitting)} times"
    accepted = f"one of this file's channels: {listed(channels)}"
    accepted += ", and their block" if len(fitting) > 1 else ""
    raise InputError(str(path), found, accepted)


def _called(channels: Sequence[Channel], asked: str | int) -> list[Channel]:
    """Channels of a name; else those whose name and unit are written like that, but for blanks."""
    exact = [c for c in channels if asked in (c.name, c.label, f"{c.name} ({c.unit})")]
    if exact or isinstance(asked, int):
        return exact
    name, unit = name_and_unit(asked)
    return [c for c in channels if squeezed(c.name) == squeezed(name) and unit in ("", c.unit)]


def _response(path: Path, channels: Sequence[Channel], wanted: Wanted) -> Channel:
    if wanted.column is not None:
        return _named(path, channels, "column", wanted.column)
    stated = UNITS[wanted.unit][0] if wanted.unit is not None else None
    fitting = guessed_response(channels, wanted.quantity)
    fitting = fitting or named_response(channels, wanted.quantity or stated)
    if not fitting:
        times = (
            ()
            if wanted.time_column is None
            else (_named(path, channels, "time_column", wanted.time_column),)
        )
        fitting = other_responses([c for c in channels if c not in times])
    if len(fitting) == 1:
        return fitting[0]
    found = f"{'several' if fitting else 'no'} channels that may be the response"
    raise InputError(str(path), found, f'column = "...", one of {listed(fitting or channels)}')


def _quantity(path: Path, channel: Channel, wanted: Wanted) -> tuple[str, Quantity, float]:
    """Unit, what was measured, factor to SI units; an input's own quantity does not matter."""
    if wanted.kind is not None:
        where = f"{path}, channel {channel.name}"
        factor = unit_factor(where, wanted.kind, channel.unit, wanted.free)
        return channel.unit, "displacement", factor
    unit = _unit(path, channel, wanted)
    return unit, *UNITS[unit]


def _unit(path: Path, channel: Channel, wanted: Wanted) -> str:
    where, asked = f"{path}, channel {channel.name}", wanted.unit
    if channel.unit in UNITS:
        if asked is not None and asked != channel.unit:
            found = f'unit = "{asked}" in campaign.toml'
            raise InputError(where, found, f'unit = "{channel.unit}", or no unit')
        return channel.unit
    if asked is None:
        found = f"the unit {channel.unit}" if channel.unit else "no unit for it"
        asked_of = wanted.quantity
        units = units_by_name(channel.name) if asked_of is None else units_of(asked_of)
        accepted = f"unit = ... in campaign.toml ({', '.join(units)})"
        if channel.unit:
            accepted += f", and scale = how many of it one {channel.unit} is"
        raise InputError(where, found, accepted)
    return asked


def _clock(
    path: Path, channels: Sequence[Channel], channel: Channel, wanted: Wanted
) -> tuple[float, float] | Channel | Floats:
    """An even clock (interval, start), the column of the time stamps, or these themselves, s."""
    if wanted.time_column is not None:
        beside = [c for c in channels if c.block == channel.block]
        stamps = _named(path, beside, "time_column", wanted.time_column)
        if stamps.samples.size != channel.samples.size or stamps is channel:
            found = f"{stamps.samples.size} times of {channel.samples.size} samples"
            found = "the response itself" if stamps is channel else found
            raise InputError(f"{path}, key time_column", found, "a time for every sample")
        if stamps.unit not in ("", *TIME_UNITS):
            accepted = f"a time ({', '.join(TIME_UNITS)})"
            raise InputError(f"{path}, key time_column", f"the unit {stamps.unit}", accepted)
        return stamps
    if channel.times is not None:
        return channel.times
    stated = clocks_of(channels, channel)
    if wanted.sample_rate is not None:  # what is stated comes before what is guessed
        stated = [c for c in stated if c.is_called_time]
        times = stated[0].seconds(wanted.time_unit) if len(stated) == 1 else None
        if times is not None and (stated[0].in_batches or taken_evenly(times, channel.samples)):
            check_mean_rate(path, times, wanted.sample_rate)
            return 1.0 / wanted.sample_rate, float(times[0])
    if len(stated) > 1:  # a time of day beside a clock with a unit
        with_unit = [c for c in stated if c.unit]
        stated = with_unit if len(with_unit) == 1 else stated
    if len(stated) == 1:
        return stated[0]
    if channel.interval is not None:
        check_rate(path, channel.interval, wanted.sample_rate)
        return channel.interval, channel.start
    if wanted.sample_rate is not None:
        return 1.0 / wanted.sample_rate, channel.start
    if stated:
        found = f"{len(stated)} columns that may be the clock of channel {channel.name}"
        raise InputError(str(path), found, f'time_column = "...", one of {listed(stated)}')
    found = f"no clock for channel {channel.name} among {listed(channels)}"
    raise InputError(str(path), found, "time_column, or sample_rate_hz in campaign.toml")


def _times(
    path: Path, channels: Sequence[Channel], channel: Channel, wanted: Wanted
) -> tuple[tuple[float, float] | Floats, bool]:
    """An even clock (interval, start), or the time stamps, s; and whether s is assumed of them."""
    clock, unit = _clock(path, channels, channel, wanted), wanted.time_unit
    if not isinstance(clock, Channel):
        if unit is not None:
            found = "no column of times that it is the unit of"
            raise InputError(f"{path}, key time_unit", found, "time_column, or no time_unit")
        return clock, False
    if unit is not None and clock.unit not in ("", unit):
        where = f"{path}, time column {clock.name}"
        found = f'time_unit = "{unit}" in campaign.toml'
        raise InputError(where, found, f'time_unit = "{clock.unit}", or no time_unit')
    return clock.seconds(unit), not clock.unit and unit is None


def _check_finite(path: Path, channel: Channel, samples: Floats, first: int) -> None:
    wrong = np.flatnonzero(~np.isfinite(samples))
    if samples.size < 2:
        raise InputError(str(path), f"{samples.size} samples", "two or more")
    if wrong.size:
        i = first + int(wrong[0])
        row = f"sample {i + 1}" if channel.rows is None else f"line {channel.rows[i]}"
        where = f"{path}, {row}, channel {channel.name}"
        raise InputError(where, "no finite number", "a finite number between start_s and end_s")
