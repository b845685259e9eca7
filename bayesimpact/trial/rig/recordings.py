"""The independent rig: recordings of an impact oscillator, with any effects planted in it.

m y'' + c1 y' + k1 y + [c2 y' + k2 d] H(d) + what the effects add = 0,   d = y - g, v = y'
(Tian et al., Eq. 6, and the catalogue). It shares no code and no method with the simulators of
`bayesimpact.model`: what both agree on has been worked out twice.

Conventions
-----------
Time counts from a recording's first sample; y0 and v0 are the state there. Contact begins when the
mass comes up through g; a recording that starts beyond g starts in contact. It ends when the mass
goes back through g, and for contact_no_tension and obstacle_mass as `rig.motion` says. The gap of
the i-th contact (from 0) is g + i step under gap_wear; it grows when the contact ends. Under
obstacle_mass the mass touches with v+ = m v/(m + m2) and finds the obstacle at rest at g every
time. Dry friction holds at v = 0 while the other forces sum up to no more than its level there.
harmonic_forcing is A sin(2 pi f t + phase) on the right-hand side. The chain:
`rig.measuring_chain`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import inf, isfinite
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import Beam, Campaign, Measurement
from bayesimpact.data.quantity import Quantity, order_of
from bayesimpact.data.recording import Recording
from bayesimpact.errors import InputError
from bayesimpact.trial.rig.catalogue import CATALOGUE, Planted
from bayesimpact.trial.rig.measuring_chain import MeasuringChain, Probe, measure
from bayesimpact.trial.rig.motion import RigMotion, move, sampling
from bayesimpact.trial.rig.outside import OUTSIDE
from bayesimpact.trial.rig.parts import RigPart, Site
from bayesimpact.trial.rig.strong import STRONG

Parameters = Mapping[str, float | Mapping[str, float]]
"""Parameter -> number (SI, frequencies in Hz); recording or case -> number where they differ."""

Effects = Mapping[str, Parameters]
"""Effect id (catalogue or outside it) -> its parameters."""


@dataclass(frozen=True)
class Rig:
    """The oscillator and its obstacles, SI.

    Attributes
    ----------
    mass, c1, k1 : kg, N s/m, N/m
    c2, g : N s/m, m
    k2 : case -> N/m; empty for a rig without an obstacle
    """

    mass: float
    c1: float
    k1: float
    c2: float = 0.0
    g: float = inf
    k2: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))

    def __post_init__(self) -> None:
        for name in ("mass", "k1"):
            value = getattr(self, name)
            if not 0 < value < inf:
                raise InputError(f"rig, {name}", repr(value), "a number above 0")
        if self.k2 and not isfinite(self.g):
            raise InputError("rig, g", repr(self.g), "a finite gap in m when there is an obstacle")


@dataclass(frozen=True)
class Release:
    """How one recording starts.

    Attributes
    ----------
    name : of the recording
    case : the obstacle mounted; "" on a rig without one
    y0, v0 : displacement and velocity at the first sample, m and m/s
    """

    name: str
    case: str
    y0: float
    v0: float = 0.0


def motion(
    rig: Rig,
    release: Release,
    effects: Effects | None = None,
    *,
    rate: float,
    duration: float,
    rtol: float = 1e-12,
    atol: float = 1e-14,
) -> RigMotion:
    """The true motion of one recording, before the measuring chain.

    Parameters
    ----------
    rate : sampling rate, Hz
    duration : s; round(rate * duration) samples, the first at 0
    rtol, atol : of DOP853

    Raises
    ------
    InputError : an unknown effect or parameter, a case without an obstacle
    SimulationError : the integration failed
    """
    site, parts = _build(rig, release, effects or {})
    return move(site, parts, sampling(rate, duration), rtol=rtol, atol=atol)


def record(
    rig: Rig,
    release: Release,
    effects: Effects | None = None,
    chain: MeasuringChain | None = None,
    *,
    rate: float,
    duration: float,
    rng: np.random.Generator,
    rtol: float = 1e-12,
    atol: float = 1e-14,
    rest: float = 0.0,
    quantity: Quantity = "displacement",
) -> NDArray[np.float64]:
    """One recording, (round(rate * duration),), in SI; draws as many normal numbers from `rng`.

    `rtol`, `atol` as for `motion`. With `rest` the recording begins so many seconds before the
    release, in which the mass is held at y0; forces count their time from the release, the chain
    from the first sample. The probe, its noise and its rest reading are those of `quantity`;
    velocities and accelerations are the mass's own, without further modes.

    Raises
    ------
    InputError, SimulationError : as `motion`
    """
    effects, chain = effects or {}, chain or MeasuringChain()
    truth = motion(rig, release, effects, rate=rate, duration=duration, rtol=rtol, atol=atol)
    probe = Probe()
    for effect, given in effects.items():
        planted = _planted(effect)
        numbers = _numbers(effect, planted, given, release)
        if planted.probe is not None:
            probe = planted.probe(probe, numbers)
        if planted.chain is not None:
            if effect == "smoothing" and chain.smoothing is not None:
                raise InputError("effects, smoothing", "a chain that smooths", "only one of both")
            chain = planted.chain(chain, numbers)
    order = order_of(quantity)
    true = (truth.displacement, truth.velocity, truth.acceleration)[order]
    held = np.full(round(rest * rate), release.y0 if order == 0 else 0.0)
    reading = np.concatenate([held, true])
    times = sampling(rate, reading.size / rate)
    return measure(reading, times, probe, chain, release.name, rng)


def make_campaign(
    name: str,
    rig: Rig,
    releases: Sequence[Release],
    effects: Effects | None = None,
    chain: MeasuringChain | None = None,
    *,
    rate: float,
    duration: float,
    rng: np.random.Generator,
    measurement: Measurement | None = None,
    beams: Mapping[str, Beam] | None = None,
    quantity: Quantity = "displacement",
) -> Campaign:
    """Record a whole campaign, in the order of `releases`; the same `rng` state, the same bits.

    Parameters
    ----------
    measurement : what the campaign admits to know of its chain; nothing by default
    beams : case -> geometry of the obstacle, for the report
    quantity : what is recorded; everything of an angle is per radian
    """
    recordings = tuple(
        Recording(
            name=release.name,
            case=release.case,
            samples=record(
                rig,
                release,
                effects,
                chain,
                rate=rate,
                duration=duration,
                rng=rng,
                quantity=quantity,
            ),
            interval=1 / rate,
            quantity=quantity,
        )
        for release in releases
    )
    return Campaign(
        name=name,
        mass=rig.mass,
        recordings=recordings,
        stop=bool(rig.k2),
        measurement=measurement or Measurement(),
        beams=MappingProxyType(dict(beams or {})),
    )


def _planted(effect: str) -> Planted:
    planted = CATALOGUE.get(effect) or OUTSIDE.get(effect) or STRONG.get(effect)
    if planted is None:
        raise InputError("effects", effect, ", ".join([*CATALOGUE, *OUTSIDE, *STRONG]))
    return planted


def _numbers(
    effect: str, planted: Planted, given: Parameters, release: Release
) -> dict[str, float]:
    """The effect's numbers for one recording."""
    required = set(planted.names) - set(planted.optional)
    if not required <= set(given) <= set(planted.names):
        found = ", ".join(given) or "no parameters"
        raise InputError(effect, found, ", ".join(planted.names) or "no parameters")
    numbers = {}
    for name, value in given.items():
        if isinstance(value, Mapping):
            key = release.case if name in planted.per_case else release.name
            split = name in planted.per_case + planted.per_recording
            if not split or key not in value:
                raise InputError(f"{effect}.{name}", ", ".join(value), f"a value for {key}")
            value = value[key]
        if not isfinite(value):
            raise InputError(f"{effect}.{name}", repr(value), "a finite number")
        numbers[name] = float(value)
    return numbers


def _build(rig: Rig, release: Release, effects: Effects) -> tuple[Site, tuple[RigPart, ...]]:
    """The rig of one recording: its site first, then the parts, which may depend on it."""
    if rig.k2 and release.case not in rig.k2:
        raise InputError(f"{release.name}, case", release.case, ", ".join(rig.k2))
    with_obstacle = bool(rig.k2)
    site = Site(
        mass=rig.mass,
        c1=rig.c1,
        k1=rig.k1,
        c2=rig.c2 if with_obstacle else 0.0,
        gap=rig.g if with_obstacle else inf,
        k2=rig.k2[release.case] if with_obstacle else 0.0,
        name=release.name,
        case=release.case,
        y0=release.y0,
        v0=release.v0,
    )
    chosen = []
    for effect, given in effects.items():
        planted = _planted(effect)
        if planted.obstacle and not with_obstacle:
            raise InputError("effects", effect, "effects of a rig without an obstacle")
        numbers = _numbers(effect, planted, given, release)
        chosen.append((planted, numbers))
        if planted.site is not None:
            site = planted.site(site, numbers)
    parts: list[RigPart] = []
    slot = 2
    for planted, numbers in chosen:
        if planted.part is not None:
            part = planted.part(site, numbers, slot)
            slot += len(part.states)
            parts.append(part)
    return site, tuple(parts)
