"""How forces from outside the catalogue are planted; a resonator is base_motion."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi

import numpy as np

from bayesimpact.trial.draw.designs import DrawnRig
from bayesimpact.trial.draw.planted_effects import EffectForm, PlantedEffect, one_number, sign_of

Rng = np.random.Generator


def _local(design: DrawnRig, rng: Rng) -> tuple[float, float]:
    """Place and width of a local force on the free side, m."""
    place = -design.amplitude * rng.uniform(0.2, 0.55)
    return place, design.amplitude * rng.uniform(0.05, 0.12)


def _detent(design: DrawnRig, rng: Rng) -> EffectForm:
    place, width = _local(design, rng)
    sign, k1 = sign_of(rng), design.rig.k1
    return EffectForm(
        lambda size: {"stiffness": sign * size, "place": place, "width": width},
        1e-4 * k1,
        place=(place - 1.5 * width, place + 1.5 * width),
        largest=2 * k1,
    )


def _friction_pad(design: DrawnRig, rng: Rng) -> EffectForm:
    place, width = _local(design, rng)
    extra, speed = rng.uniform(0.5, 2.0), 0.1 * design.speed
    force = design.rig.k1 * design.amplitude
    return EffectForm(
        lambda size: {
            "force": size, "extra": extra * size, "speed": speed,
            "low": place - width, "high": place + width,
        },
        1e-5 * force,
        place=(place - width, place + width),
        largest=0.1 * force,
    )  # fmt: skip


def _bump(design: DrawnRig, rng: Rng) -> EffectForm:
    place, width = _local(design, rng)
    c1 = design.rig.c1
    return EffectForm(
        lambda size: {"coefficient": size, "place": place, "width": width},
        1e-3 * c1,
        place=(place - 1.5 * width, place + 1.5 * width),
        largest=100 * c1,
    )


def _brake(design: DrawnRig, rng: Rng) -> EffectForm:
    place, width = _local(design, rng)
    low, high, c1 = place - 2 * width, place + 2 * width, design.rig.c1
    return EffectForm(
        lambda size: {"coefficient": size, "low": low, "high": high},
        1e-3 * c1,
        place=(low, high),
        largest=100 * c1,
    )


def _knock(design: DrawnRig, rng: Rng) -> EffectForm:
    time, width = design.duration * rng.uniform(0.2, 0.6), 0.5 * pi / design.omega
    sign, scale = sign_of(rng), design.rig.mass * design.speed
    return EffectForm(
        lambda size: {"impulse": sign * size, "time": time, "width": width},
        1e-5 * scale,
        largest=0.3 * scale,
    )


_ANYWHERE = ("free", "everywhere")

OUTSIDE_EFFECTS: Mapping[str, PlantedEffect] = {
    "detent": PlantedEffect(("free",), _detent),
    "friction_pad": PlantedEffect(("free",), _friction_pad),
    "damping_bump": PlantedEffect(("free",), _bump),
    "eddy_brake": PlantedEffect(("free",), _brake),
    "damping_drift": PlantedEffect(_ANYWHERE, one_number("rate", lambda d: 3 / d.duration)),
    "contact_friction": PlantedEffect(
        ("contact",), one_number("force", lambda d: 0.1 * d.contact_stiffness * d.indentation), 1
    ),
    "contact_preload": PlantedEffect(
        ("contact",), one_number("force", lambda d: 0.1 * d.contact_stiffness * d.indentation), 1
    ),
    "knock": PlantedEffect(_ANYWHERE, _knock),
}
"""Every force outside the catalogue that may be planted; a resonator is base_motion."""
