"""Names, units and bounds of all unknowns, and where each enters each recording's simulation.

The unknowns of a campaign form one vector theta. A recording is simulated from a short vector q of
*slots* (`SLOTS`, then the parameters of the force laws). `columns[r, i]` says which element of
theta feeds slot i of recording r; -1 takes `constants[r, i]`. A damping per obstacle or a gap per
recording is nothing but another column.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import SECOND_STOP, Campaign
from bayesimpact.data.channels import keepers
from bayesimpact.data.quantity import reading_unit
from bayesimpact.data.recording import Recording
from bayesimpact.data.short_repr import short_repr
from bayesimpact.errors import InputError
from bayesimpact.model.effects.effect import Effect, EffectParameter, catalogued
from bayesimpact.model.exact.normalized import Q
from bayesimpact.model.second_stop import DECLARED

BASE_SLOTS = Q
ADDED_SLOTS = (
    "friction", "contact_mass", "no_tension", "gap_step",
    "second_frequency", "second_damping", "second_gain",
    "obstacle_mass", "obstacle_frequency", "obstacle_damping",
    "frame_ratio", "frame_frequency", "frame_damping", "adhesion", "restitution",
)  # fmt: skip
SLOTS = BASE_SLOTS + ADDED_SLOTS
_OFFSET = SLOTS.index("offset")
WITHOUT = {"restitution": 1.0}
"""Values of added slots that nothing feeds, where that is not 0."""

INPUT_GAIN = "input_gain"
GAIN = "gain"
HIGH_PASS_STATE = "high_pass_state"

Role = Literal["physical", "effect", "nuisance", "noise"]
_SHARED_UNITS = {"c1": "N s/m", "k1": "N/m", "c2": "N s/m", "g": "m"}
_NUISANCE_UNITS = {"y0": "m", "v0": "m/s", "offset": "m"}


@dataclass(frozen=True)
class Parameter:
    """One element of theta: its name as in the contract, SI unit, role and physical bounds."""

    name: str
    unit: str
    role: Role
    lower: float = -np.inf
    upper: float = np.inf


@dataclass(frozen=True, eq=False)
class Layout:
    """All unknowns of a campaign under a model, and the map from theta to every recording's slots.

    Attributes
    ----------
    parameters : the elements of theta in order: physical, effects, nuisances, noise
    columns : (R, Q) index into theta, or -1
    constants : (R, Q) values where `columns` is -1
    """

    parameters: tuple[Parameter, ...]
    columns: NDArray[np.int64]
    constants: NDArray[np.float64]

    __repr__ = short_repr

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the elements of theta."""
        return tuple(p.name for p in self.parameters)

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return len(self.parameters)

    def index(self, name: str) -> int:
        """Position of a parameter; KeyError when the model has none of that name."""
        try:
            return self.names.index(name)
        except ValueError:
            raise KeyError(name) from None

    def roles(self, *roles: Role) -> NDArray[np.int64]:
        """Positions of all parameters with one of the given roles."""
        return np.array(
            [i for i, p in enumerate(self.parameters) if p.role in roles], dtype=np.int64
        )

    def slots(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """Slot vectors (..., R, Q) of parameter vectors (..., d)."""
        values: NDArray[np.float64] = theta[..., np.maximum(self.columns, 0)]
        return np.where(self.columns >= 0, values, self.constants)

    def slots_of(self, r: int, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """Slot vectors (..., Q) of recording `r`, contiguous."""
        own = self.columns[r]
        values = np.where(own >= 0, theta[..., np.maximum(own, 0)], self.constants[r])
        return np.ascontiguousarray(values)

    def offsets(self, r: int, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """Rest offset (...) of recording `r`."""
        own, constant = self.columns[r, _OFFSET], self.constants[r, _OFFSET]
        return theta[..., own] if own >= 0 else np.full(theta.shape[:-1], constant)


def declared_effects(campaign: Campaign) -> tuple[Effect, ...]:
    """Effects of a campaign's base model; `InputError` for an id not in the catalogue."""
    found = []
    for id in campaign.declared:
        effect = DECLARED if id == SECOND_STOP else catalogued(id)
        if effect is None:
            raise InputError(f"campaign {campaign.name!r}, declared", id, "an id of the catalogue")
        found.append(effect)
    return tuple(found)


def build_layout(
    campaign: Campaign, effects: Sequence[Effect] = (), *, sigma_per_recording: bool = False
) -> Layout:
    """Unknowns of `campaign` under the base model, with what it declares, and `effects` added.

    Raises `InputError` when two effects claim the same slot or an effect needs an obstacle and
    there is none.
    """
    effects = (*declared_effects(campaign), *effects)
    binds = _binds(campaign, effects)
    table: list[Parameter] = []
    position: dict[str, int] = {}

    def add(name: str, unit: str, role: Role, lower: float = -np.inf, upper: float = np.inf) -> int:
        if name not in position:
            position[name] = len(table)
            unit = angular(unit) if campaign.angular else unit
            table.append(Parameter(name, unit, role, lower, upper))
        return position[name]

    _add_physical(campaign, {*binds, *(s for e in effects for s in e.sets)}, add)
    for effect in effects:
        for parameter in effect.parameters:
            if parameter.fixed is not None:
                continue
            unit = _read(campaign, effect, parameter.unit)
            for name in _instances(campaign, effect, parameter):
                add(name, unit, "effect", parameter.lower, parameter.upper)
    for recording, keeper in zip(campaign.recordings, keepers(campaign.recordings), strict=True):
        for nuisance, unit in _NUISANCE_UNITS.items():
            unit = reading_unit(unit, recording.order) if nuisance == "offset" else unit
            add(_nuisances(recording, keeper)[nuisance], unit, "nuisance")
        if recording.free_gain:
            add(f"{GAIN}[{recording.name}]", "-", "nuisance", 0.0)
        if recording.high_pass:
            unit = reading_unit("m", recording.order)
            add(f"{HIGH_PASS_STATE}[{recording.name}]", unit, "nuisance")
    orders = [r.order for r in campaign.recordings]
    for name, order in zip(sigma_names(campaign, sigma_per_recording), orders, strict=False):
        add(name, reading_unit("m", order), "noise", 0.0)
    columns, constants = _maps(campaign, effects, binds, position)
    return Layout(tuple(table), columns, constants)


def sigma_names(campaign: Campaign, per_recording: bool) -> tuple[str, ...]:
    """Names of the noise levels: one for the campaign or one per recording."""
    return tuple(f"sigma[{r.name}]" for r in campaign.recordings) if per_recording else ("sigma",)


def angular(unit: str) -> str:
    """Unit of the same quantity for an angle: m becomes rad, N becomes N m, kg becomes kg m2."""
    unit = re.sub(r"\bm(?=\d|\b)", "rad", unit)
    return re.sub(r"\bN\b", "N m", re.sub(r"\bkg\b", "kg m2", unit))


def instance_name(effect: Effect, parameter: EffectParameter, key: str | None) -> str:
    """Name in theta of an effect's parameter; `key` is the case or recording it belongs to."""
    return f"{effect.id}.{parameter.name}" + ("" if key is None else f"[{key}]")


def is_added(name: str) -> bool:
    """True for `<effect>.<parameter>[...]`; cases and recordings may have dots in their names."""
    return "." in name.split("[")[0]


def bare_name(name: str) -> str:
    """The parameter alone: `c2` of `contact_damping_per_case.c2[1]`, `k2` of `k2[1]`."""
    return name.split("[")[0].split(".")[-1]


def unit_for(campaign: Campaign, effect: Effect | None, unit: str) -> str:
    """A unit for displacements as it is for a campaign's: of angles, or of what the probe reads."""
    unit = _read(campaign, effect, unit)
    return angular(unit) if campaign.angular else unit


def _read(campaign: Campaign, effect: Effect | None, unit: str) -> str:
    """Effects of the probe act on the reading, whatever that is."""
    if effect is None or effect.observe is None:
        return unit
    return reading_unit(unit, campaign.recordings[0].order)


def _keys(campaign: Campaign, parameter: EffectParameter) -> tuple[str | None, ...]:
    if parameter.scope == "case":
        return campaign.cases
    if parameter.scope == "recording":
        return tuple(r.name for r in campaign.recordings)
    return (None,)


def _instances(campaign: Campaign, effect: Effect, parameter: EffectParameter) -> tuple[str, ...]:
    return tuple(instance_name(effect, parameter, key) for key in _keys(campaign, parameter))


def _binds(
    campaign: Campaign, effects: Sequence[Effect]
) -> dict[str, tuple[Effect, EffectParameter]]:
    binds: dict[str, tuple[Effect, EffectParameter]] = {}
    for i, effect in enumerate(effects):
        if effect.needs_stop and not campaign.stop:
            raise InputError(f"effect {effect.id}", "a campaign without a stop", "stop = true")
        for other in effects[:i]:
            taken = effect.excludes(other)
            if taken:
                found = f"slot {min(taken)} taken by {other.id}"
                raise InputError(f"effect {effect.id}", found, "one effect a slot")
        for slot in (*effect.binds, *effect.sets):
            if slot not in SLOTS:
                raise InputError(f"effect {effect.id}", f"slot {slot!r}", ", ".join(SLOTS))
        for slot, name in effect.binds.items():
            binds[slot] = (effect, effect.parameter(name))
    return binds


def _add_physical(campaign: Campaign, claimed: set[str], add: object) -> None:
    assert callable(add)
    shared = ("c1", "k1", "c2", "g") if campaign.stop else ("c1", "k1")
    for name in shared:
        if name not in claimed:
            lower = -np.inf if name == "g" else 0.0
            add(name, _SHARED_UNITS[name], "physical", lower)
    for case in campaign.cases:
        add(f"k2[{case}]", "N/m", "physical", 0.0)
    if any(r.input is not None and r.input.free for r in campaign.recordings):
        add(INPUT_GAIN, "-", "physical")


def _maps(
    campaign: Campaign,
    effects: Sequence[Effect],
    binds: dict[str, tuple[Effect, EffectParameter]],
    position: dict[str, int],
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    law_parameters = [(e, p) for e in effects if e.law is not None for p in e.parameters]
    shape = (len(campaign.recordings), len(SLOTS) + len(law_parameters))
    columns = np.full(shape, -1, dtype=np.int64)
    constants = np.zeros(shape)
    for slot, value in WITHOUT.items():
        constants[:, SLOTS.index(slot)] = value
    if not campaign.stop:
        constants[:, SLOTS.index("g")] = np.inf
    for effect in effects:
        for slot, value in effect.sets.items():
            constants[:, SLOTS.index(slot)] = value
    states = keepers(campaign.recordings)
    for r, recording in enumerate(campaign.recordings):
        constants[r, SLOTS.index("A")] = 0.0 if recording.input is None else 1.0
        plain = {"k2": f"k2[{recording.case}]", **_nuisances(recording, states[r])}
        if recording.input is not None and recording.input.free:
            plain["A"] = INPUT_GAIN
        for i, slot in enumerate(SLOTS):
            name = plain.get(slot, slot)
            if slot in binds:
                name = _own(binds[slot], recording.case, recording.name)
            columns[r, i] = position.get(name, -1)
        for j, owner in enumerate(law_parameters, start=len(SLOTS)):
            if owner[1].fixed is None:
                columns[r, j] = position[_own(owner, recording.case, recording.name)]
            else:
                constants[r, j] = owner[1].fixed
    return columns, constants


def _nuisances(recording: Recording, keeper: str) -> dict[str, str]:
    """Slot -> name; channels of one motion share the state that `keeper` begins with."""
    return {n: f"{n}[{recording.name if n == 'offset' else keeper}]" for n in _NUISANCE_UNITS}


def _own(owner: tuple[Effect, EffectParameter], case: str, recording: str) -> str:
    effect, parameter = owner
    key = {"campaign": None, "case": case, "recording": recording}[parameter.scope]
    return instance_name(effect, parameter, key)
