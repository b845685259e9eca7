"""A fleet: which campaigns, with which dates and conditions, and what is done with each."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import date, datetime, time
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from bayesimpact.data import bounds
from bayesimpact.data.schema import FileName, Text, described
from bayesimpact.errors import InputError

Command = Literal["fit", "sample", "diagnose"]
DAY = 86400.0  # s
MOST = 10_000  # campaigns


class SessionTable(BaseModel):
    """One [[campaign]]; any further key is a condition: a number or a text."""

    model_config = ConfigDict(extra="allow", strict=True, frozen=True, allow_inf_nan=False)

    folder: FileName = Field(description="a campaign's folder relative to this file, in quotes")
    name: Text | None = Field(None, description="a name in quotes")
    date: Any = Field(None, description="a date without quotes, as 2026-05-01")


class FleetTable(BaseModel):
    """The whole of a fleet's file."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)

    name: Text = Field(description="a title in quotes")
    command: Command = Field("diagnose", description='"fit", "sample" or "diagnose"')
    quick: bool = Field(True, description="true or false: diagnose without sampling")
    campaign: Annotated[list[SessionTable], Field(min_length=1, max_length=MOST)] = Field(
        description=f'one to {MOST} [[campaign]], each with folder = "..."'
    )


@dataclass(frozen=True)
class Session:
    """One campaign of a fleet.

    Attributes
    ----------
    name : how tables call it
    folder : where campaign.toml is
    date : as it is written; "" without one
    day : since 1970-01-01, days; None without a date
    conditions : what else the fleet's file says of it, by name: numbers and texts
    """

    name: str
    folder: Path
    date: str = ""
    day: float | None = None
    conditions: Mapping[str, float | str] = field(default_factory=lambda: MappingProxyType({}))


@dataclass(frozen=True)
class Plan:
    """A fleet as its file describes it; the sessions by date, where all have one."""

    name: str
    command: Command
    quick: bool
    sessions: tuple[Session, ...]


def load_plan(file: Path) -> Plan:
    """Read and check the file of a fleet.

    Raises
    ------
    InputError : for whatever cannot be used, before any campaign is read
    """
    table = _parsed(file)
    sessions = [_session(file, n, one) for n, one in enumerate(table.campaign, 1)]
    known: set[str] = set()
    for n, one in enumerate(sessions, 1):
        if one.name in known:
            accepted = "a name of its own for every campaign"
            raise InputError(f"{file}, campaign {n}, key name", f'"{one.name}" again', accepted)
        known.add(one.name)
    if all(s.day is not None for s in sessions):
        sessions.sort(key=lambda s: s.day or 0.0)
    return Plan(table.name, table.command, table.quick, tuple(sessions))


def _parsed(file: Path) -> FleetTable:
    try:
        size = file.stat().st_size
        if size > bounds.TOML_BYTES:
            raise InputError(str(file), f"{size} bytes", f"at most {bounds.TOML_BYTES}")
        document = tomllib.loads(file.read_bytes().decode("utf-8"))
    except OSError as error:
        found = (error.strerror or str(error)).lower()
        raise InputError(str(file), found, "the TOML file of a fleet") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise InputError(str(file), str(error) or "nesting", "a TOML file in UTF-8") from None
    try:
        return FleetTable.model_validate(document)
    except ValidationError as error:
        raise _refusal(file, error) from None


def _refusal(file: Path, error: ValidationError) -> InputError:
    problem = error.errors()[0]
    first, *rest = problem["loc"]
    inside = first == "campaign" and len(rest) > 1
    place = f"{file}, campaign {int(rest[0]) + 1}" if inside else f"{file}"
    key = str(rest[1] if inside else first)
    fields = (SessionTable if inside else FleetTable).model_fields
    if problem["type"] == "extra_forbidden":
        return InputError(f"{place}, key {key}", "an unknown key", ", ".join(fields))
    found = "nothing" if problem["type"] == "missing" else described(problem["input"])
    return InputError(f"{place}, key {key}", found, fields[key].description or "")


def _session(file: Path, number: int, table: SessionTable) -> Session:
    where = f"{file}, campaign {number} ({table.folder})"
    extra = table.model_extra or {}
    conditions: dict[str, float | str] = {}
    for key, value in extra.items():
        if isinstance(value, bool) or not isinstance(value, (int, float, str)):
            raise InputError(f"{where}, key {key}", described(value), "a number or a text")
        conditions[key] = value if isinstance(value, str) else float(value)
    written, day = _day(where, table.date)
    name = table.name or table.folder
    folder = file.parent / table.folder
    return Session(name, folder, written, day, MappingProxyType(conditions))


def _day(where: str, value: Any) -> tuple[str, float | None]:
    if value is None:
        return "", None
    if not isinstance(value, date):
        accepted = SessionTable.model_fields["date"].description or ""
        raise InputError(f"{where}, key date", described(value), accepted)
    moment = value if isinstance(value, datetime) else datetime.combine(value, time())
    offset = moment.utcoffset()
    plain = moment.replace(tzinfo=None) - (offset or (moment - moment))
    return value.isoformat(), (plain - datetime(1970, 1, 1)).total_seconds() / DAY
