"""Rigs of many kinds, drawn at random: what a trial hides its effects in.

A `RigDesign` is a range of oscillators, obstacles, probes and sampling rates; `draw_rig_design`
picks one, with releases, rest readings, noise, rounding and, where the noise kind says so, a
declared filter.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import exp, log, pi, sqrt
from types import MappingProxyType

import numpy as np

from bayesimpact.data.campaign import Measurement, Smoothing
from bayesimpact.data.quantity import Quantity
from bayesimpact.trial.bundle import PAPER_RIG
from bayesimpact.trial.rig.measuring_chain import MeasuringChain
from bayesimpact.trial.rig.recordings import Release, Rig

Range = tuple[float, float]

NOISES = ("white", "ar1", "smoothed")
SLOW: Range = (0.03, 1.0)  # free periods in the correlation time of slow noise


@dataclass(frozen=True)
class RigDesign:
    """Ranges that a rig is drawn from; logarithmically uniform.

    Attributes
    ----------
    mass : kg
    frequency, damping : natural frequency in free flight, Hz, and its damping ratio
    stiffening : k2 / k1, drawn for every obstacle; empty for a rig without one
    contact_damping : c2 / (2 sqrt(k2 m)) at the mean k2
    amplitude : largest release, m
    gap : of the largest release
    cases, releases : number of obstacles, and of recordings with each
    rate, cycles : sampling rate, Hz, and free periods in a recording
    noise : standard deviation of the probe's noise, of the largest release
    fixed : an oscillator that is not drawn
    angle : it turns: kg m2, rad, N m in the place of kg, m, N
    """

    mass: Range
    frequency: Range
    damping: Range
    stiffening: Range
    contact_damping: Range
    amplitude: Range
    gap: Range
    cases: int
    releases: int
    rate: float
    cycles: Range
    noise: Range
    fixed: Rig | None = None
    angle: bool = False


_CONTACT_DAMPING = (0.01, 0.04)
_DAMPING = (2e-3, 1e-2)
_GAP = (0.1, 0.3)
_NOISE = (4e-4, 2e-3)

RIG_DESIGNS: Mapping[str, RigDesign] = {
    "paper": RigDesign(
        (0.503, 0.503), (6.38, 6.38), _DAMPING, (6.0, 6.0), _CONTACT_DAMPING, (6.2e-3, 6.8e-3),
        _GAP, 3, 3, 1000.0, (38.3, 38.3), (4e-4, 1.6e-3), fixed=PAPER_RIG,
    ),
    "soft": RigDesign(
        (0.8, 3.0), (0.8, 2.0), _DAMPING, (1.0, 3.0), _CONTACT_DAMPING, (0.02, 0.05),
        _GAP, 2, 3, 400.0, (15.0, 25.0), _NOISE,
    ),
    "stiff": RigDesign(
        (0.03, 0.2), (15.0, 30.0), _DAMPING, (15.0, 50.0), _CONTACT_DAMPING, (1e-3, 4e-3),
        _GAP, 3, 2, 5000.0, (25.0, 40.0), _NOISE,
    ),
    "fast": RigDesign(
        (0.01, 0.05), (40.0, 80.0), _DAMPING, (5.0, 15.0), _CONTACT_DAMPING, (3e-4, 1e-3),
        _GAP, 2, 2, 20000.0, (25.0, 40.0), _NOISE,
    ),
    "slow": RigDesign(
        (1.0, 5.0), (1.0, 3.0), _DAMPING, (3.0, 8.0), _CONTACT_DAMPING, (5e-3, 2e-2),
        _GAP, 2, 3, 200.0, (25.0, 45.0), _NOISE,
    ),
    "one": RigDesign(
        (0.2, 1.0), (4.0, 10.0), _DAMPING, (4.0, 12.0), _CONTACT_DAMPING, (3e-3, 1e-2),
        _GAP, 1, 4, 1000.0, (25.0, 40.0), _NOISE,
    ),
    "five": RigDesign(
        (0.2, 1.0), (4.0, 10.0), _DAMPING, (3.0, 12.0), _CONTACT_DAMPING, (3e-3, 1e-2),
        _GAP, 5, 2, 1000.0, (20.0, 30.0), _NOISE,
    ),
    "plain": RigDesign(
        (0.2, 1.0), (3.0, 10.0), _DAMPING, (0.0, 0.0), _CONTACT_DAMPING, (3e-3, 1e-2),
        _GAP, 0, 4, 500.0, (30.0, 50.0), _NOISE,
    ),
    "torsion": RigDesign(
        (0.01, 0.1), (0.4, 2.0), _DAMPING, (0.0, 0.0), _CONTACT_DAMPING, (0.03, 0.5),
        _GAP, 0, 4, 100.0, (25.0, 45.0), _NOISE, angle=True,
    ),
    "small": RigDesign(
        (0.4, 0.6), (5.0, 7.0), _DAMPING, (4.0, 8.0), _CONTACT_DAMPING, (5e-3, 7e-3),
        _GAP, 2, 2, 500.0, (12.0, 16.0), _NOISE,
    ),
}  # fmt: skip
"""Kinds of rigs by name; `small` is there for quick looks and tests."""


@dataclass(frozen=True)
class DrawnRig:
    """One drawn rig: everything about a campaign but the effects planted in it.

    Attributes
    ----------
    rig_kind, noise_kind : what it was drawn from
    rig, releases : the oscillator, and how the recordings start
    rate, duration : Hz and s, of every recording
    chain, measurement : what the chain does, and what the campaign admits of it
    """

    rig_kind: str
    noise_kind: str
    rig: Rig
    releases: tuple[Release, ...]
    rate: float
    duration: float
    chain: MeasuringChain
    measurement: Measurement

    @property
    def quantity(self) -> Quantity:
        """What the probe records."""
        return "angle" if RIG_DESIGNS[self.rig_kind].angle else "displacement"

    @property
    def amplitude(self) -> float:
        """Largest release, m."""
        return max(abs(r.y0) for r in self.releases)

    @property
    def omega(self) -> float:
        """Natural angular frequency in free flight, rad/s."""
        return sqrt(self.rig.k1 / self.rig.mass)

    @property
    def speed(self) -> float:
        """Largest speed in free flight, m/s."""
        return self.amplitude * self.omega

    @property
    def contact_stiffness(self) -> float:
        """Mean k2, N/m; 0 without an obstacle."""
        return float(np.mean(list(self.rig.k2.values()))) if self.rig.k2 else 0.0

    @property
    def contact_omega(self) -> float:
        """Angular frequency against the obstacle, rad/s."""
        return sqrt((self.rig.k1 + self.contact_stiffness) / self.rig.mass)

    @property
    def indentation(self) -> float:
        """Deepest indentation that the largest release can reach, m: energy without damping."""
        return depth(self.rig.k1, self.contact_stiffness, self.rig.g, self.amplitude)


def depth(k1: float, k2: float, gap: float, amplitude: float) -> float:
    """Deepest indentation after a release from rest at -amplitude, by energy, m."""
    if k2 <= 0 or amplitude <= gap:
        return 0.0
    half, rest = k1 * gap / (k1 + k2), k1 * (amplitude**2 - gap**2) / (k1 + k2)
    return sqrt(half**2 + rest) - half


def log_uniform(rng: np.random.Generator, limits: Range) -> float:
    """One number, logarithmically uniform between two positive limits."""
    return exp(rng.uniform(log(limits[0]), log(limits[1])))


def draw_rig_design(
    name: str,
    noise_kind: str,
    rng: np.random.Generator,
    designs: Mapping[str, RigDesign] = RIG_DESIGNS,
) -> DrawnRig:
    """Draw a rig of the kind `name` of `designs` with noise of the kind `noise_kind`."""
    ranges = designs[name]
    amplitude = log_uniform(rng, ranges.amplitude)
    rig = ranges.fixed or _rig(ranges, amplitude, rng)
    releases = _releases(ranges, rig, amplitude, rng)
    frequency = sqrt(rig.k1 / rig.mass) / (2 * pi)
    duration = round(log_uniform(rng, ranges.cycles) / frequency * ranges.rate) / ranges.rate
    chain, measurement = _chain(ranges, noise_kind, rig, releases, amplitude, rng)
    return DrawnRig(name, noise_kind, rig, releases, ranges.rate, duration, chain, measurement)


def _rig(ranges: RigDesign, amplitude: float, rng: np.random.Generator) -> Rig:
    mass = log_uniform(rng, ranges.mass)
    k1 = mass * (2 * pi * log_uniform(rng, ranges.frequency)) ** 2
    c1 = 2 * log_uniform(rng, ranges.damping) * sqrt(k1 * mass)
    if ranges.cases == 0:
        return Rig(mass, c1, k1)
    k2 = {str(i + 1): k1 * log_uniform(rng, ranges.stiffening) for i in range(ranges.cases)}
    mean = sum(k2.values()) / len(k2)
    c2 = 2 * log_uniform(rng, ranges.contact_damping) * sqrt(mean * mass)
    return Rig(mass, c1, k1, c2, amplitude * log_uniform(rng, ranges.gap), MappingProxyType(k2))


def _releases(
    ranges: RigDesign, rig: Rig, amplitude: float, rng: np.random.Generator
) -> tuple[Release, ...]:
    """Releases by hand from the far side, the highest first, from almost rest."""
    speed = amplitude * sqrt(rig.k1 / rig.mass)
    found = []
    for case in rig.k2 or {"": 0.0}:
        heights = np.linspace(1.0, 0.6, ranges.releases) if ranges.releases > 1 else np.ones(1)
        for i, share in enumerate(heights):
            found.append(
                Release(
                    name=f"case{case}_{i + 1}" if case else f"decay_{i + 1}",
                    case=case,
                    y0=float(-amplitude * share * (1 + 0.02 * rng.standard_normal())),
                    v0=float(4e-3 * speed * rng.standard_normal()),
                )
            )
    return tuple(found)


def _chain(
    ranges: RigDesign,
    kind: str,
    rig: Rig,
    releases: tuple[Release, ...],
    amplitude: float,
    rng: np.random.Generator,
) -> tuple[MeasuringChain, Measurement]:
    noise = amplitude * log_uniform(rng, ranges.noise)
    offsets = {r.name: float(2 * noise * rng.standard_normal()) for r in releases}
    correlation = float(rng.uniform(0.2, 0.8))
    rounding = noise * log_uniform(rng, (0.02, 0.4))
    if kind == "slow":
        period = 2 * pi * sqrt(rig.mass / rig.k1)
        correlation = exp(-1 / (log_uniform(rng, SLOW) * period * ranges.rate))
        white = float(rng.uniform(0.2, 0.8))
        return MeasuringChain(noise, correlation, offsets, None, rounding, white), Measurement()
    if kind != "smoothed":
        correlation = correlation if kind == "ar1" else 0.0
        return MeasuringChain(noise, correlation, offsets, None, rounding), Measurement()
    stiffest = rig.k1 + max(rig.k2.values(), default=0.0)
    contact = pi / sqrt(stiffest / rig.mass) * ranges.rate  # samples in half a period of contact
    window = 2 * int(min(10.0, max(2.0, 0.35 * contact))) + 1
    smoothing = Smoothing("savgol", window, 2, declared_window=window)
    chain = MeasuringChain(noise, 0.0, offsets, smoothing, 0.1 * rounding)
    return chain, Measurement(smoothing=smoothing)
