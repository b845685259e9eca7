"""The rig is shaken: a harmonic force of one frequency, with a phase of its own in every recording.

Equation: -A sin(2 pi f t + phase) on the left-hand side; A in N (for angles N m), f in Hz, phase
in rad; t from the recording's first sample.
At its null: A = 0 is the base model; frequency and phases then mean nothing.
Energy: either: the force does work on the mass.
Valid: a machine or the floor that vibrates steadily and is not acted upon by the rig.
Its absence shows as a spectral line that does not decay, and does not stop when the mass rests.
Source: Tian et al., Eq. 6.
Status: steady state checked against the closed-form response; compiled law against two
independent integrators.
"""

from __future__ import annotations

import math

import numpy as np

from bayesimpact.model.effects.effect import Effect, EffectParameter, Law, Numbers, phase


def force(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Forcing, on the left-hand side, N."""
    return -p[0] * math.sin(6.283185307179586 * p[1] * t + p[2])


def time_rate(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Angular frequency, rad/s."""
    return 6.283185307179586 * p[1]


EFFECT = Effect(
    id="harmonic_forcing",
    family="forcing",
    title="harmonic forcing",
    equation="-A sin(2 pi f t + phase)",
    regime="everywhere",
    energy="either",
    statement="A harmonic force of {size} ({share} of the peak elastic force) shakes the mass.",
    parameters=(
        EffectParameter("amplitude", "N", scale=lambda s: 0.01 * s.force, lower=0.0),
        EffectParameter(
            "frequency",
            "Hz",
            scale=lambda s: s.natural_frequency,
            lower=0.0,
            null=None,
            spectral=True,
            grid=lambda s: np.array([0.5, 0.8, 1.25, 2.0, 3.0, 5.0]) * s.natural_frequency,
        ),
        phase(),
    ),
    law=Law(force, time_rate=time_rate, polynomial=True, ignores_speed=True, of_time=True),
)
