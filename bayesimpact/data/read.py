"""Reads a campaign: campaign.toml and its recordings, refused in one message if unusable."""

from __future__ import annotations

import hashlib
import math
import re
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from types import MappingProxyType
from typing import Any

from bayesimpact.data import bounds
from bayesimpact.data.campaign import SECOND_STOP, Beam, Campaign
from bayesimpact.data.chain import measurement_of
from bayesimpact.data.channels import check_channels
from bayesimpact.data.doubts import doubts_of, scaled_units
from bayesimpact.data.entries import filled_in
from bayesimpact.data.foreign import file_bytes, is_foreign, read_foreign
from bayesimpact.data.gaps import after_lone_readings, excluded_spans
from bayesimpact.data.input_column import input_of, with_input
from bayesimpact.data.period import crossing_period
from bayesimpact.data.prior_bounds import check_prior, parameter_ranges, prior_names
from bayesimpact.data.quantity import check_quantity, unit_of, with_article
from bayesimpact.data.recording import Recording
from bayesimpact.data.schema import (
    CampaignTable,
    LogUniformTable,
    RecordingTable,
    UniformTable,
    parse_campaign,
)
from bayesimpact.data.table import Table, read_table
from bayesimpact.errors import InputError

CAMPAIGN_FILE = "campaign.toml"
_ACCEPTED = "a free decay, or a motion with an input, of two periods or more"
_EFFECT_PARAMETER = re.compile(r"[a-z]\w*\.[a-z]\w*(\[.+\])?")


def load_campaign(path: Path | str, folders: Sequence[Path | str] = ()) -> Campaign:
    """Read and check a campaign.

    Parameters
    ----------
    path : the folder that holds campaign.toml, or that file
    folders : others, beside the campaign's own, whose files campaign.toml may name

    Raises
    ------
    InputError
        for whatever cannot be used: the message names the file, the line or key, what was found and
        what is accepted.
    """
    file = _campaign_file(Path(path))
    content = _bytes(file, str(file), bounds.TOML_BYTES)
    table = filled_in(parse_campaign(_parse(file, content), str(file)), file.parent, str(file))
    digest = hashlib.sha256(content)

    def read(entry: RecordingTable, where: str) -> tuple[str, Table]:
        source = file.parent / entry.file
        bounds.inside(source, (file.parent, *map(Path, folders)), f"{where}, key file")
        data = file_bytes(source, f"{where}, key file")
        if not data:
            data = _bytes(source, f"{where}, key file", bounds.TABLE_BYTES)
        digest.update(data)
        return str(source), with_input(source, entry, data, _table(source, entry, data))

    campaign = build_campaign(str(file), table, read)
    return replace(campaign, sha256=digest.hexdigest(), folder=file.parent)


def build_campaign(
    file: str, table: CampaignTable, read: Callable[[RecordingTable, str], tuple[str, Table]]
) -> Campaign:
    """Check what campaign.toml says together with the samples, wherever they come from.

    Parameters
    ----------
    file : for messages
    table : the content of campaign.toml
    read : gives the samples of an entry, and what messages call their source; its second argument
        names the entry in messages

    Raises
    ------
    InputError
        as `load_campaign`.
    """
    recordings: list[Recording] = []
    scaled: list[str] = []
    doubts: list[str] = []
    for number, entry in enumerate(table.recording, 1):
        where = f"{file}, recording {number} ({entry.file})"
        if entry.skip is not None:
            continue
        _check_entry(where, entry, bool(table.stop), recordings)
        source, samples = read(entry, where)
        recording = _recording(source, where, entry, bool(table.stop), samples)
        recordings.append(recording)
        scaled += [f"{recording.name}, {words}" for words in scaled_units(entry, samples)]
        doubts += doubts_of(entry, samples, recording)
    skipped = {e.name or Path(e.file).stem: e.skip for e in table.recording if e.skip}
    table = table.model_copy(update={"recording": [e for e in table.recording if e.skip is None]})
    if not recordings:
        raise InputError(f"{file}, key skip", "on every recording", "one recording without skip")
    _check_together(file, table, recordings)
    return Campaign(
        name=table.name,
        mass=table.mass_kg,
        recordings=tuple(recordings),
        stop=bool(table.stop),
        measurement=measurement_of(file, table, recordings),
        priors=MappingProxyType(_priors(file, table, recordings)),
        beams=MappingProxyType(_beams(file, table)),
        keep_faults=table.faults == "keep",
        skipped=MappingProxyType(skipped),
        notes=tuple(f"{name} is skipped ({reason})" for name, reason in skipped.items()),
        declared=(SECOND_STOP,) if table.stop == "two-sided" else (),
        scaled=tuple(scaled),
        doubts=tuple(doubts),
    )


def _campaign_file(path: Path) -> Path:
    try:
        path = path / CAMPAIGN_FILE if path.is_dir() else path
        there = path.is_file()
    except (OSError, ValueError):  # no path at all: too long, or with a NUL
        there = False
    if not there:
        raise InputError(str(path), "no such file", f"a folder with {CAMPAIGN_FILE}, or that file")
    if path.suffix != ".toml":
        raise InputError(
            str(path), "a file that is not .toml", f"a folder with {CAMPAIGN_FILE}, or that file"
        )
    return path


def _bytes(path: Path, where: str, most: int) -> bytes:
    bounds.regular_file(path, where, most)
    try:
        return path.read_bytes()
    except OSError as error:
        found = (error.strerror or str(error)).lower()
    raise InputError(where, f"{found} at {path}", "a readable file")


def _parse(file: Path, content: bytes) -> dict[str, Any]:
    long = next((i for i, x in enumerate(content.splitlines(), 1) if len(x) > bounds.TOML_LINE), 0)
    if long:
        found = f"more than {bounds.TOML_LINE} characters in a line"
        raise InputError(f"{file}, line {long}", found, "shorter lines")
    try:
        document = tomllib.loads(content.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        found = f"a byte that is not UTF-8 (0x{content[error.start]:02x})"
        raise InputError(f"{file}, line {line}", found, "TOML in UTF-8") from None
    except tomllib.TOMLDecodeError as error:
        text = str(error)
        place = re.search(r" ?\(at (?:line (\d+), column \d+|end of document)\)", text)
        last = content.rstrip().count(b"\n") + 1
        line = int(place.group(1) or last) if place else last
        found = text.replace(place.group(0), "") if place else text
        raise InputError(f"{file}, line {line}", f"an error of syntax ({found})", "TOML") from None
    except RecursionError:
        raise InputError(str(file), "lists or tables nested without end", "TOML") from None
    except (ValueError, OverflowError) as error:  # a number of thousands of digits
        raise InputError(str(file), f"a value that is none ({error})", "TOML") from None
    if isinstance(document.get("priors"), dict):
        document["priors"] = _dotted(document["priors"])
    return document


def _dotted(tables: dict[str, Any]) -> dict[str, Any]:
    """TOML reads an unquoted key `effect.parameter` as a table in a table; undo that."""
    flat: dict[str, Any] = {}
    for name, value in tables.items():
        nested = isinstance(value, dict) and value and "distribution" not in value
        if nested and all(isinstance(inner, dict) for inner in value.values()):
            flat |= {f"{name}.{key}": inner for key, inner in value.items()}
        else:
            flat[name] = value
    return flat


def _check_entry(where: str, entry: RecordingTable, stop: bool, earlier: list[Recording]) -> None:
    if stop and entry.case is None:
        accepted = 'the obstacle\'s name, as case = "1"; or stop = false for a rig without obstacle'
        raise InputError(f"{where}, key case", "nothing", accepted)
    name = entry.name or Path(entry.file).stem
    if name in (recording.name for recording in earlier):
        found = f'a second recording called "{name}"'
        accepted = "file names that differ without their endings, for they name the parameters"
        raise InputError(f"{where}, key file", found, accepted)
    start, end = entry.start_s, entry.end_s
    if start is not None and end is not None and start >= end:
        raise InputError(f"{where}, key end_s", f"{end:g} s", f"a time after start_s = {start:g} s")
    if entry.scale == 0.0:
        raise InputError(f"{where}, key scale", "0", "a number other than 0")
    for start, end in entry.exclude_s or ():
        if start > end:
            found = f"a span from {start:g} to {end:g} s"
            raise InputError(f"{where}, key exclude_s", found, "spans that end after they begin")


def _table(source: Path, entry: RecordingTable, data: bytes) -> Table:
    if is_foreign(source, entry, data):
        return read_foreign(source, entry, data)
    column = None if entry.column is None else str(entry.column)
    return read_table(
        source,
        data,
        column=column,
        unit=entry.unit,
        sample_rate=entry.sample_rate_hz,
        resample=entry.resample,
        alone=entry.is_alone,
        span=(entry.start_s, entry.end_s),
    )


def _recording(
    source: str, where: str, entry: RecordingTable, stop: bool, table: Table
) -> Recording:
    check_quantity(f"{where}, key quantity", entry.quantity, table.quantity)
    bounds.check_readings(table.samples, unit_of(table.quantity), source)
    bounds.check_interval(table.interval, source)
    # A sample at the very start or end counts in, however its time was rounded.
    margin = 1e-6
    size, interval = table.samples.size, table.interval
    first, stop_at = 0, size
    if entry.start_s is not None:
        first = min(size, max(0, math.ceil((entry.start_s - table.start) / interval - margin)))
    if entry.end_s is not None:
        stop_at = min(size, math.floor((entry.end_s - table.start) / interval + margin) + 1)
    if stop_at - first < 2:
        asked = f"start_s = {entry.start_s}, end_s = {entry.end_s}"
        span = f"{table.start:.6g} to {table.start + (size - 1) * interval:.6g} s"
        key = "start_s" if entry.start_s is not None else "end_s"
        raise InputError(
            f"{where}, key {key}", f"no samples left ({asked})", f"times within the file's {span}"
        )
    given = None if table.input is None else table.input[first:stop_at]
    factor = (-1.0 if entry.invert else 1.0) * (1.0 if entry.scale is None else entry.scale)
    recording = Recording(
        name=entry.name or Path(entry.file).stem,
        case=entry.case if stop and entry.case is not None else "",
        samples=table.samples[first:stop_at] * factor,
        interval=interval,
        start=table.start + first * interval,
        quantity=table.quantity,
        used=None if table.used is None else table.used[first:stop_at],
        input=input_of(where, entry, given, table.quantity, table.input_unit),
        motion_name=entry.motion or "",
        free_gain=entry.gain == "free",
        high_pass=entry.high_pass_hz or 0.0,
    )
    key = "exclude_s" if entry.exclude_s else "resample"
    recording = excluded_spans(f"{where}, key {key}", recording, entry.exclude_s or ())
    if entry.resample:
        recording = after_lone_readings(recording)
    _check_motion(source, recording)
    if entry.clock_ratio is not None:
        recording = replace(recording, interval=interval * entry.clock_ratio)
    highest = 0.5 / recording.interval
    if recording.high_pass >= highest:
        accepted = f"below half the sampling rate, {highest:g} Hz"
        raise InputError(f"{where}, key high_pass_hz", f"{recording.high_pass:g} Hz", accepted)
    return recording


def _check_motion(where: str, recording: Recording) -> None:
    samples = recording.samples
    if samples.max() == samples.min():
        found = f"{samples.size} samples that all equal {samples[0]:.6g} {recording.unit}"
        raise InputError(where, found, _ACCEPTED)
    period = crossing_period(samples, recording.interval)
    if period is None or recording.duration < 2.0 * period * (1.0 - 1e-3):
        found = f"{samples.size} samples over {recording.duration:.4g} s, fewer than two periods"
        if period is not None:
            found += f" of about {period:.4g} s"
        raise InputError(where, found, _ACCEPTED)


def _check_together(where: str, table: CampaignTable, recordings: list[Recording]) -> None:
    first = recordings[0]
    for number, (entry, recording) in enumerate(zip(table.recording, recordings, strict=True), 1):
        if recording.angular != first.angular:
            kind = "about an axis" if first.angular else "along a line"
            raise InputError(
                f"{where}, recording {number} ({entry.file})",
                with_article(recording.quantity),
                f"motion {kind}, as the first recording's {first.quantity}, throughout",
            )
    check_channels(where, recordings)
    if table.mass_uncertainty_kg >= table.mass_kg:
        found = f"{table.mass_uncertainty_kg:g} kg"
        accepted = f"less than the mass, {table.mass_kg:g} kg"
        raise InputError(f"{where}, key mass_uncertainty_kg", found, accepted)


def _beams(where: str, table: CampaignTable) -> dict[str, Beam]:
    cases = [entry.case for entry in table.recording if table.stop]
    for case in table.beam:
        if case not in cases:
            known = ", ".join(dict.fromkeys(str(c) for c in cases)) or "none (stop = false)"
            raise InputError(f"{where}, [beam.{case}]", "a case of no recording", f"cases: {known}")
    return {
        case: Beam(
            b.length_mm * 1e-3, b.width_mm * 1e-3, b.thickness_mm * 1e-3, b.youngs_modulus_mpa * 1e6
        )
        for case, b in table.beam.items()
    }


def _priors(
    where: str, table: CampaignTable, recordings: list[Recording]
) -> dict[str, MappingProxyType[str, Any]]:
    names = prior_names(bool(table.stop), recordings)
    ranges = parameter_ranges(table.mass_kg, recordings)
    for name, prior in table.priors.items():
        if name not in names and not _EFFECT_PARAMETER.fullmatch(name):
            near = get_close_matches(name[:100], names[:200], 1, 0.4)
            hint = f" (did you mean {near[0]}?)" if near else ""
            raise InputError(
                f"{where}, [priors], key {name}",
                f"no parameter of this campaign{hint}",
                f"{', '.join(names)}, or <effect>.<parameter>",
            )
        if isinstance(prior, UniformTable | LogUniformTable) and prior.lower >= prior.upper:
            raise InputError(
                f"{where}, [priors] {name}, key upper",
                f"{prior.upper:g}",
                f"more than lower = {prior.lower:g}",
            )
        check_prior(f"{where}, [priors] {name}", name, prior.model_dump(), ranges)
    return {name: MappingProxyType(prior.model_dump()) for name, prior in table.priors.items()}
