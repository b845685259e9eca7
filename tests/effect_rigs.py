"""Rigs on which the effects are tested, and the way from named numbers to a simulated motion."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from naive_general import Naive

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.refits.extend import campaign_scales, extend, transfer
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import Identification
from bayesimpact.model.effects import EFFECTS, Effect, EffectParameter, Scales
from bayesimpact.model.oscillator import Oscillator, build_oscillator
from bayesimpact.trial.rig.recordings import Release, Rig, motion

BY_ID = {effect.id: effect for effect in EFFECTS}
MOVING = tuple(effect for effect in EFFECTS if effect.observe is None)


@dataclass(frozen=True)
class TestRig:
    """An oscillator, one recording per obstacle and its sampling; SI."""

    __test__ = False
    mass: float = 0.503
    c1: float = 0.148
    k1: float = 808.556
    c2: float = 2.085
    g: float = 1.1e-3
    k2: Sequence[float] = (5350.156, 2959.249)
    y0: Sequence[float] = (-6.5e-3, -5e-3)
    v0: Sequence[float] = (0.0, 0.01)
    rate: float = 1000.0
    duration: float = 6.0

    @property
    def count(self) -> int:
        return round(self.rate * self.duration)

    @property
    def stop(self) -> bool:
        return len(self.k2) > 0

    def names(self) -> list[str]:
        return [f"r{i}" for i in range(len(self.y0))]

    def campaign(self) -> Campaign:
        recordings = tuple(
            Recording(name, str(i) if self.stop else "", np.zeros(self.count), 1 / self.rate)
            for i, name in enumerate(self.names())
        )
        return Campaign("test", self.mass, recordings, stop=self.stop)

    def scales(self) -> Scales:
        """Rough sizes, as a fit of the base model would give them."""
        amplitude = max(abs(y) for y in self.y0)
        w = (self.k1 / self.mass) ** 0.5
        k2 = float(np.mean(self.k2)) if self.stop else 0.0
        depth = amplitude * (self.k1 / (self.k1 + k2)) ** 0.5 if self.stop else 0.0
        return Scales(
            mass=self.mass,
            stiffness=self.k1,
            damping=self.c1,
            contact_stiffness=k2,
            contact_damping=self.c2,
            amplitude=amplitude,
            speed=amplitude * w,
            indentation=depth,
            impact_speed=amplitude * w if self.stop else 0.0,
            duration=self.duration,
            interval=1 / self.rate,
            impacts=round(self.duration * w / 6) if self.stop else 0,
            gap=self.g if self.stop else 0.0,
            cases=len(self.k2),
            recordings=len(self.y0),
        )

    def theta(self, oscillator: Oscillator, values: Mapping[str, float]) -> np.ndarray:
        """Parameter vector: the rig's own numbers, then `values` by full name."""
        own = {"c1": self.c1, "k1": self.k1, "c2": self.c2, "g": self.g, "sigma": 1e-6}
        own |= {f"k2[{i}]": k for i, k in enumerate(self.k2)}
        for i, name in enumerate(self.names()):
            own |= {f"y0[{name}]": self.y0[i], f"v0[{name}]": self.v0[i], f"offset[{name}]": 0.0}
        for effect in oscillator.effects:
            for name in (p.name for p in effect.parameters if p.initial):
                own |= {f"{effect.id}.{name}[{r}]": 0.0 for r in self.names()}
        own |= values
        return np.array([own[name] for name in oscillator.layout.names])

    def readings(self, effects: Sequence[Effect], values: Mapping[str, float]) -> list[np.ndarray]:
        """What the probe reads of every recording."""
        oscillator = build_oscillator(self.campaign(), effects)
        return list(oscillator.predict(self.theta(oscillator, values)))


def null_values(effect: Effect, rig: TestRig) -> dict[str, float]:
    """The parameters of an effect at its null; shapes at their scales."""
    return values_at(effect, rig, lambda parameter, _: parameter.null)


def values_at(effect: Effect, rig: TestRig, choose: object) -> dict[str, float]:
    """Full name -> value of all parameters of an effect.

    `choose(parameter, index)` gives the value of a parameter with a null of its own.
    """
    assert callable(choose)
    oscillator = build_oscillator(rig.campaign(), [effect])
    scales, values = rig.scales(), {}
    for i, name in enumerate(n for n in oscillator.layout.names if "." in n):
        parameter = effect.parameter(name.split(".")[1].split("[")[0])
        if parameter.circular:
            values[name] = 0.3 + i
        elif parameter.is_shape:
            values[name] = parameter.scale(scales)
        elif parameter.replaces:
            values[name] = {"c2": rig.c2, "g": rig.g}[parameter.replaces]
        else:
            values[name] = choose(parameter, i)
    return values


def typical(effect: Effect, rig: TestRig, share: float = 1.0) -> dict[str, float]:
    """All parameters of an effect, `share` of their scales away from the null."""
    scales = rig.scales()

    def choose(parameter: EffectParameter, _: int) -> float:
        assert parameter.null is not None
        away = share * parameter.scale(scales)
        return parameter.null + (away if parameter.null < parameter.upper else -away)

    values = values_at(effect, rig, choose)
    for i, name in enumerate(values):
        if effect.parameter(name.split(".")[1].split("[")[0]).replaces:
            values[name] *= 1 + 0.1 * share * (i + 1)
    return values


def numbers_of(
    effects: Sequence[Effect], values: Mapping[str, float], rig: TestRig, r: int
) -> dict[str, dict[str, float]]:
    """Effect -> parameter -> number for recording `r`, as the independent simulators take them."""
    found: dict[str, dict[str, float]] = {}
    for effect in effects:
        found[effect.id] = {}
        for parameter in effect.parameters:
            key = {"campaign": "", "case": f"[{r}]", "recording": f"[{rig.names()[r]}]"}
            found[effect.id][parameter.name] = values[
                f"{effect.id}.{parameter.name}{key[parameter.scope]}"
            ]
    return found


def moved(
    effects: Sequence[Effect], values: Mapping[str, float], rig: TestRig, r: int = 0
) -> np.ndarray:
    """True displacement of recording `r`, (n,), m, by the package's own simulators."""
    oscillator = build_oscillator(rig.campaign(), effects)
    return oscillator.predict_recording(r, rig.theta(oscillator, values)[None])[0]


def by_hand(
    effects: Sequence[Effect], values: Mapping[str, float], rig: TestRig, r: int = 0
) -> np.ndarray:
    """The same by the naive twin."""
    naive = Naive(
        rig.mass, rig.c1, rig.k1, rig.c2 * rig.stop, rig.g if rig.stop else np.inf,
        rig.k2[r] if rig.stop else 0.0, rig.y0[r], rig.v0[r],
        numbers_of(effects, values, rig, r),
    )  # fmt: skip
    return naive.run(np.arange(rig.count) / rig.rate)


def by_rig(
    effects: Sequence[Effect], values: Mapping[str, float], rig: TestRig, r: int = 0
) -> np.ndarray:
    """The same by the independent rig that makes the blind trials' recordings."""
    stop = {"c2": rig.c2, "g": rig.g, "k2": {str(i): k for i, k in enumerate(rig.k2)}}
    oscillator = Rig(rig.mass, rig.c1, rig.k1, **(stop if rig.stop else {}))
    release = Release(rig.names()[r], str(r) if rig.stop else "", rig.y0[r], rig.v0[r])
    numbers = numbers_of(effects, values, rig, r)
    return motion(
        oscillator, release, numbers, rate=rig.rate, duration=rig.duration, rtol=1e-13, atol=1e-16
    ).displacement


def with_effect(small: Identification, effect_id: str, **values: float) -> Fit:
    """The small rig's fit with an effect of given size put beside it."""
    scales, effects = campaign_scales(small.fit), (BY_ID[effect_id],)
    density = extend(small.fit, effects, scales)
    mode = transfer(small.fit, density.oscillator.layout, effects, scales, {})
    for name, value in values.items():
        mode[density.oscillator.layout.index(f"{effect_id}.{name}")] = value
    return dataclasses.replace(small.fit, density=density, mode=mode)
