"""A campaign: the recordings of one rig and what is known of the measuring chain."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from bayesimpact.data.frozen import Picklable
from bayesimpact.data.html import html_table, sketch
from bayesimpact.data.recording import Recording

if TYPE_CHECKING:
    from pandas import DataFrame

SECOND_STOP = "opposite_stop"
"""The effect that `stop = "two-sided"` declares: a stop on the side away from the first."""


@dataclass(frozen=True)
class Smoothing:
    """A linear filter that the measuring chain applied to the recordings.

    `savgol`: Savitzky-Golay with `window` samples and order `polyorder` (end windows by polynomial
    fit, as MATLAB's `smooth` and SciPy's `mode="interp"`). `lag`: first-order low pass with
    `time_constant` in s. `declared_window` is what campaign.toml says: one more than `window` when
    that is even, for an even span was shortened by one sample.
    """

    kind: Literal["savgol", "lag"]
    window: int = 0
    polyorder: int = 0
    time_constant: float = 0.0
    declared_window: int = 0


@dataclass(frozen=True)
class Measurement:
    """What campaign.toml says of the measuring chain; None where it says nothing.

    Attributes
    ----------
    noise : standard deviation of the raw noise, m (or rad); None for velocities, accelerations
    smoothing : the filter that the recordings passed
    mass_sd : standard uncertainty of the mass, relative
    clock_sd : standard uncertainty of the clock rate, relative
    gain_sd : standard uncertainty of the probe's gain, relative
    unfiltered : campaign.toml says that the recordings passed no filter (`smoothing = "none"`)
    """

    noise: float | None = None
    smoothing: Smoothing | None = None
    mass_sd: float = 0.0
    clock_sd: float = 0.0
    gain_sd: float = 0.0
    unfiltered: bool = False


_COLUMNS = ("recording", "case", "samples", "rate, Hz", "duration, s", "quantity")


@dataclass(frozen=True)
class Beam:
    """A cantilever obstacle, for the comparison with beam theory (Eq. 7); SI units."""

    length: float
    width: float
    thickness: float
    youngs_modulus: float

    @property
    def stiffness(self) -> float:
        """Tip stiffness 3 E I / l^3 of a cantilever, N/m (Tian et al., Eq. 7)."""
        inertia = self.width * self.thickness**3 / 12
        return 3 * self.youngs_modulus * inertia / self.length**3


@dataclass(frozen=True, eq=False)
class Campaign(Picklable):
    """Recordings of one oscillator, with one or more obstacles.

    Attributes
    ----------
    name : title for reports
    mass : kg, or kg m2 when the recordings are angles
    recordings : one or more, in the order of campaign.toml
    stop : False for a plain oscillator without an obstacle
    measurement : what is known of the measuring chain
    priors : parameter name -> the table of campaign.toml's [priors], SI; validated
    beams : case -> geometry of its obstacle, where given
    sha256 : of campaign.toml and every recording's file; "" for a campaign built in memory
    keep_faults : campaign.toml says that faults found in the recordings stay in (`faults = "keep"`)
    skipped : recording -> why it is left out
    notes : what was set aside in the recordings and why, in words, for reports
    declared : ids of effects that are known to act and belong to the base model
    scaled : units of the files that a `scale` or a free gain multiplies, in words
    doubts : how files were read where something speaks against it, in words
    """

    name: str
    mass: float
    recordings: tuple[Recording, ...]
    stop: bool = True
    measurement: Measurement = Measurement()
    priors: Mapping[str, Mapping[str, Any]] = field(default_factory=lambda: MappingProxyType({}))
    beams: Mapping[str, Beam] = field(default_factory=lambda: MappingProxyType({}))
    sha256: str = ""
    folder: Path | None = None
    keep_faults: bool = False
    skipped: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    notes: tuple[str, ...] = ()
    declared: tuple[str, ...] = ()
    scaled: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """One line."""
        stop = f"cases {', '.join(self.cases)}" if self.stop else "no stop"
        stop += ", two-sided" if SECOND_STOP in self.declared else ""
        return f"<Campaign {self.name!r}: {len(self.recordings)} recordings, {stop}>"

    def _repr_html_(self) -> str:
        """Its recordings, for a notebook."""
        rows = [
            (*row, sketch(r.samples)) for row, r in zip(self._rows, self.recordings, strict=True)
        ]
        return html_table(f"{self.name}: {self.mass:g} kg", (*_COLUMNS, ""), rows)

    @property
    def _rows(self) -> list[tuple[str, str, int, float, float, str]]:
        return [
            (r.name, r.case, r.samples.size, 1.0 / r.interval, r.duration, r.quantity)
            for r in self.recordings
        ]

    def summary(self) -> DataFrame:
        """Its recordings as a DataFrame indexed by their names."""
        import pandas

        return pandas.DataFrame(self._rows, columns=list(_COLUMNS)).set_index(_COLUMNS[0])

    @property
    def angular(self) -> bool:
        """True when the motion is about an axis."""
        return self.recordings[0].angular

    @property
    def mixed(self) -> bool:
        """True when the recordings are not all of one quantity."""
        return len({r.quantity for r in self.recordings}) > 1

    @property
    def cases(self) -> tuple[str, ...]:
        """Obstacles in order of first appearance; () without a stop."""
        return tuple(dict.fromkeys(r.case for r in self.recordings)) if self.stop else ()

    @classmethod
    def from_arrays(
        cls,
        recordings: Iterable[Recording | Mapping[str, Any]],
        *,
        name: str,
        mass_kg: float,
        **tables: Any,
    ) -> Campaign:
        """A campaign from samples in memory, checked as a campaign.toml and its files are.

        Parameters
        ----------
        recordings : one or more, each a `Recording` (SI units) or a mapping with the keys of a
            [[recording]]: `name`, `case`, `samples` (n,) and their `unit` (m, cm, mm, um, rad, deg,
            m/s, mm/s, m/s2, g, ...: the unit tells the quantity), and either `times_s` (n,),
            evenly spaced unless `resample` is true, or `sample_rate_hz`; `start_s`, `end_s`;
            `used` (n,), False where a sample is set aside; `input` with its own `samples` (n,), SI
            units, and `kind`, `gain`, `hold` as in campaign.toml
        name, mass_kg, tables : any other key of campaign.toml, as there: `stop = False`,
            `measurement = {"noise_um": 5.0}`, `priors = {"k1": {...}}`, `beam`, ...

        Raises
        ------
        InputError
            for whatever cannot be used: the message names the recording and key, what was found
            and what is accepted.
        """
        campaign: Campaign = _memory().campaign_from_arrays(recordings, name, mass_kg, tables)
        return campaign

    @classmethod
    def from_dataframe(
        cls,
        frame: Any,
        *,
        name: str,
        mass_kg: float,
        recordings: Iterable[Mapping[str, Any]] = (),
        **tables: Any,
    ) -> Campaign:
        """A campaign from a pandas DataFrame; checks and `tables` as in `from_arrays`.

        Parameters
        ----------
        frame : a column `time_s` or `time_ms` (or the index, by one of these names). Without
            `recordings`: one response column, named as in a file (`displacement_mm`, ...), and
            where there are several recordings, a column `recording` with their names and a column
            `case`
        recordings : for a frame with a column per recording: mappings with `column` and `unit`,
            and the other keys of `from_arrays`
        """
        campaign: Campaign = _memory().campaign_from_dataframe(
            frame, name, mass_kg, tuple(recordings), tables
        )
        return campaign

    @classmethod
    def from_xarray(cls, data: Any, *, name: str, mass_kg: float, **tables: Any) -> Campaign:
        """A campaign from an xarray Dataset or DataArray; checks and `tables` as in `from_arrays`.

        Parameters
        ----------
        data : a Dataset with one variable per recording, or a DataArray whose coordinate
            `recording` names them. Each has a coordinate `time` (s, or what its attribute `units`
            says, or datetimes), an attribute `units` and an attribute or coordinate `case`. NaN at
            the end of a row of a DataArray is filling and left out
        """
        campaign: Campaign = _memory().campaign_from_xarray(data, name, mass_kg, tables)
        return campaign

    def save(self, folder: Path | str, *, overwrite: bool = False) -> Path:
        """Write campaign.toml and a CSV file per recording, every digit; returns campaign.toml.

        Parameters
        ----------
        folder : made when missing
        overwrite : replace a campaign that is there already

        Raises
        ------
        InputError
            when `folder` holds a campaign.toml already, or cannot be written.
        """
        file: Path = import_module("bayesimpact.data.write").save_campaign(
            self, Path(folder), overwrite=overwrite
        )
        return file

    def truncated(self, duration: float) -> Campaign:
        """The same campaign with only the first `duration` seconds of every recording."""
        kept = tuple(
            replace(r, samples=r.samples[: max(2, int(duration / r.interval) + 1)])
            for r in self.recordings
        )
        return replace(self, recordings=kept)

    def excerpt(self, duration: float) -> Campaign:
        """The first `duration` seconds of every recording; of driven ones, the largest motion.

        An input may begin with rest. Channels of one motion are cut alike, as the first of them.
        """
        kept: list[Recording] = []
        begins: dict[str, int] = {}
        for r in self.truncated(duration).recordings:
            whole = next(other for other in self.recordings if other.name == r.name)
            if r.input is None:
                kept.append(r)
                continue
            n, both = r.samples.size, [o for o in self.recordings if o.motion_name == r.motion_name]
            shared = min(o.samples.size for o in both) if r.motion_name else whole.samples.size
            power = np.cumsum(np.concatenate([[0.0], (whole.samples - whole.samples.mean()) ** 2]))
            sums = power[n : shared + 1] - power[: max(shared + 1 - n, 0)]
            first = int(np.argmax(sums)) if sums.size else 0
            if r.motion_name:
                first = begins.setdefault(r.motion_name, first)
            kept.append(whole.part(first, first + n))
        return replace(self, recordings=tuple(kept))

    def thinned(self, interval: float) -> Campaign:
        """The same campaign, thinned to samples about `interval` seconds apart.

        Recordings with an input stay as they are: between samples it has to be known.
        """
        kept = []
        for r in self.recordings:
            step = 1 if r.input is not None else max(1, int(interval / r.interval))
            used = None if r.used is None else r.used[::step]
            samples, spacing = r.samples[::step], r.interval * step
            kept.append(replace(r, samples=samples, interval=spacing, used=used))
        return replace(self, recordings=tuple(kept))


def _memory() -> Any:
    """The doors for samples in memory. By name: they build on this record, not it on them."""
    return import_module("bayesimpact.data.memory")
