"""Rigs on which the effects are tested, and the way from named numbers to a simulated motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.recording import Recording
from bayesimpact.model.effects import EFFECTS, Effect, Scales
from bayesimpact.model.oscillator import Oscillator, build_oscillator

BY_ID = {effect.id: effect for effect in EFFECTS}


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
    changes: Mapping[str, float] = field(default_factory=dict)

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
