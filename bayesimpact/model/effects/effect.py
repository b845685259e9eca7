"""What an added effect is: parameters, a force law or a change of the oscillator, and words."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.frozen import Picklable

Scope = Literal["campaign", "case", "recording"]
Where = Literal["everywhere", "contact"]
Regime = Literal["free", "contact", "entry", "exit", "everywhere", "measurement"]
Energy = Literal["conserves", "dissipates", "either", "none"]


@dataclass(frozen=True)
class Scales:
    """Physical sizes of one campaign, against which the priors of effects are written; SI.

    Attributes
    ----------
    mass, stiffness, damping : m, k1, c1 of the fitted base model
    contact_stiffness, contact_damping : mean k2 and c2 (0 without a stop)
    amplitude, speed : largest |y| and |v|
    indentation, impact_speed : largest d and entry speed (0 without impacts)
    duration, interval : longest recording and its sampling interval, s
    impacts : largest number of impacts in a recording
    gap : g (0 without a stop)
    cases, recordings : how many there are
    angle : the recordings are of an angle, rad
    reading : largest reading from rest in its own unit; 0 for that of displacements, `amplitude`
    mixed : the recordings are of several quantities
    driven : a recording has a measured input
    """

    mass: float
    stiffness: float
    damping: float
    contact_stiffness: float
    contact_damping: float
    amplitude: float
    speed: float
    indentation: float
    impact_speed: float
    duration: float
    interval: float
    impacts: int
    gap: float = 0.0
    cases: int = 1
    recordings: int = 1
    angle: bool = False
    reading: float = 0.0
    mixed: bool = False
    driven: bool = False

    @property
    def largest_reading(self) -> float:
        """The largest reading from rest, in its own unit; the amplitude of displacements."""
        return self.reading or self.amplitude

    @property
    def force(self) -> float:
        """Largest elastic force of the suspension, N."""
        return self.stiffness * self.amplitude

    @property
    def contact_force(self) -> float:
        """Largest elastic force of the obstacle, N."""
        return self.contact_stiffness * self.indentation

    @property
    def damping_force(self) -> float:
        """Largest damping force, N; at least what a damping ratio of 0.05 % gives."""
        return (self.damping + 1e-3 * math.sqrt(self.stiffness * self.mass)) * self.speed

    @property
    def natural_frequency(self) -> float:
        """Natural frequency of free flight, Hz."""
        return math.sqrt(self.stiffness / self.mass) / (2 * math.pi)

    @property
    def contact_rate(self) -> float:
        """Natural frequency against the obstacle alone, rad/s."""
        return math.sqrt(self.contact_stiffness / self.mass)


@dataclass(frozen=True)
class EffectParameter:
    """One unknown of an effect.

    Attributes
    ----------
    name, unit : unit for displacements; `bayesimpact.model.parameters.unit_for` translates
    scale : size that would be plausible, from the campaign's scales: the prior is half-Cauchy
        (Cauchy when both signs are admissible) about `null` with this scale; for a shape parameter
        the prior is log-normal about it, or log-uniform between two positive bounds or `within`
    lower, upper : physical bounds
    null : value at which the effect vanishes; None for a shape parameter (a depth, a time constant,
        a frequency), which means nothing while the amplitude is at its null
    scope : one value for the campaign, per case or per recording
    grid : for a shape parameter, the values that a scan tries, from the scales
    within : for a shape parameter, the range outside which the law goes by another name, from the
        scales: the prior is log-uniform in it
    in_base : for a shape parameter, the value at which the law is a force that the base model has,
        of whatever size: there it is nothing that is missing
    until : for a shape parameter, the value from which on the law is not what it is called: a mode
        that is damped critically does not ring
    circular : a phase, rad
    fixed : a constant of the law, not an unknown
    spectral : a frequency, Hz; a scan should try the peaks of the residual's periodogram as well
    replaces : base parameter (c2, g) in whose place this one stands: the effect vanishes when all
        its instances equal that parameter; `null` is then None, the prior normal about `centre`
    centre : centre of that prior, from the scales
    initial : a state at a recording's first sample, the law's or the probe's, which an effect has
        as a recording has its y0 and v0. The null is what it is without one, and the prior normal
        about it with a spread that all recordings share. At the effect's null a law's state moves
        nothing, and no score looks for it
    """

    name: str
    unit: str
    scale: Callable[[Scales], float]
    lower: float = -np.inf
    upper: float = np.inf
    null: float | None = 0.0
    scope: Scope = "campaign"
    grid: Callable[[Scales], NDArray[np.float64]] | None = None
    within: Callable[[Scales], tuple[float, float]] | None = None
    in_base: float | None = None
    until: float | None = None
    circular: bool = False
    fixed: float | None = None
    spectral: bool = False
    replaces: Literal["c2", "g"] | None = None
    centre: Callable[[Scales], float] | None = None
    initial: bool = False

    @property
    def is_size(self) -> bool:
        """True when the effect vanishes with it: no shape, initial state or fixed number."""
        return self.fixed is None and not (self.is_shape or self.initial)

    @property
    def is_shape(self) -> bool:
        """True when the parameter means nothing while the effect is at its null."""
        return self.null is None and self.replaces is None and self.fixed is None


def phase() -> EffectParameter:
    """The phase of something periodic, one of every recording."""
    return EffectParameter(
        "phase",
        "rad",
        scale=lambda s: math.pi,
        null=None,
        scope="recording",
        circular=True,
        grid=lambda s: np.array([0.0, 0.5, 1.0, 1.5]) * math.pi,
    )


def damping_ratio(scale: float) -> EffectParameter:
    """The damping ratio of a mode, about `scale`."""
    return EffectParameter(
        "damping",
        "-",
        scale=lambda s: scale,
        lower=0.0,
        null=None,
        grid=lambda s: np.array([0.01, 0.05]),
        until=1.0,
    )


@dataclass(frozen=True)
class Law:
    """A force on the left-hand side of the equation of motion, as plain functions of floats.

    Each function has the arguments `(y, v, d, t, z, touching, p, q)`: displacement m, velocity m/s,
    indentation y - g m, time from the recording's first sample s, the law's own state, 1.0 in
    contact and 0.0 in flight, pointers to the law's parameters (in the effect's order) and to the
    oscillator's slots (`bayesimpact.model.parameters.SLOTS`). They are compiled one by one to C
    callbacks, so they may call `math` functions and `bayesimpact.model.power.power`, but no
    compiled ones of a user's own.

    Attributes
    ----------
    force : N
    where : evaluated everywhere or in contact only
    rate : time derivative of the state z (a law with memory), or None
    travel : for a state that follows the path and not the time (rate-independent hysteresis): its
        value where the motion has gone by `y` (m, signed) since it last turned, in the direction
        `v` (-1, 1; 0 before it first moves), from `z`, the state where it turned; steps end on
        turning points
    surface : a smooth function of y or d whose zero is a kink of the force; steps end on it. (A
        force may jump at impact, being evaluated in contact only, and where a flag below says
        so; other jumps cost accuracy.)
    time_rate : fastest rate at which the force depends on time explicitly, rad/s; steps resolve it
    kink_at_turn : the force has a kink at v = 0; steps end on turning points
    rough_at_touch : the force is continuous but not smooth at d = 0; steps begin small there
    first_at_turn : shortest step at a turning point over the usual one, 1 or less, where the force
        is continuous but not smooth at v = 0 (a root of the speed); steps end there
    jump_at_turn : the force jumps at v = 0; steps end on turning points, and z, of which the
        law then has no use of its own, is the direction of the motion: -1, 1, or 0 at rest
    jump_at_surface : the force jumps at its surface; z is the side: the sign of `surface`. Of a
        law that jumps at v = 0 too, z is the direction where `surface` is above 0, else 0
    polynomial : between its kinks the force is a polynomial of low degree of y and v, and of sines
        of time no faster than `time_rate`: it has no features that a look at four points of a cycle
        misses, so steps may be longer where it is weak
    feature_length : length, m, below which the force does look like a polynomial (a spline's knots
        lie that far apart): a step passes about one of them
    ignores_speed : the force does not depend on v: four evaluations a step are then enough, not six
    of_time : the force depends on time explicitly

    A state is 0 at a recording's first sample, or what a parameter that is `initial` says. The
    state of a law that acts in contact only is not integrated in flight: its rate may there
    depend on the state alone, linearly (it decays, or it stays).
    """

    force: Callable[..., float]
    where: Where = "everywhere"
    rate: Callable[..., float] | None = None
    travel: Callable[..., float] | None = None
    surface: Callable[..., float] | None = None
    time_rate: Callable[..., float] | None = None
    feature_length: Callable[..., float] | None = None
    first_at_turn: Callable[..., float] | None = None
    kink_at_turn: bool = False
    rough_at_touch: bool = False
    jump_at_turn: bool = False
    jump_at_surface: bool = False
    polynomial: bool = False
    ignores_speed: bool = False
    of_time: bool = False


Numbers = Sequence[float]
Size = tuple[float, str, float]
"""How large an effect is: value, unit for displacements, share of its reference."""
Observe = Callable[
    [NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]
]


@dataclass(frozen=True)
class Effect(Picklable):
    """One physical effect that the base model leaves out.

    It acts in one or more of four ways: `law` adds a force; `binds` feeds its parameters into slots
    of the oscillator (dry friction, mass of the obstacle, a gap of its own per recording, ...);
    `sets` fixes slots (c2 or g among them: the model then has no such unknown);
    `observe(y (K, n), t (n,), p (K, n_p)) -> (K, n)` changes what the probe reads: what it adds
    to the true y is summed with what others add, so that a set of effects has no order.

    Attributes
    ----------
    id, family, title : fixed id, family of near neighbours, a few words
    equation : as text, for the catalogue and the report
    regime : where it acts
    energy : what it does to mechanical energy
    statement : sentence for the report with `{size}` and `{share}` filled in
    parameters : of several sizes the first is the one that it is called by
    replaces : term of the base model that it writes in another form; no model holds two forms
    needs_stop : True when it makes no sense without an obstacle
    prefer : id of the simpler effect that this one reduces to, at its null or with a shape of zero
    restates : id of an effect that is the same law in other numbers, for another range of them: no
        model holds both, and only the ranges `within` which they go by these names tell them apart
    condition : what else a campaign must offer (two obstacles, two impacts, ...); None for nothing
    size : how large it is for given parameters, where the peak of its force along the motion or of
        its change of the readings does not say so
    price : nats of log odds that it costs beyond what every effect does, for how long it is to
        write down
    """

    id: str
    family: str
    title: str
    equation: str
    regime: Regime
    energy: Energy
    statement: str
    parameters: tuple[EffectParameter, ...] = ()
    law: Law | None = None
    binds: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    sets: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    observe: Observe | None = None
    replaces: str | None = None
    needs_stop: bool = False
    prefer: str | None = None
    restates: str | None = None
    condition: Callable[[Scales], bool] | None = None
    size: Callable[[Numbers, Scales], Size] | None = None
    price: float = 0.0

    def __repr__(self) -> str:
        """One line."""
        return f"<Effect {self.id}: {self.title}>"

    def __reduce_ex__(self, protocol: Any) -> Any:
        """Pickle an effect of the catalogue by its id: its functions cannot be pickled."""
        if catalogued(self.id) is self:
            return catalogued, (self.id,)
        return super().__reduce_ex__(protocol)

    def admissible(self, scales: Scales) -> bool:
        """True when a campaign of these scales could show the effect at all."""
        if self.needs_stop and scales.impacts == 0:
            return False
        if self.observe is not None and scales.mixed:
            return False  # its parameters would have another unit for every quantity
        return self.condition is None or self.condition(scales)

    @property
    def has_size(self) -> bool:
        """False for an effect that is on or off: it has no parameters, or only shapes."""
        return any(p.is_size for p in self.parameters)

    def excludes(self, other: Effect) -> frozenset[str]:
        """Slots that both claim: each feeds one, or one feeds what the other fixes."""
        fixed = {s for s in self.sets if s in other.sets and self.sets[s] != other.sets[s]}
        crossed = (set(self.binds) & set(other.sets)) | (set(self.sets) & set(other.binds))
        return frozenset(fixed | crossed | (set(self.binds) & set(other.binds)))

    def stands_beside(self, other: Effect) -> bool:
        """True when one model may hold both."""
        twice = self.replaces is not None and self.replaces == other.replaces
        return not (twice or self.excludes(other) or self.is_same_law(other))

    def is_same_law(self, other: Effect) -> bool:
        """True for two effects that differ in the names and ranges of their numbers only."""
        return self.restates == other.id or other.restates == self.id

    @property
    def scored(self) -> tuple[EffectParameter, ...]:
        """Parameters by which it begins at its null: sizes, and states of the probe."""
        probe = self.observe is not None
        return tuple(p for p in self.parameters if p.is_size or (probe and p.initial))

    def parameter(self, name: str) -> EffectParameter:
        """The parameter called `name`; KeyError when there is none."""
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        raise KeyError(f"{self.id} has no parameter {name!r}")


def catalogued(id: str) -> Effect | None:
    """The catalogue's effect of that id; None when there is none."""
    name = f"{__package__}.{id}"
    if not id.isidentifier() or find_spec(name) is None:
        return None
    effect: Effect | None = getattr(import_module(name), "EFFECT", None)
    return effect


@cache
def address(function: Callable[..., float]) -> int:
    """Pointer to a law's function, compiled on first use."""
    return int(_callback(function).address)


@cache
def _callback(function: Callable[..., float]) -> Any:
    from numba import types

    from bayesimpact.model.jit.compiled import compiled_callback

    number, pointer = types.float64, types.CPointer(types.float64)  # type: ignore[no-untyped-call]
    return compiled_callback(number(*[number] * 6, pointer, pointer))(function)
