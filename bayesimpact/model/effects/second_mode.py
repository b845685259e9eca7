"""A second mode of the oscillator: contact forces excite it, and the probe sees it too.

Equation: q'' + 2 z w q' + w^2 q = b F, reading y + q; F = c2 v + k2 d + whatever else acts between
mass and obstacle (0 in flight), w = 2 pi f in rad/s, z without unit, b in 1/kg (for angles 1/(kg
m2)); q = q' = 0 at a recording's first sample.
At its null: b = 0 is the base model; frequency and damping then mean nothing.
Energy: none: the motion y is untouched, what q carries is not taken from it.
Valid: a further bending or rocking mode with little energy, excited at the contact and not coupled
to the suspension otherwise; b is the product of the mode shape at contact and probe over the modal
mass, so either sign.
Its absence shows as ringing that begins at every impact, and as an obstacle that seems softer or
harder, and more damped, than it is.
Source: Meirovitch 2001, Fundamentals of Vibrations, chapter 7 (modal superposition).
Status: step response and equal frequencies checked in closed form; compiled against two independent
integrators.
"""

from __future__ import annotations

import math
from types import MappingProxyType

import numpy as np

from bayesimpact.model.effects.effect import (
    Effect,
    EffectParameter,
    Numbers,
    Scales,
    Size,
    damping_ratio,
)


def size(p: Numbers, s: Scales) -> Size:
    """Largest displacement of the mode: static where faster than a contact, else after one."""
    omega = 2.0 * math.pi * p[0]
    peak = abs(p[2]) * s.contact_force / (omega * max(omega, s.contact_rate))
    return peak, "m", peak / s.indentation


EFFECT = Effect(
    id="second_mode",
    family="modes",
    title="second mode seen by the probe",
    equation="q'' + 2 z w q' + w^2 q = b F_contact, measured y + q",
    regime="contact",
    energy="none",
    statement=(
        "Contact excites a second mode that the probe sees: up to {size} ({share} of the depth of "
        "contact)."
    ),
    parameters=(
        EffectParameter(
            "frequency",
            "Hz",
            scale=lambda s: 4.0 * s.contact_rate / (2.0 * math.pi),
            lower=0.0,
            null=None,
            grid=lambda s: np.geomspace(0.8, 20.0, 32) * s.contact_rate / (2.0 * math.pi),
        ),
        damping_ratio(0.02),
        EffectParameter("gain", "1/kg", scale=lambda s: 0.3 / s.mass),
    ),
    binds=MappingProxyType(
        {"second_frequency": "frequency", "second_damping": "damping", "second_gain": "gain"}
    ),
    needs_stop=True,
    size=size,
)
