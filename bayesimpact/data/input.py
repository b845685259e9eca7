"""A measured input: the force on the mass, or the motion of the base, beside a recording."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.quantity import units_like
from bayesimpact.errors import InputError

Kind = Literal["force_N", "base_m", "base_m_s2"]
Floats = NDArray[np.float64]

UNITS: dict[Kind, dict[str, float]] = {
    "force_N": {"N": 1.0, "kN": 1e3, "mN": 1e-3},
    "base_m": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, **units_like("rad")},
    "base_m_s2": {"m/s2": 1.0, "mm/s2": 1e-3, "g": 9.80665, **units_like("rad/s2")},
}
"""Units that a file may state for an input of each kind, in SI; a base may turn about an axis."""
FAST = 0.2  # of the sampling rate: from five samples a period on a spline follows
LITTLE = 0.01  # of a base's mean square, mean and trend apart, that may lie above that
LEAST = 12  # samples, for a spline of degree five and a spectrum
TAPS, FINE = 24, 1024  # of the filter on either side; of the spectrum that it comes from
UNITLESS = ("", "V", "mV", "A", "mA")


@dataclass(frozen=True, eq=False)
class Input:
    """What drives the oscillator while a recording runs.

    Between its samples the force is linear in time (first-order hold). That weakens its component
    of frequency f by sinc2(f / rate): a third is lost at a third of the sampling rate. Where the
    input passed an anti-aliasing filter, `band_limited` puts it back: below half the rate the force
    then is what it was (band-limited assumption: Pintelon and Schoukens 2012, System
    Identification); the images above, which the mass hardly follows, stay. An acceleration holds
    the force at its own instant, where a band-limited one is what its sample says. `base_m` and
    `base_m_s2`: the force is minus the mass times the base's acceleration, and the recording is of
    the motion relative to the base, unless `absolute` says otherwise: then the base's own motion is
    added to the model's readings (an accelerometer on the mass reads the absolute acceleration).
    Displacements, `g` and initial conditions count from the base in either case.

    Attributes
    ----------
    samples : (n,) read-only, one per sample of the recording; N (N m for an angle), m or m/s2
    kind : what was measured
    free : its gain is an unknown, `input_gain`; else it is 1
    band_limited : see above
    absolute : the recording is of the motion in space, not relative to the base; only of a base
    lines_stated : it was stated that lines lie between its samples: nothing else is tried
    """

    samples: Floats
    kind: Kind = "force_N"
    free: bool = False
    band_limited: bool = False
    absolute: bool = False
    lines_stated: bool = False

    def __post_init__(self) -> None:
        samples = np.array(self.samples, dtype=np.float64)
        samples.setflags(write=False)
        object.__setattr__(self, "samples", samples)

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)
        self.__post_init__()  # unpickled arrays can be written

    @property
    def label(self) -> str:
        """Its kind and, where the motion in space is read, that."""
        return self.kind + (", absolute" if self.absolute else "")

    def part(self, first: int, end: int) -> Input:
        """Samples first..end-1."""
        return replace(self, samples=self.samples[first:end])

    @property
    def weakened(self) -> float:
        """Share of its root mean square that lines between its samples lose, 0 to 1."""
        power = np.abs(np.fft.rfft(self.samples - self.samples.mean())) ** 2
        lost = 1.0 - np.sinc(np.fft.rfftfreq(self.samples.size)) ** 2
        return float(np.sqrt((power @ lost**2) / power.sum()))

    def force(self, mass: float, interval: float) -> Floats:
        """The forces on the mass between which lines are drawn, (n,), N, for a gain of 1."""
        force = self.shown(mass, interval)
        return sharpened(force) if self.band_limited else force

    def shown(self, mass: float, interval: float) -> Floats:
        """The force on the mass at the samples themselves, (n,), N, for a gain of 1."""
        return self.samples if self.kind == "force_N" else -mass * self.base(interval, 2)

    def base(self, interval: float, order: int) -> Floats:
        """The `order`-th time derivative of the base's displacement at the samples, (n,).

        That of a recorded displacement is the derivative of the interpolating spline of degree
        five. Raises ValueError for what would ask for an integral.
        """
        have = {"base_m": 0, "base_m_s2": 2}.get(self.kind, 3)
        if order < have:
            raise ValueError(f"derivative {order} of a {self.kind}")
        if order == have:
            return self.samples
        from scipy.interpolate import make_interp_spline

        times = np.arange(self.samples.size) * interval
        spline = make_interp_spline(times, self.samples, 5)
        return np.asarray(spline.derivative(order)(times), dtype=np.float64)

    def carried(self, interval: float, order: int) -> Floats:
        """What the base adds to readings of this derivative, (n,), for a gain of 1."""
        return self.base(interval, order) if self.absolute else np.zeros(self.samples.size)

    def waves(self, mass: float, interval: float, order: int) -> Floats:
        """The input as simulators take it, (3, n): `force`, `shown` and `carried`."""
        return np.stack(
            [self.force(mass, interval), self.shown(mass, interval), self.carried(interval, order)]
        )


def sharpened(samples: Floats) -> Floats:
    """Samples (n,) whose first-order hold has the spectrum that a band-limited signal had.

    A symmetric filter of gain 1 / sinc2, tapered (Hann); beyond the ends samples are mirrored.
    """
    half = min(TAPS, samples.size - 1)
    frequency: Floats = np.fft.rfftfreq(FINE).astype(np.float64)
    weights = np.roll(np.fft.irfft(np.sinc(frequency) ** -2.0, FINE), FINE // 2)
    taps = weights[FINE // 2 - half : FINE // 2 + half + 1] * np.hanning(2 * half + 3)[1:-1]
    mirrored = np.pad(samples, half, mode="reflect", reflect_type="odd")
    return np.convolve(mirrored, taps / taps.sum(), "valid")


def checked(where: str, given: Input) -> Input:
    """The same input.

    Raises
    ------
    InputError
        for an input that never changes; for a base's displacement that changes too fast between
        samples for a second derivative: more than 1 % of its mean square above a fifth of the
        sampling rate, where five samples or fewer make a period.
    """
    x = given.samples
    if x.max() == x.min():
        found = f"{x.size} values that all equal {x[0]:.6g}"
        raise InputError(f"{where}, key input", found, "an input that changes")
    if given.kind != "base_m":
        return given
    if x.size < LEAST:
        raise InputError(f"{where}, key input", f"{x.size} samples", f"{LEAST} or more of a base")
    place = np.linspace(-1.0, 1.0, x.size)
    power = np.abs(np.fft.rfft(x - np.polyval(np.polyfit(place, x, 1), place))) ** 2
    fast = float(power[np.fft.rfftfreq(x.size) > FAST].sum() / max(float(power.sum()), 1e-300))
    if fast > LITTLE:
        found = f"a base sampled too coarsely: {100 * fast:.2g} % of its power above a fifth of the"
        accepted = f"at most {100 * LITTLE:g} % there; or the base's acceleration, base_m_s2"
        raise InputError(f"{where}, key input", f"{found} sampling rate", accepted)
    return given


def unit_factor(where: str, kind: Kind, unit: str, free: bool = False) -> float:
    """From the unit that a file states for an input to SI; 1 where it states none, or volts.

    free : the gain is an unknown, which turns whatever is proportional to a force into one, such as
        the position of a driver at the far end of a spring
    """
    if unit in UNITLESS or (free and kind == "force_N" and unit not in UNITS[kind]):
        return 1.0
    if unit not in UNITS[kind]:
        accepted = f'for kind = "{kind}" one of {", ".join(UNITS[kind])}'
        accepted += ', or any with gain = "free"' if kind == "force_N" else ""
        raise InputError(f"{where}, key input", f"a column in {unit}", accepted)
    return UNITS[kind][unit]
