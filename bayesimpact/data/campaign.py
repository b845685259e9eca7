"""A campaign: the recordings of one rig and what is known of the measuring chain."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

from bayesimpact.data.recording import Recording


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
    noise : standard deviation of the raw noise, m (or rad)
    smoothing : the filter that the recordings passed
    mass_sd : standard uncertainty of the mass, relative
    clock_sd : standard uncertainty of the clock rate, relative
    gain_sd : standard uncertainty of the probe's gain, relative
    """

    noise: float | None = None
    smoothing: Smoothing | None = None
    mass_sd: float = 0.0
    clock_sd: float = 0.0
    gain_sd: float = 0.0


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
class Campaign:
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

    def __repr__(self) -> str:
        """One line."""
        stop = f"cases {', '.join(self.cases)}" if self.stop else "no stop"
        return f"<Campaign {self.name!r}: {len(self.recordings)} recordings, {stop}>"

    @property
    def cases(self) -> tuple[str, ...]:
        """Obstacles in order of first appearance; () without a stop."""
        return tuple(dict.fromkeys(r.case for r in self.recordings)) if self.stop else ()

    def truncated(self, duration: float) -> Campaign:
        """The same campaign with only the first `duration` seconds of every recording."""
        kept = tuple(
            replace(r, samples=r.samples[: max(2, int(duration / r.interval) + 1)])
            for r in self.recordings
        )
        return replace(self, recordings=kept)

    def thinned(self, interval: float) -> Campaign:
        """The same campaign, thinned to samples about `interval` seconds apart."""
        kept = []
        for r in self.recordings:
            step = max(1, int(interval / r.interval))
            kept.append(replace(r, samples=r.samples[::step], interval=r.interval * step))
        return replace(self, recordings=tuple(kept))
