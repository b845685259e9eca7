"""A first campaign.toml for instrument files: what they say is written, the rest said assumed."""

from __future__ import annotations

import filecmp
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bayesimpact.data.draft_lines import (
    ASSUMED,
    NEEDED,
    SHOWN,
    channel_lines,
    input_lines,
    late_lines,
    likely_responses,
    resample_lines,
)
from bayesimpact.data.foreign import file_bytes
from bayesimpact.data.one_sided import shortened
from bayesimpact.data.quantity import RESPONSE_COLUMNS, UNITS, is_angular, order_of
from bayesimpact.data.readers import text
from bayesimpact.data.readers.channel import Channel
from bayesimpact.data.readers.formats import is_instrument_file, read_channels
from bayesimpact.data.readers.guess import quantity_of
from bayesimpact.data.table import TIME_COLUMNS
from bayesimpact.data.toml_text import one_line, toml
from bayesimpact.errors import InputError

SHORTER = 0.05
"""Of a half cycle: what is seen of an obstacle with a quarter of the spring's stiffness, see
`shortened`: it takes off a tenth, of which half is left where it is hit to the end."""
FEW = 3
"""Files that are named one by one where the same is assumed of them."""


@dataclass(frozen=True)
class DraftedRig:
    """What the user says of the rig and its recordings; None where nothing is said.

    `unit` is of readings, and `rate` in Hz of clocks, of which the files say nothing.
    """

    mass: float | None = None
    stop: bool | None = None
    case: str | None = None
    unit: str | None = None
    rate: float | None = None


@dataclass(frozen=True, eq=False)
class Look:
    """One file: how campaign.toml is to name it, its channels, and its encoding if it is text.

    `source` is where a file lies that is outside the campaign's folder, and is to be copied there.
    """

    file: str
    source: Path | None
    channels: tuple[Channel, ...]
    encoding: str | None
    own_kind: bool


@dataclass(frozen=True)
class Draft:
    """The text of campaign.toml, and its lines that are assumptions or gaps."""

    toml: str
    assumed: tuple[str, ...]
    needed: tuple[str, ...]


def looks_at(folder: Path, paths: Sequence[Path]) -> list[Look]:
    """A look at every file; those outside `folder` get a name of their own in it."""
    home = folder.resolve()
    there = [path.resolve() for path in paths]
    names = {p: p.relative_to(home).as_posix() for p in there if p.is_relative_to(home)}
    for path in there:
        if path not in names:
            numbered = (f"{path.stem}-{i}{path.suffix}" for i in range(2, len(there) + 2))
            free = (name for name in (path.name, *numbered) if name not in names.values())
            names[path] = next(free)
    return [
        _look(path, names[end], home / names[end] != end)
        for path, end in zip(paths, there, strict=True)
    ]


def _look(path: Path, file: str, outside: bool) -> Look:
    """Read all channels of a file; `InputError` when that cannot be done."""
    where = str(path)
    if not path.exists():
        raise InputError(where, "no such file", "recordings as an instrument wrote them")
    content = file_bytes(path, where)
    if content is None:
        try:
            content = path.read_bytes()
        except OSError as error:
            reason = (error.strerror or str(error)).lower()
            raise InputError(where, reason, "a readable file") from None
    binary = is_instrument_file(path) and path.suffix.lower() != ".lvm"
    encoding = None if binary else text.guessed_encoding(content)
    # LabVIEW's own header is read by another reader, which finds the encoding itself
    headed = path.suffix.lower() == ".lvm"
    channels = read_channels(path, content, encoding=None if headed else encoding)
    names = {channel.name for channel in channels}
    own = not is_instrument_file(path) and encoding == "utf-8" and not text.is_labelled(content)
    own = own and len({channel.block for channel in channels}) == 1
    own = own and bool(names & set(TIME_COLUMNS)) and len(names & set(RESPONSE_COLUMNS)) == 1
    plain = encoding in (None, "utf-8") or headed
    source = path if outside else None
    return Look(file, source, tuple(channels), None if plain else encoding, own)


def draft(title: str, looks: Sequence[Look], rig: DraftedRig) -> Draft:
    """campaign.toml with one [[recording]] per file that may hold a response."""
    stop, stop_line = _stop(looks, rig)
    lines = [
        f"# A first campaign.toml. {ASSUMED}: not in the files, to be checked. {NEEDED}: missing.",
        f"name = {toml(title)}",
        _mass_line(looks, rig),
        stop_line,
    ]
    said = {"": lines[1:]}
    taken: set[str] = set()
    for one in looks:
        lines += ["", *_listing(one), "[[recording]]", f"file = {toml(one.file)}"]
        begin = len(lines)
        stem = Path(one.file).stem
        if stem in taken:
            stem = next(
                f"{stem}-{i}" for i in range(2, len(looks) + 2) if f"{stem}-{i}" not in taken
            )
            lines.append(f"name = {toml(stem)}")
        taken.add(stem)
        if stop:
            note = "" if rig.case else f"  # {ASSUMED}: recordings of one obstacle share a case"
            lines.append(f"case = {toml(rig.case or '1')}{note}")
        lines += _recording_lines(one, rig)
        said[one.file] = lines[begin:]
    told = _told(said)
    return Draft(
        "\n".join(lines) + "\n",
        tuple(line for line in told if f"# {ASSUMED}" in line),
        tuple(line for line in told if f"{NEEDED}:" in line),
    )


def _mass_line(looks: Sequence[Look], rig: DraftedRig) -> str:
    if rig.mass is not None:
        return f"mass_kg = {rig.mass!r}"
    responses = [c for one in looks for c in likely_responses(one.channels)[:1]]
    quantities = [quantity for c in responses if (quantity := quantity_of(c)) is not None]
    angle = any(map(is_angular, quantities)) or (
        rig.unit is not None and is_angular(UNITS[rig.unit][0])
    )
    what = "the inertia in kg m2" if angle else "the moving mass"
    per = "with 1.0 all forces and stiffnesses are per unit of it"
    return f"mass_kg = 1.0  # {ASSUMED}: put in {what}; {per}"


def _stop(looks: Sequence[Look], rig: DraftedRig) -> tuple[bool, str]:
    """Whether there is an obstacle, and the line that says so: as told, else as readings show."""
    if rig.stop is not None or rig.case is not None:
        stop = rig.stop is not False
        return stop, f"stop = {toml(stop)}"
    responses = [c for one in looks for c in likely_responses(one.channels)[:1]]
    shown = [shortened(c.samples) for c in responses if _order(c, rig) != 1]
    known = [share for share in shown if share is not None]
    if known and max(known) > SHORTER:
        why = f"half cycles to one side are {100 * max(known):.0f} % shorter, as by an obstacle"
        return True, f"stop = true  # {ASSUMED}: {why} there; false without one"
    if known:
        why = "half cycles to either side last alike; true where there is an obstacle, and a case"
        return False, f"stop = false  # {ASSUMED}: {why} in every recording"
    why = "the readings do not tell; false for an oscillator without an obstacle"
    return True, f"stop = true  # {ASSUMED}: {why}"


def _order(channel: Channel, rig: DraftedRig) -> int:
    """Which time derivative of a displacement a response is taken for."""
    if channel.unit not in UNITS and rig.unit is not None:
        return order_of(UNITS[rig.unit][0])
    quantity = quantity_of(channel)
    return 0 if quantity is None else order_of(quantity)


def _recording_lines(one: Look, rig: DraftedRig) -> list[str]:
    """The keys of one file: what it says itself needs none."""
    lines = [f"encoding = {toml(one.encoding)}"] if one.encoding else []
    if one.own_kind:
        clock = next(c for c in one.channels if c.name in TIME_COLUMNS)
        late = [line for c in likely_responses(one.channels)[:1] for line in late_lines(clock, c)]
        lines += late or resample_lines(clock)
    else:
        lines += channel_lines(one.channels, rig.unit, rig.rate)
    return lines + input_lines(one.channels)


def _told(said: Mapping[str, Sequence[str]]) -> list[str]:
    """Every different line once, and of which files it is said where there are several.

    said : file -> its lines; "" holds those of the whole campaign
    """
    files: dict[str, list[str]] = {}
    for file, lines in said.items():
        for line in lines:
            files.setdefault(line.lstrip("# "), []).append(file)
    every, found = len(said) - 1, []
    for line, those in files.items():
        few = ", ".join(those) if len(those) <= FEW else f"{len(those)} of {every} files"
        alone = those == [""] or every == 1
        found.append(line if alone else f"{'every file' if len(those) == every else few}: {line}")
    return found


def listing(channel: Channel) -> str:
    """One channel in a line: name, unit, samples, rate, block, sensor."""
    parts = [channel.label, f"{channel.samples.size} samples"]
    if channel.interval is not None:
        parts.append(f"{1 / channel.interval:.6g} Hz")
    finite = channel.samples[np.isfinite(channel.samples)]
    if finite.size:
        parts.append(f"{finite.min():.4g} to {finite.max():.4g}")
    parts += [f"block {channel.block}"] if channel.block else []
    parts += [channel.sensor] if channel.sensor else []
    return one_line(", ".join(parts))


def write(folder: Path, looks: Sequence[Look], made: Draft) -> Path:
    """Copy the files that lie elsewhere and write campaign.toml; nothing there is ever replaced.

    A campaign is one folder: it can be moved, and names no file outside.
    """
    file = folder / "campaign.toml"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for one in looks:
            if one.source is not None:
                _copy(one.source, folder / one.file)
        with file.open("x", encoding="utf-8", newline="\n") as stream:
            stream.write(made.toml)
    except FileExistsError:
        accepted = "a folder without one; it is never replaced"
        raise InputError(str(file), "a campaign already", accepted) from None
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise InputError(str(folder), reason, "a folder that can be written") from None
    return file


def _copy(source: Path, target: Path) -> None:
    if not target.exists():
        if source.is_dir():
            shutil.copytree(source, target)
        else:
            shutil.copyfile(source, target)
    elif source.is_dir() or not target.is_file() or not filecmp.cmp(source, target, shallow=False):
        accepted = "a folder without it; it is never replaced"
        raise InputError(str(target), f"something else of the name of {source}", accepted)


def _listing(one: Look) -> list[str]:
    origin = "" if one.source is None else f", copied from {one.source},"
    lines = [f"# {one_line(one.file + origin)} holds"]
    for number, channel in enumerate(one.channels[:SHOWN], 1):
        lines.append(f"#   {number}: {listing(channel)}")
    if len(one.channels) > SHOWN:
        lines.append(f"#   and {len(one.channels) - SHOWN} more")
    return lines
