"""A first campaign.toml, one file in it: response, clock and input, and what is assumed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayesimpact.data.clock import even_interval, mean_rate, taken_evenly
from bayesimpact.data.doubts import SLOWEST, likely_unit
from bayesimpact.data.input import UNITS as INPUT_UNITS
from bayesimpact.data.input import Kind
from bayesimpact.data.period import crossing_period
from bayesimpact.data.quantity import RESPONSE_COLUMNS, UNITS, order_of
from bayesimpact.data.readers.channel import TIME_UNITS, Channel
from bayesimpact.data.readers.guess import (
    clocks_of,
    guessed_response,
    moving,
    named_quantity,
    named_response,
    nearest_clock,
    other_responses,
    units_by_name,
)
from bayesimpact.data.toml_text import one_line, toml
from bayesimpact.errors import InputError

ASSUMED = "ASSUMED"
NEEDED = "NEEDED"
TURN = 2.0 * np.pi  # rad: few things swing further
SHOWN = 20
"""Channels of one file that a comment lists."""


def likely_responses(channels: Sequence[Channel]) -> list[Channel]:
    """What may be the response, the likeliest first; [] where nothing but clocks is there.

    A column named as this package's own files name theirs; else by units, by names, by numbers; of
    several that are alike see `moving`.
    """
    free = [c for c in channels if c.name not in INPUT_UNITS]
    free = [c for c in free if not (c is channels[0] and c.never_falls)] or free
    own = [c for c in free if c.name in RESPONSE_COLUMNS]
    found = own or guessed_response(free) or named_response(free) or other_responses(free)
    found = [c for c in found if not c.is_time]
    if not found:
        return []
    best = moving(found)
    return [best, *(c for c in found if c is not best)]


def channel_lines(
    channels: Sequence[Channel], unit: str | None = None, rate: float | None = None
) -> list[str]:
    """The lines that choose the channel and its clock.

    unit, rate : what the user says of readings without a unit, and, in Hz, of files without a clock
    """
    candidates = likely_responses(channels)
    if not candidates:
        there = one_line(", ".join(dict.fromkeys(c.label for c in channels)))
        return [f"# {NEEDED}: a displacement or an angle; the file has {there}"]
    response, lines = candidates[0], []
    note = ""
    if len(candidates) > 1:
        rest = ", ".join(c.label for c in candidates[1:SHOWN])
        note = f"  # {ASSUMED}: {_why(candidates, channels)}; others: {one_line(rest)}"
    blocks = list(dict.fromkeys(c.block for c in channels))
    inside = [c for c in channels if c.block == response.block]
    if len(blocks) > 1:
        block = response.block or str(blocks.index(response.block) + 1)
        more = ", ".join(b or str(blocks.index(b) + 1) for b in blocks if b != response.block)
        note_of = f"  # {ASSUMED}: the first of several; others: {one_line(more)}"
        lines.append(f"block = {toml(block)}{note_of if blocks[0] == response.block else ''}")
    lines.append(f"column = {_chosen(inside, response)}{note}")
    return [*lines, *_unit_lines(response, unit), *_clock_lines(inside, response, rate)]


def _why(candidates: Sequence[Channel], channels: Sequence[Channel]) -> str:
    """Why it is the first of these candidates."""
    order = list(channels)
    first = min(candidates, key=order.index) is candidates[0]
    than = "" if first else "it moves more than "
    return f"{than}the first that may be the response"


def _unit_lines(response: Channel, unit: str | None) -> list[str]:
    """Quantity and unit, as far as the file, its names and the user say them."""
    if response.unit in UNITS:
        quantity = UNITS[response.unit][0]
        return [f"quantity = {toml(quantity)}"] if order_of(quantity) > 0 else []
    if unit is not None:
        return [f"unit = {toml(unit)}"]
    named, fitting = named_quantity(response.name), units_by_name(response.name)
    given = f"its unit is {response.unit}" if response.unit else "the file gives no unit"
    example = "mm" if "mm" in fitting else fitting[0]
    if named == "angle" and np.nanmax(np.abs(response.samples)) > TURN:
        example = "deg"
    said = [f"quantity = {toml(named)}  # {ASSUMED}: by its name"] if "mm" not in fitting else []
    lines = [*said, f'# unit = "{example}"  # {NEEDED}: {given}; {", ".join(fitting)}']
    if response.unit:
        lines.append(f"# scale = 1.0  # {NEEDED}: how many of that unit one {response.unit} is")
    return lines


def _clock_lines(inside: Sequence[Channel], response: Channel, rate: float | None) -> list[str]:
    if response.times is not None:
        return []
    clocks, clock = clocks_of(inside, response), nearest_clock(inside, response)
    if clock is None and response.interval is not None:
        return []
    first = inside[0]
    guessed = clock is None and first is not response and first.never_falls
    clock = first if guessed else clock
    if clock is None and rate is not None:
        return [f"sample_rate_hz = {rate!r}"]
    if clock is None:
        return [f"# sample_rate_hz = 1000.0  # {NEEDED}: the file has no clock"]
    even = is_even(clock)
    why = [f"it rises{' evenly' if even else ''}"] if guessed else []
    if len(clocks) > 1:
        rest = ", ".join(c.label for c in clocks if c is not clock)
        why.append(f"it is next to the response; others: {one_line(rest)}")
    period = _period(clock, response)
    slow = not clock.unit and period > SLOWEST
    if not slow and (late := late_lines(clock, response)):
        return late
    why += [] if clock.unit or slow else ["in s"]
    note = f"  # {ASSUMED}: {', '.join(why)}" if why else ""
    lines = [f"time_column = {_chosen(inside, clock)}{note}"]
    if slow:
        needed = f"{NEEDED}: read in s a period would last {period:.4g} s; {', '.join(TIME_UNITS)}"
        lines.append(f"# time_unit = {toml(likely_unit(period))}  # {needed}")
    return lines + resample_lines(clock)


def late_lines(clock: Channel, response: Channel) -> list[str]:
    """The mean rate of readings that follow one another evenly although their times do not."""
    times = clock.seconds()
    if times.size != response.samples.size or is_even(clock):
        return []
    if not taken_evenly(times, response.samples):
        return []
    rate = mean_rate(times)
    why = f"the readings follow one another evenly, the times of {one_line(clock.label)} do not"
    unit = "" if clock.unit else "; in s"
    return [f"sample_rate_hz = {rate:.6g}  # {ASSUMED}: {why}: those of a buffer{unit}"]


def resample_lines(clock: Channel) -> list[str]:
    """`resample = true` for a clock that is read only so."""
    if is_even(clock) or not np.all(np.diff(clock.samples) > 0.0):
        return []
    return [f"resample = true  # {ASSUMED}: its times are not evenly spaced"]


def is_even(clock: Channel) -> bool:
    """True for time stamps that are read as they are."""
    try:
        even_interval("", clock.samples, np.arange(clock.samples.size))
    except InputError:
        return False
    return True


def _period(clock: Channel, response: Channel) -> float:
    """Period of a response in the clock's unit, in s where it has none; 0 where none shows."""
    steps = np.diff(clock.seconds())
    if not np.isfinite(steps).any():
        return 0.0
    good = response.samples[np.isfinite(response.samples)]
    return crossing_period(good, float(np.nanmedian(steps))) or 0.0


def input_lines(channels: Sequence[Channel]) -> list[str]:
    """The line of a measured input of the response's clock: a force, or a base's motion by name."""
    response = next(iter(likely_responses(channels)), None)
    if response is None:
        return []
    inside = [c for c in channels if c.block == response.block]
    timed = [c for c in inside if c.interval == response.interval and np.any(c.samples != 0.0)]
    found = [(c, kind) for c in timed if (kind := _input_kind(c)) and c is not response]
    if not found:
        return []
    channel, kind = found[0]
    others = ", ".join(c.label for c, _ in found[1:SHOWN])
    note = f"  # {ASSUMED}: it drove the motion{f'; others: {one_line(others)}' if others else ''}"
    return [f"input = {{ column = {_chosen(inside, channel)}, kind = {toml(kind)} }}{note}"]


def _input_kind(channel: Channel) -> Kind | None:
    """As what a channel may have driven the motion; None where neither name nor unit says so."""
    named = next((kind for kind in INPUT_UNITS if channel.name == kind), None)
    return named or ("force_N" if channel.unit in INPUT_UNITS["force_N"] else None)


def _chosen(channels: Sequence[Channel], channel: Channel) -> str:
    """A channel's name where only it has that name, else its number."""
    same = [c for c in channels if c.name == channel.name]
    headless = channel.name.isdigit()
    if len(same) == 1 and not headless:
        return toml(channel.name)
    return str([c is channel for c in channels].index(True) + 1)
