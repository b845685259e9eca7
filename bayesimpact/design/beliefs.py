"""What is believed of every parameter of a recording before it is made.

Parameters that it shares with the campaign have their posterior; start values, rest reading and
what every recording has for itself are nearly unknown.
"""

from __future__ import annotations

from math import pi, sqrt

import numpy as np

from bayesimpact.design.candidates import PlannedRecording, highest
from bayesimpact.design.hypotheses import FittedModel, Rivalry
from bayesimpact.model.effects.effect import EffectParameter
from bayesimpact.model.oscillator import Oscillator
from bayesimpact.model.parameters import bare_name, is_added

START = 0.1
"""Standard deviation of start values and rest reading about the intended ones, in the highest
release; the recording determines them a thousand times better, so the number hardly matters.
"""
UNIFORM = pi / sqrt(3.0)
"""Standard deviation of a phase of which nothing is known."""
STEP = 0.05
"""Difference steps, in standard deviations of the posterior: as in fits of added effects. Along a
ridge that is too much: no step moves a recording by more than about its noise, once in all.
"""


def belief(
    hypothesis: FittedModel, o: Oscillator, name: str, design: PlannedRecording, rivals: Rivalry
) -> tuple[float, float, float, float]:
    """Mean, standard deviation and difference step of a parameter; its position in the model, or -1
    for one of the new recording's own.
    """
    place = hypothesis.known.get(name, -1)
    if place < 0 or (bare_name(name) == "g" and design.gap_shift):
        mean, sd = _own(hypothesis, name, int(o.orders[0]), design, rivals)
        usual = _usual_sd(hypothesis, name)
        return mean, sd, step_of(usual or 1e-3 * sd, mean), -1
    sd, value = float(hypothesis.sd[place]), float(hypothesis.mode[place])
    return value, sd, min(step_of(sd, value), float(hypothesis.conditional_sd[place])), place


def _own(
    hypothesis: FittedModel, name: str, order: int, design: PlannedRecording, rivals: Rivalry
) -> tuple[float, float]:
    """Mean and standard deviation of a parameter of the new recording alone.

    A start value is as intended, but for the hand; a gap or a size that every recording has for
    itself is like those of the recordings so far.
    """
    wide, rate = START * highest(rivals), rate_of(hypothesis, rivals)
    starts = {
        "y0": (design.y0, wide),
        "v0": (design.v0, wide * rate),
        "offset": (0.0, wide * rate**order),
    }
    bare = bare_name(name)
    if bare in starts and not is_added(name):
        return starts[bare]
    if circular(hypothesis, name):
        return 0.0, UNIFORM
    values = hypothesis.mode[_alike(hypothesis, name)]
    mean = float(values.mean()) if values.size else 0.0
    sd = max(float(values.std()) if values.size else 0.0, _usual_sd(hypothesis, name))
    if bare == "g":
        return mean + design.gap_shift, max(sd, abs(design.gap_shift))
    return mean, sd


def _alike(hypothesis: FittedModel, name: str) -> list[int]:
    """Positions of a parameter's values for the recordings so far."""
    return [i for n, i in hypothesis.known.items() if n.split("[")[0] == name.split("[")[0]]


def _usual_sd(hypothesis: FittedModel, name: str) -> float:
    """How well the recordings so far determine such a parameter; 0 where none has it."""
    alike = _alike(hypothesis, name)
    return float(np.median(hypothesis.sd[alike])) if alike else 0.0


def step_of(sd: float, value: float) -> float:
    """Difference step of a parameter with a standard deviation."""
    return STEP * sd if sd > 0 else 1e-6 * max(abs(float(value)), 1e-6)


def circular(hypothesis: FittedModel, name: str) -> bool:
    """Whether a parameter of an effect is a phase."""
    parameter = parameter_of(hypothesis, name)
    return parameter is not None and parameter.circular


def parameter_of(hypothesis: FittedModel, name: str) -> EffectParameter | None:
    """The record of an effect's parameter; None for one of the base oscillator."""
    if not is_added(name):
        return None
    own, rest = name.split(".", 1)
    (effect,) = [e for e in hypothesis.effects if e.id == own]
    return effect.parameter(rest.split("[")[0])


def rate_of(hypothesis: FittedModel, rivals: Rivalry) -> float:
    """Natural angular frequency in free flight, rad/s."""
    known = [hypothesis.mode[i] for n, i in hypothesis.known.items() if bare_name(n) == "k1"]
    return sqrt(max(float(np.mean(known)), 1e-300) / rivals.mass) if known else 1.0
