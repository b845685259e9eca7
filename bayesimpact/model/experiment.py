"""A simulated experiment: the motion of the base oscillator, or a recording with added effects."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, overload

import numpy as np

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.recording import Recording
from bayesimpact.errors import InputError, SimulationError
from bayesimpact.model.effects import EFFECTS, Effect
from bayesimpact.model.exact import normalized
from bayesimpact.model.exact.simulate import CODES, Trajectory
from bayesimpact.model.exact.simulate import simulate as base
from bayesimpact.model.oscillator import Oscillator, build_oscillator
from bayesimpact.model.parameters import bare_name, is_added

Values = Mapping[str, float]
Added = Mapping[str, Values] | Iterable[tuple[Effect, Values]]
_SHARED = ("c1", "k1", "c2", "g")


@overload
def simulate(*, effects: None = None, **oscillator: Any) -> Trajectory: ...


@overload
def simulate(
    *, effects: Added, name: str = ..., case: str = ..., **oscillator: Any
) -> Recording: ...


def simulate(
    *,
    effects: Added | None = None,
    name: str = "simulated",
    case: str = "1",
    **oscillator: Any,
) -> Trajectory | Recording:
    """Simulate one recording: exactly without `effects`, to about 1e-9 m with them.

    Parameters
    ----------
    effects : what is added to the base oscillator: ids of the catalogue and the values of their
        parameters, SI units, as {"coulomb_friction": {"force": 1e-4}}; or pairs of an effect of
        one's own and values
    name, case : of the recording that is returned when there are effects
    oscillator : mass, c1, k1, c2, g, k2, y0, v0, interval, n (and A, w, phase without effects): as
        `bayesimpact.model.exact.simulate.simulate`; with effects also `offset`, the probe's rest
        reading, m

    Returns
    -------
    Without effects the motion, a `Trajectory`. With effects (an empty mapping will do) what the
    probe reads, without noise: a `Recording`, which `Campaign.from_arrays` takes and `plot` draws.

    Raises
    ------
    InputError : an unknown effect or parameter, one without a value, or one not accepted
    SimulationError : the motion overflows or has too many impacts
    """
    if effects is None:
        return base(**oscillator)
    given = dict(oscillator)
    n, interval, mass = given.pop("n", None), given.pop("interval", None), given.pop("mass", None)
    if isinstance(n, bool) or not isinstance(n, int | np.integer) or n < 2:
        raise InputError("simulate, n", repr(n), "a whole number of samples, 2 or more")
    pairs = effects.items() if isinstance(effects, Mapping) else effects
    chosen = [(_effect(effect), own) for effect, own in pairs]
    added = tuple(effect for effect, _ in chosen)
    values = _values(given, chosen)
    stop = values.get("k2", 0.0) > 0.0 or values.get("c2", 0.0) > 0.0
    blank = Recording(name, case if stop else "", np.zeros(n), _number("interval", interval))
    _check(values, added, _number("mass", mass), blank)
    campaign = Campaign("simulated", float(mass or 0.0), (blank,), stop=stop)
    oscillator_ = build_oscillator(campaign, added)
    theta = _theta(oscillator_, values)
    (readings,) = oscillator_.predict(theta)
    if not np.all(np.isfinite(readings)):
        raise SimulationError("the motion overflows, has too many impacts, or a value is refused")
    return Recording(name, blank.case, readings, blank.interval)


def _effect(effect: str | Effect) -> Effect:
    if isinstance(effect, Effect):
        return effect
    for known in EFFECTS:
        if known.id == effect:
            return known
    raise InputError("simulate, effects", repr(effect), ", ".join(e.id for e in EFFECTS))


def _values(given: dict[str, Any], effects: list[tuple[Effect, Values]]) -> dict[str, float]:
    """Values of all parameters by their names without a case or a recording, checked."""
    known = (*_SHARED, "k2", "y0", "v0", "offset")
    values = {"g": np.inf, "c2": 0.0, "k2": 0.0, "offset": 0.0}
    for name, value in given.items():
        if name in ("A", "w", "phase"):
            found = "a force beside effects"
            raise InputError(f"simulate, {name}", found, "the effect harmonic_forcing")
        if name not in known:
            accepted = ", ".join(("mass", *known, "interval", "n", "effects", "name", "case"))
            raise InputError(f"simulate, {name}", "an unknown argument", accepted)
        values[name] = _number(name, value)
    for effect, own in effects:
        wanted = [p for p in effect.parameters if p.fixed is None]
        names = [p.name for p in wanted]
        if sorted(own) != sorted(names):
            found = "values of " + (", ".join(map(str, own)) or "nothing")
            raise InputError(
                f"simulate, effect {effect.id}", found, ", ".join(names) or "no values"
            )
        for parameter in wanted:
            full = f"{effect.id}.{parameter.name}"
            value = values[full] = _number(full, own[parameter.name])
            if not parameter.lower <= value <= parameter.upper:
                accepted = f"{parameter.lower:g} to {parameter.upper:g} {parameter.unit}"
                raise InputError(f"simulate, {full}", f"{value:g}", accepted)
    return values


def _check(
    values: dict[str, float], effects: tuple[Effect, ...], mass: float, blank: Recording
) -> None:
    """The base simulator's own conditions; what an effect stands for counts as its value."""
    for effect in effects:
        for parameter in effect.parameters:
            if parameter.replaces is not None:
                values[parameter.replaces] = values[f"{effect.id}.{parameter.name}"]
        for slot in effect.sets:
            if values.get(slot):
                found = f"{values[slot]:g} beside {effect.id}, which takes its place"
                raise InputError(f"simulate, {slot}", found, "none")
    missing = [name for name in ("c1", "k1", "y0", "v0") if name not in values]
    if missing:
        raise InputError(f"simulate, {missing[0]}", "nothing", "a number")
    names = ("c1", "k1", "c2", "g", "k2", "y0", "v0")
    q = np.array([*(values[name] for name in names), 0.0, 0.0, 0.0, values["offset"]])
    code = int(normalized.check(q, mass, blank.interval, blank.samples.size))
    if code != normalized.OK:
        raise InputError("simulate", CODES[code], "see the docstring of `simulate`")


def _theta(oscillator: Oscillator, values: dict[str, float]) -> np.ndarray[Any, Any]:
    """Parameter vector (d,) of the one recording."""
    theta = np.zeros(oscillator.layout.size)
    for i, name in enumerate(oscillator.layout.names):
        if name.startswith("sigma"):
            continue
        key = name.split("[")[0] if is_added(name) else bare_name(name)
        theta[i] = values[key]
    return theta


def _number(name: str, value: object) -> float:
    if isinstance(value, bool | str | complex) or not np.isscalar(value):
        found = "nothing" if value is None else repr(value)
        raise InputError(f"simulate, {name}", found, "a number")
    return float(value)  # type: ignore[arg-type]
