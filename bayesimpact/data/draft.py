"""A first campaign.toml for instrument files: what they say is written, the rest said assumed."""

from __future__ import annotations

import filecmp
import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bayesimpact.data.foreign import file_bytes
from bayesimpact.data.input import UNITS as INPUT_UNITS
from bayesimpact.data.input import Kind
from bayesimpact.data.quantity import RESPONSE_COLUMNS, UNITS, is_angular, order_of
from bayesimpact.data.readers import text
from bayesimpact.data.readers.channel import Channel
from bayesimpact.data.readers.formats import is_instrument_file, read_channels
from bayesimpact.data.readers.guess import guessed_response, nearest_clock
from bayesimpact.data.table import TIME_COLUMNS
from bayesimpact.errors import InputError

ASSUMED = "ASSUMED"
NEEDED = "NEEDED"
SHOWN = 20
"""Channels of one file that its comment lists."""
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
    own = own and bool(names & set(TIME_COLUMNS)) and len(names & set(RESPONSE_COLUMNS)) == 1
    plain = encoding in (None, "utf-8") or headed
    source = path if outside else None
    return Look(file, source, tuple(channels), None if plain else encoding, own)


def draft(title: str, looks: Sequence[Look], rig: DraftedRig) -> Draft:
    """campaign.toml with one [[recording]] per file that may hold a response."""
    angle = any(
        is_angular(UNITS[c.unit][0]) for one in looks for c in guessed_response(one.channels)
    )
    what = "the inertia in kg m2" if angle else "the moving mass"
    lines = [
        f"# A first campaign.toml. {ASSUMED}: not in the files, to be checked. {NEEDED}: missing.",
        f"name = {_toml(title)}",
        "mass_kg = 1.0"
        f"  # {ASSUMED}: put in {what}; with 1.0 all forces and stiffnesses are per unit of it"
        if rig.mass is None
        else f"mass_kg = {rig.mass!r}",
        f"stop = true  # {ASSUMED}: there is an obstacle; false for an oscillator without one"
        if rig.stop is None
        else f"stop = {_toml(rig.stop)}",
    ]
    said = {"": lines[1:]}
    taken: set[str] = set()
    for one in looks:
        lines += ["", *_listing(one), "[[recording]]", f"file = {_toml(one.file)}"]
        begin = len(lines)
        stem = Path(one.file).stem
        if stem in taken:
            stem = next(
                f"{stem}-{i}" for i in range(2, len(looks) + 2) if f"{stem}-{i}" not in taken
            )
            lines.append(f"name = {_toml(stem)}")
        taken.add(stem)
        if rig.stop is not False:
            note = "" if rig.case else f"  # {ASSUMED}: recordings of one obstacle share a case"
            lines.append(f"case = {_toml(rig.case or '1')}{note}")
        lines += [] if one.own_kind else _keys(one, rig)
        lines += _input_lines(one)
        said[one.file] = lines[begin:]
    told = _told(said)
    return Draft(
        "\n".join(lines) + "\n",
        tuple(line for line in told if f"# {ASSUMED}" in line),
        tuple(line for line in told if f"{NEEDED}:" in line),
    )


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
    return _one_line(", ".join(parts))


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
    lines = [f"# {_one_line(one.file + origin)} holds"]
    for number, channel in enumerate(one.channels[:SHOWN], 1):
        lines.append(f"#   {number}: {listing(channel)}")
    if len(one.channels) > SHOWN:
        lines.append(f"#   and {len(one.channels) - SHOWN} more")
    return lines


def _keys(one: Look, rig: DraftedRig) -> list[str]:
    """The lines that choose the channel and its clock."""
    lines = [f"encoding = {_toml(one.encoding)}"] if one.encoding else []
    candidates = guessed_response(one.channels)
    others = [c for c in one.channels if not c.is_time]
    first_is_time = _rises_evenly(one.channels[0])
    if not candidates:
        candidates = [c for c in others if not (first_is_time and c is one.channels[0])]
    if not candidates:
        motion = ", ".join(dict.fromkeys(f"{c.label}" for c in one.channels))
        return [*lines, f"# {NEEDED}: a displacement or an angle; the file has {_one_line(motion)}"]
    response = candidates[0]
    note = ""
    if len(candidates) > 1:
        rest = ", ".join(c.label for c in candidates[1:SHOWN])
        note = f"  # {ASSUMED}: the first that may be the response; others: {_one_line(rest)}"
    blocks = list(dict.fromkeys(c.block for c in one.channels))
    inside = [c for c in one.channels if c.block == response.block]
    if len(blocks) > 1:
        block = response.block or str(blocks.index(response.block) + 1)
        lines.append(f"block = {_toml(block)}")
    lines.append(f"column = {_chosen(inside, response)}{note}")
    if response.unit in UNITS and order_of(UNITS[response.unit][0]) > 0:
        lines.append(f"quantity = {_toml(UNITS[response.unit][0])}")
    if response.unit not in UNITS and rig.unit is not None:
        lines.append(f"unit = {_toml(rig.unit)}")
    elif response.unit not in UNITS:
        lines.append(f'# unit = "mm"  # {NEEDED}: the file gives no unit; {", ".join(UNITS)}')
    return lines + _clock_lines(one, inside, response, first_is_time, rig.rate)


def _input_lines(one: Look) -> list[str]:
    """The line of a measured input of the response's clock: a force, or a base's motion by name."""
    known = [c for c in one.channels if c.name in RESPONSE_COLUMNS]
    response = next(iter(known or guessed_response(one.channels)), None)
    if response is None:
        return []
    inside = [c for c in one.channels if c.block == response.block]
    timed = [c for c in inside if c.interval == response.interval and np.any(c.samples != 0.0)]
    found = [(c, kind) for c in timed if (kind := _input_kind(c)) and c is not response]
    if not found:
        return []
    channel, kind = found[0]
    others = ", ".join(c.label for c, _ in found[1:SHOWN])
    note = f"  # {ASSUMED}: it drove the motion{f'; others: {_one_line(others)}' if others else ''}"
    return [f"input = {{ column = {_chosen(inside, channel)}, kind = {_toml(kind)} }}{note}"]


def _input_kind(channel: Channel) -> Kind | None:
    """As what a channel may have driven the motion; None where neither name nor unit says so."""
    named = next((kind for kind in INPUT_UNITS if channel.name == kind), None)
    return named or ("force_N" if channel.unit in INPUT_UNITS["force_N"] else None)


def _clock_lines(
    one: Look,
    inside: Sequence[Channel],
    response: Channel,
    first_is_time: bool,
    rate: float | None,
) -> list[str]:
    if response.times is not None:
        return []
    stated = nearest_clock(inside, response)
    guessed = False
    if stated is None and response.interval is not None:
        return []
    if stated is None and first_is_time and one.channels[0] is not response:
        stated, guessed = one.channels[0], True
    if stated is None and rate is not None:
        return [f"sample_rate_hz = {rate!r}"]
    if stated is None:
        return [f"# sample_rate_hz = 1000.0  # {NEEDED}: the file has no clock"]
    note = f"  # {ASSUMED}: it rises evenly" if guessed else ""
    if not stated.unit:
        note = f"{note}, in s" if guessed else f"  # {ASSUMED}: in s"
    return [f"time_column = {_chosen(inside, stated)}{note}"]


def _rises_evenly(channel: Channel) -> bool:
    steps = np.diff(channel.samples)
    return bool(
        steps.size > 1
        and np.all(np.isfinite(steps))
        and np.all(steps > 0.0)
        and steps.max() < 1.5 * np.median(steps)
    )


def _chosen(channels: Sequence[Channel], channel: Channel) -> str:
    """A channel's name where only it has that name, else its number."""
    same = [c for c in channels if c.name == channel.name]
    headless = channel.name.isdigit()
    if len(same) == 1 and not headless:
        return _toml(channel.name)
    return str([c is channel for c in channels].index(True) + 1)


def _one_line(words: str) -> str:
    return "".join(c if c.isprintable() else " " for c in words)


def _toml(value: object) -> str:
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
