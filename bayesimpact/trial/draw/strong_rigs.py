"""Rigs of the strong trials: with a stop, without, and pendulums read by an encoder.

Few recordings, as laboratories have them, and damping up to 2 %. The noise is not drawn here: it
follows from the misfit that the trial is to have (`draw.strong`), within what probes and encoders
can do.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import sqrt

import numpy as np

from bayesimpact.data.campaign import Measurement
from bayesimpact.trial.draw.designs import DrawnRig, Range, RigDesign, draw_rig_design
from bayesimpact.trial.rig.measuring_chain import MeasuringChain

_DAMPING = (2e-3, 2e-2)
_CONTACT_DAMPING = (0.01, 0.08)
_NOISE = (2e-5, 1e-2)  # of the largest release

STRONG_RIGS: Mapping[str, RigDesign] = {
    "one_stop": RigDesign(
        (0.2, 1.0), (4.0, 10.0), _DAMPING, (3.0, 12.0), _CONTACT_DAMPING, (3e-3, 1e-2),
        (0.1, 0.4), 1, 3, 1000.0, (20.0, 35.0), _NOISE,
    ),
    "soft_stops": RigDesign(
        (0.8, 3.0), (0.8, 2.0), _DAMPING, (1.0, 4.0), _CONTACT_DAMPING, (0.02, 0.05),
        (0.1, 0.4), 2, 2, 400.0, (15.0, 25.0), _NOISE,
    ),
    "three_stops": RigDesign(
        (0.3, 0.8), (5.0, 8.0), _DAMPING, (3.0, 8.0), _CONTACT_DAMPING, (4e-3, 8e-3),
        (0.1, 0.3), 3, 1, 1000.0, (20.0, 30.0), _NOISE,
    ),
    "decays": RigDesign(
        (0.2, 1.0), (3.0, 10.0), _DAMPING, (0.0, 0.0), _CONTACT_DAMPING, (3e-3, 1e-2),
        (0.1, 0.3), 0, 3, 500.0, (25.0, 40.0), _NOISE,
    ),
    "one_decay": RigDesign(
        (0.2, 1.0), (1.0, 4.0), _DAMPING, (0.0, 0.0), _CONTACT_DAMPING, (5e-3, 5e-2),
        (0.1, 0.3), 0, 1, 250.0, (40.0, 70.0), _NOISE,
    ),
    "pendulums": RigDesign(
        (0.01, 0.2), (0.5, 1.5), (5e-4, 8e-3), (0.0, 0.0), _CONTACT_DAMPING, (0.3, 1.2),
        (0.1, 0.3), 0, 2, 100.0, (25.0, 40.0), _NOISE,
    ),
    "one_pendulum": RigDesign(
        (0.01, 0.2), (0.5, 1.5), (5e-4, 8e-3), (0.0, 0.0), _CONTACT_DAMPING, (0.3, 1.2),
        (0.1, 0.3), 0, 1, 100.0, (40.0, 70.0), _NOISE,
    ),
}  # fmt: skip
"""Kinds of rigs by name; lengths of the pendulums are angles in rad, masses inertias in kg m2."""

GROUPS: Mapping[str, tuple[str, ...]] = {
    "stop": ("one_stop", "soft_stops", "three_stops"),
    "plain": ("decays", "one_decay"),
    "pendulum": ("pendulums", "one_pendulum"),
}

STEPS: Range = (1e-4, 3e-3)  # of an encoder, rad
DITHER = 0.2  # noise ahead of the encoder, in its steps
ENCODER_SD = sqrt(1 / 12 + DITHER**2)  # of the reading's error, in steps: a uniform one and dither


def is_pendulum(rig_kind: str) -> bool:
    """Whether the rig of this name is a pendulum, whose recordings are angles."""
    return rig_kind in GROUPS["pendulum"]


def draw_rig(rig_kind: str, noise_kind: str, rng: np.random.Generator) -> DrawnRig:
    """A rig, its releases and rest readings; what noise there is will be set by `with_noise`."""
    kind = "white" if is_pendulum(rig_kind) else noise_kind
    design = draw_rig_design(rig_kind, kind, rng, STRONG_RIGS)
    if not is_pendulum(rig_kind):
        return design
    return replace(design, noise_kind="encoder")


def noise_range(design: DrawnRig) -> Range:
    """Smallest and largest standard deviation of the noise that the probe may have, m or rad."""
    if is_pendulum(design.rig_kind):
        return STEPS[0] * ENCODER_SD, STEPS[1] * ENCODER_SD
    low, high = STRONG_RIGS[design.rig_kind].noise
    return low * design.amplitude, high * design.amplitude


def with_noise(design: DrawnRig, noise: float) -> DrawnRig:
    """The same rig with noise of this standard deviation in all, m or rad; an encoder's steps."""
    old = design.chain
    offsets = {name: value * noise / old.noise for name, value in old.offsets.items()}
    if is_pendulum(design.rig_kind):
        step = noise / ENCODER_SD
        chain = MeasuringChain(DITHER * step, 0.0, offsets, None, step)
    else:
        rounding = old.rounding * noise / old.noise
        chain = MeasuringChain(noise, old.correlation, offsets, None, rounding)
    return replace(design, chain=chain, measurement=Measurement())
