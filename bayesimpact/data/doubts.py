"""What reading took a file for, where campaign.toml or the motion speaks against it; for `check`.

Nothing of it is wrong for certain, so nothing is refused.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from bayesimpact.data.gaps import runs
from bayesimpact.data.input import UNITLESS
from bayesimpact.data.input import UNITS as INPUT_UNITS
from bayesimpact.data.period import crossing_period
from bayesimpact.data.quantity import STANDARD_GRAVITY, units_like
from bayesimpact.data.readers.channel import TIME_UNITS
from bayesimpact.data.recording import Recording
from bayesimpact.data.schema import RecordingTable
from bayesimpact.data.table import Table

TALLEST = 100.0
"""Longest pendulum, and largest sag of a spring under its mass, m, that a building has room for.

Foucault's in the Panthéon is 67 m long.
"""
SLOWEST = 2.0 * math.pi * math.sqrt(TALLEST / STANDARD_GRAVITY)
"""Period of such an oscillator, s: for a spring that sags by h under its mass as for a pendulum of
length h it is 2 pi sqrt(h / g). Slower are balances of torsion, gliders on soft springs, pendulums
that swing in a nearly horizontal plane or are balanced: they state their unit."""
NEAR = 2e-3
"""Relative distance up to which a factor is that of a change of units, as 9.81 and 0.0175 are."""


def doubts_of(entry: RecordingTable, table: Table, recording: Recording) -> list[str]:
    """What a user should look at in how an entry of campaign.toml was read, in words."""
    found = [_clock(recording)] if table.assumed_seconds else []
    found.append(_hole(entry, table, recording))
    if table.stamped_late:
        found.append(_late(recording))
    if table.repeated:
        found.append(_repeated(table))
    found.append(_scale("its readings are", entry.scale, table.unit, units_like(table.unit)))
    given = entry.input
    if given is not None:
        what = f"its input, column {given.column}, is"
        alike = units_like(table.input_unit) or INPUT_UNITS[given.kind]
        found.append(_scale(what, given.scale, table.input_unit, alike))
    return [f"{recording.name}: {text}" for text in found if text]


def scaled_units(entry: RecordingTable, table: Table) -> list[str]:
    """The units that factors and free gains of campaign.toml multiply, in words; [] without any."""
    words = []
    if entry.scale is not None and table.unit:
        words.append(f"readings: {table.unit}, times scale = {entry.scale:g}")
    given = entry.input
    if given is not None and given.scale != 1.0:
        unit = table.input_unit or f"no unit, so SI ({given.kind})"
        words.append(f"input {given.column}: {unit}, times scale = {given.scale:g}")
    foreign = table.input_unit not in UNITLESS
    if given is not None and foreign and table.input_unit not in INPUT_UNITS[given.kind]:
        words.append(f"input {given.column}: {table.input_unit}, taken as N; its gain is free")
    return words


def likely_unit(period: float) -> str:
    """Unit of a clock that makes of `period`, read in s, one of an oscillator in a building."""
    finer = (unit for unit, size in TIME_UNITS.items() if size < 1.0 and period * size <= SLOWEST)
    return next(finer, "s")


def _hole(entry: RecordingTable, table: Table, recording: Recording) -> str:
    """The longest gap in a file's own readings; "" where there is none of two or more."""
    if table.used is None:
        return ""
    asked = 0 if entry.start_s is None else (entry.start_s - table.start) / table.interval
    begun = max(math.ceil(asked - 1e-6), 0)
    last = round((recording.start + recording.duration - table.start) / table.interval)
    holes = [
        (end - first, first, end)
        for first, end in runs(~table.used)
        if end - first > 1 and first > begun and end <= last
    ]
    if not holes:
        return ""
    _, first, end = max(holes)
    begin, until = (table.start + i * table.interval for i in (first - 1, end))
    text = f"its file has no readings between {begin:.4g} and {until:.4g} s"
    if len(holes) > 1:
        text += f", nor in {len(holes) - 1} shorter gaps"
    if recording.start > table.start + (begun + 0.5) * table.interval:
        text += f"; it is read from {recording.start:.4g} s on, for few readings lie before"
    return text


def _late(recording: Recording) -> str:
    """Doubt of time stamps that are uneven where the readings are not."""
    return (
        "its time stamps are uneven, and its readings follow one another evenly, as behind a "
        "buffer: leave out resample and time_column, and state the rate in campaign.toml, "
        f"sample_rate_hz = {1.0 / recording.interval:.4g}"
    )


def _repeated(table: Table) -> str:
    """Doubt of rows that repeat because a probe was asked more often than it renews its reading."""
    rows = table.samples.size + table.repeated
    return (
        f"{table.repeated} of its {rows} readings repeat the one before in an even beat, as of a "
        "probe that is asked more often than it renews its reading: it is read as one every "
        f"{table.interval:.4g} s, {1.0 / table.interval:.4g} Hz"
    )


def _clock(recording: Recording) -> str:
    """Doubt of a clock without a unit, taken in s; "" where nothing speaks against it."""
    period = crossing_period(recording.samples, recording.interval)
    if period is None or period <= SLOWEST:
        return ""
    length = STANDARD_GRAVITY * (period / (2.0 * math.pi)) ** 2
    unit = likely_unit(period)
    return (
        f"its clock has no unit and is taken in s: a period of {period:.4g} s, that of a pendulum "
        f"{length:.3g} m long; state the unit in campaign.toml, time_unit = "
        f'"{unit}" (a period of {period * TIME_UNITS[unit]:.4g} s), or "s" where that is right'
    )


def _scale(what: str, scale: float | None, unit: str, units: Mapping[str, float]) -> str:
    """Doubt of a factor that converts what reading has converted already; "" for any other."""
    if scale is None or unit not in units:
        return ""
    for other, factor in units.items():
        if other != unit and abs(abs(scale) * factor / units[unit] - 1.0) < NEAR:
            return (
                f"{what} read in {unit}, and scale = {scale:g} multiplies that again: leave it out "
                f"where it was to turn {unit} into {other}"
            )
    return ""
