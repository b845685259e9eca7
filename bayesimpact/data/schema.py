"""What campaign.toml may hold, and how a departure from it is put into words.

Every field's `description` says what is accepted; messages quote it.
"""

from __future__ import annotations

from difflib import get_close_matches
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from bayesimpact.data import bounds
from bayesimpact.data.quantity import QUANTITIES, UNITS, Quantity
from bayesimpact.data.readers.channel import TIME_UNITS
from bayesimpact.errors import InputError

_SEEN = rf"^[^{bounds.UNSEEN}]*[^{bounds.UNSEEN}\s][^{bounds.UNSEEN}]*$"
Text = Annotated[str, Field(pattern=_SEEN, max_length=bounds.NAME_LENGTH)]
FileName = Annotated[str, Field(pattern=_SEEN, max_length=bounds.FILE_LENGTH)]
Positive = Annotated[float, Field(gt=0, ge=1 / bounds.PRIOR, le=bounds.PRIOR)]
NotNegative = Annotated[float, Field(ge=0, le=bounds.PRIOR)]
Number = Annotated[float, Field(ge=-bounds.PRIOR, le=bounds.PRIOR)]
Time = Annotated[float, Field(ge=-bounds.TIME, le=bounds.TIME)]
Mass = Annotated[float, Field(gt=0, ge=bounds.MASS[0], le=bounds.MASS[1])]
Rate = Annotated[float, Field(gt=0, ge=bounds.RATE[0], le=bounds.RATE[1])]
Length = Annotated[float, Field(gt=0, ge=1e-9, le=1e12)]  # in the key's unit; noise and beams
Count = Annotated[int, Field(ge=1, le=1_000_000)]
POSITIVE = "a number above 0"
COLUMN = "the name of a column in quotes, or its number counted from 1"
NUMBER = "a number"
Name = Annotated[
    str, Field(pattern=r"^[^\[\]/\\\s\x00-\x1f]([^\[\]/\\\x00-\x1f]*[^\[\]/\\\s\x00-\x1f])?$")
]
NAME_RULE = "a name for the parameters, in quotes, without brackets, slashes and blanks at its ends"


def _from(ends: tuple[float, float]) -> str:
    return f"({ends[0]:g} to {ends[1]:g})"


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


class InputTable(_Table):
    """The `input` of a [[recording]]: a column of the same file."""

    column: Text | Count | None = Field(None, description=COLUMN)
    kind: Literal["force_N", "base_m", "base_m_s2"] = Field(
        description="force_N, base_m or base_m_s2, in quotes"
    )
    scale: Annotated[float, Field(ge=-1e12, le=1e12)] = Field(
        1.0, description="a number other than 0, times the column (-1e+12 to 1e+12)"
    )
    gain: Literal["known", "free"] = Field(
        "known", description='"known" (1) or "free": an unknown, input_gain'
    )
    remove_mean: bool = Field(False, description="true or false, without quotes")
    hold: Literal["first_order", "band_limited"] | None = Field(
        None, description='"first_order" (a line between samples) or "band_limited"'
    )
    absolute: bool = Field(False, description="true or false, without quotes")


class RecordingTable(_Table):
    """One [[recording]]."""

    file: FileName = Field(description="a file name relative to campaign.toml, in quotes")
    case: Text | None = Field(None, description='the obstacle\'s name in quotes, as case = "1"')
    name: Name | None = Field(None, description=NAME_RULE)
    sample_rate_hz: Rate | None = Field(None, description=f"{POSITIVE}, Hz {_from(bounds.RATE)}")
    column: Text | Count | None = Field(None, description=COLUMN)
    channel: Text | Count | None = Field(None, description=COLUMN)
    time_column: Text | Count | None = Field(None, description=COLUMN)
    time_unit: Literal[tuple(TIME_UNITS)] | None = Field(  # type: ignore[valid-type]
        None, description=f"{', '.join(TIME_UNITS)}, in quotes"
    )
    block: Text | Count | None = Field(
        None, description="the name of a group, sheet or data set in quotes, or its number"
    )
    skip_rows: int | None = Field(
        None, ge=0, le=1_000_000, description="a whole number of lines, 0 to a million"
    )
    encoding: Text | None = Field(None, description='in quotes, as "latin-1", "utf-16"')
    unit: Literal[tuple(UNITS)] | None = Field(  # type: ignore[valid-type]
        None, description=f"{', '.join(UNITS)}, in quotes"
    )
    quantity: Quantity | None = Field(None, description=f"{', '.join(QUANTITIES)}, in quotes")
    motion: Text | None = Field(
        None, description="in quotes, the same for all channels that recorded one motion"
    )
    gain: Literal["known", "free"] = Field(
        "known", description='"known" (1) or "free": an unknown near 1, gain[<recording>]'
    )
    high_pass_hz: Rate | None = Field(
        None, description=f"{POSITIVE}, Hz {_from(bounds.RATE)}, below half the sampling rate"
    )
    start_s: Time | None = Field(None, description=f"{NUMBER}, s on the file's own clock")
    end_s: Time | None = Field(None, description=f"{NUMBER}, s on the file's own clock")
    exclude_s: list[Annotated[list[Time], Field(min_length=2, max_length=2)]] | None = Field(
        None, description="pairs of times, s on the file's own clock, as [[115.55, 115.60]]"
    )
    invert: bool = Field(False, description="true or false, without quotes")
    scale: Annotated[float, Field(ge=-1e12, le=1e12)] | None = Field(
        None, description="a number other than 0, times the readings (-1e+12 to 1e+12)"
    )
    clock_ratio: Annotated[float, Field(gt=0, ge=1e-3, le=1e3)] | None = Field(
        None,
        description=f"{POSITIVE}, true time over the file's time (0.001 to 1000); "
        "another unit is time_unit",
    )
    resample: bool = Field(False, description="true or false, without quotes")
    input: InputTable | None = Field(
        None, description='a measured input, as { column = "force", kind = "force_N" }'
    )
    skip: Text | None = Field(None, description="the reason to leave it out, in quotes")

    @property
    def is_alone(self) -> bool:
        """No input, other channel or stated rate has to stay on the clock of its rows."""
        return self.input is None and self.motion is None and self.sample_rate_hz is None


class SavgolTable(_Table):
    """Savitzky-Golay smoothing; an even window loses one sample, as in MATLAB's `smooth`."""

    kind: Literal["savgol"]
    window: int = Field(ge=3, le=bounds.WINDOW, description="a whole number of samples, 3 or more")
    polyorder: int = Field(
        ge=0,
        le=bounds.ORDER,
        description=f"a whole number, 0 or more, below window and at most {bounds.ORDER}",
    )


class LagTable(_Table):
    """A first-order low pass."""

    kind: Literal["lag"]
    time_constant_s: Length = Field(description=f"{POSITIVE}, s (1e-09 to 1e+12)")


class UnfilteredTable(_Table):
    """No filter, and none may be supposed; written `smoothing = "none"`."""

    kind: Literal["none"]


class MeasurementTable(_Table):
    """[measurement]."""

    noise_um: Length | None = Field(None, description=f"{POSITIVE}, um (1e-09 to 1e+12)")
    noise_mrad: Length | None = Field(None, description=f"{POSITIVE}, mrad (1e-09 to 1e+12)")
    noise_deg: Length | None = Field(None, description=f"{POSITIVE}, degrees (1e-09 to 1e+12)")
    smoothing: (
        Annotated[SavgolTable | LagTable | UnfilteredTable, Field(discriminator="kind")] | None
    ) = Field(
        None,
        description='{ kind = "savgol", window = 21, polyorder = 2 }'
        ' or { kind = "lag", time_constant_s = 0.001 }, or "none" for no filter at all',
    )
    clock_uncertainty_ppm: NotNegative = Field(
        0.0, le=1e6, description="a number, 0 or more, ppm (at most 1e6)"
    )
    gain_uncertainty_percent: NotNegative = Field(
        0.0, le=100, description="a number, 0 or more, % (at most 100)"
    )


class BeamTable(_Table):
    """One [beam.<case>]: a cantilever."""

    length_mm: Length = Field(description=f"{POSITIVE}, mm (1e-09 to 1e+12)")
    width_mm: Length = Field(description=f"{POSITIVE}, mm (1e-09 to 1e+12)")
    thickness_mm: Length = Field(description=f"{POSITIVE}, mm (1e-09 to 1e+12)")
    youngs_modulus_mpa: Length = Field(description=f"{POSITIVE}, MPa (1e-09 to 1e+12)")


class UniformTable(_Table):
    """Equal density from lower to upper."""

    distribution: Literal["uniform"]
    lower: Number = Field(description=f"{NUMBER} below upper, SI (within +-1e30)")
    upper: Number = Field(description=f"{NUMBER} above lower, SI (within +-1e30)")


class NormalTable(_Table):
    """Gaussian."""

    distribution: Literal["normal"]
    mean: Number = Field(description=f"{NUMBER}, SI (within +-1e30)")
    sd: Positive = Field(description=f"{POSITIVE}, SI")


class HalfNormalTable(_Table):
    """The positive half of a Gaussian about 0."""

    distribution: Literal["halfnormal"]
    scale: Positive = Field(description=f"{POSITIVE}, SI")


class CauchyTable(_Table):
    """Bell-shaped, with heavy tails."""

    distribution: Literal["cauchy"]
    median: Number = Field(description=f"{NUMBER}, SI (within +-1e30)")
    scale: Positive = Field(description=f"{POSITIVE}, SI")


class HalfCauchyTable(_Table):
    """The positive half of a Cauchy density about 0."""

    distribution: Literal["halfcauchy"]
    scale: Positive = Field(description=f"{POSITIVE}, SI")


class LogNormalTable(_Table):
    """Gaussian in the logarithm."""

    distribution: Literal["lognormal"]
    median: Positive = Field(description=f"{POSITIVE}, SI")
    sigma: Positive = Field(
        le=100, description=f"{POSITIVE}, standard deviation of the logarithm, at most 100"
    )


class LogUniformTable(_Table):
    """Equal density of the logarithm from lower to upper."""

    distribution: Literal["loguniform"]
    lower: Positive = Field(description=f"{POSITIVE} and below upper, SI")
    upper: Positive = Field(description=f"{POSITIVE} and above lower, SI")


PriorTable = Annotated[
    UniformTable
    | NormalTable
    | HalfNormalTable
    | CauchyTable
    | HalfCauchyTable
    | LogNormalTable
    | LogUniformTable,
    Field(discriminator="distribution"),
]


def _no_number(value: Any) -> Any:
    """The value; 1 and 0 equal true and false, and are not meant."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        raise ValueError("a number")
    return value


class CampaignTable(_Table):
    """The whole of campaign.toml."""

    name: Text = Field(description="a title in quotes")
    mass_kg: Mass = Field(
        description=f"{POSITIVE}, kg (for an angle: inertia in kg m2, or 1.0), "
        f"{bounds.MASS[0]:g} to {bounds.MASS[1]:g}"
    )
    mass_uncertainty_kg: NotNegative = Field(0.0, description="a number, 0 or more, kg")
    stop: Annotated[Literal[True, False, "one-sided", "two-sided"], BeforeValidator(_no_number)] = (
        Field(True, description='true or false, or "one-sided" or "two-sided" in quotes')
    )
    recording: list[RecordingTable] = Field(
        min_length=1, description='one or more [[recording]], each with file = "..."'
    )
    measurement: MeasurementTable = Field(
        default_factory=lambda: MeasurementTable.model_validate({}),
        description="a table [measurement]",
    )
    priors: dict[str, PriorTable] = Field(
        default_factory=dict, description="a table [priors] of distributions"
    )
    beam: dict[str, BeamTable] = Field(default_factory=dict, description="tables [beam.<case>]")
    faults: Literal["set aside", "keep"] = Field(
        "set aside", description='"set aside" or "keep": what becomes of faults of a recording'
    )


_TAGGED: dict[str, dict[str, type[_Table]]] = {
    "smoothing": {"savgol": SavgolTable, "lag": LagTable, "none": UnfilteredTable},
    "distribution": {
        "uniform": UniformTable,
        "normal": NormalTable,
        "halfnormal": HalfNormalTable,
        "cauchy": CauchyTable,
        "halfcauchy": HalfCauchyTable,
        "lognormal": LogNormalTable,
        "loguniform": LogUniformTable,
    },
}


def parse_campaign(document: dict[str, Any], where: str) -> CampaignTable:
    """Check a parsed campaign.toml; `where` names the file in the `InputError` that refuses it."""
    chain = document.get("measurement")
    if isinstance(chain, dict) and chain.get("smoothing") == "none":
        document = document | {"measurement": chain | {"smoothing": {"kind": "none"}}}
    try:
        return CampaignTable.model_validate(document)
    except RecursionError:
        raise InputError(where, "tables nested without end", "campaign.toml's own keys") from None
    except ValidationError as error:
        # An unknown key first: it is often the misspelt one that another error misses.
        problems = sorted(error.errors(), key=lambda e: e["type"] != "extra_forbidden")
        raise _refusal(problems[0], document, where) from None


def described(value: Any) -> str:
    """A value of campaign.toml as a message shows it."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'the text "{value}"'
    if isinstance(value, dict):
        return "a table" + (
            f" with {', '.join(map(str, value))}" if value else " with nothing in it"
        )
    if isinstance(value, list):
        return "a list" if value else "an empty list"
    text = str(value) if not isinstance(value, int) or abs(value) < 10**40 else "a huge number"
    return text


def _refusal(problem: Any, document: dict[str, Any], where: str) -> InputError:
    table, path, key = _place(tuple(problem["loc"]), document)
    whole = len(problem["loc"]) > 1 and table is CampaignTable  # an entry itself, not a key in it
    place = ", ".join([where, *path] if whole else [where, *path, f"key {key}"])
    kind = problem["type"]
    if kind == "extra_forbidden":
        near = get_close_matches(key[:50], table.model_fields, 1, 0.5)
        hint = f" (did you mean {near[0]}?)" if near else ""
        return InputError(place, f"an unknown key{hint}", ", ".join(table.model_fields))
    if kind == "union_tag_invalid":
        tags = str(problem["ctx"]["expected_tags"]).replace("'", '"')
        return InputError(place, f'"{problem["ctx"]["tag"]}"', tags)
    accepted = table.model_fields[key].description or ""
    if whole and key == "priors":
        accepted = f'{{ distribution = "..." }} with one of {", ".join(_TAGGED["distribution"])}'
    found = "nothing" if kind == "missing" else described(problem["input"])
    return InputError(place, found, accepted)


def _place(loc: tuple[Any, ...], document: dict[str, Any]) -> tuple[type[_Table], list[str], str]:
    """The table at fault, the way to it in words, and the key in it."""
    first = str(loc[0])
    if len(loc) == 1:
        return CampaignTable, [], first
    if first == "recording":
        entry = document["recording"][loc[1]]
        if len(loc) == 2:
            return CampaignTable, [f"recording {loc[1] + 1}"], first
        file = f" ({entry['file']})" if isinstance(entry.get("file"), str) else ""
        own = [f"recording {loc[1] + 1}{file}"]
        if loc[2] == "input" and len(loc) > 3:
            return InputTable, [*own, "input"], str(loc[3])
        return RecordingTable, own, str(loc[2])
    if first == "measurement":
        if len(loc) == 2:
            return MeasurementTable, ["[measurement]"], str(loc[1])
        tagged = _TAGGED["smoothing"][str(loc[2])]
        return tagged, ["[measurement]", "smoothing"], str(loc[3])
    if first == "beam":
        if len(loc) == 2:
            return CampaignTable, [f"[beam.{loc[1]}]"], first
        return BeamTable, [f"[beam.{loc[1]}]"], str(loc[2])
    if len(loc) == 2:
        return CampaignTable, [f"[priors] {loc[1]}"], first
    return _TAGGED["distribution"][str(loc[2])], [f"[priors] {loc[1]}"], str(loc[3])
