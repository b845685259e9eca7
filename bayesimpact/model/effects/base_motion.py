"""The frame moves: suspension, stop and probe stand on a base that the oscillator shakes.

Equation: X'' + 2 z w X' + w^2 X = r N / m and m (y'' + X'') + N = 0, N = c1 v + k1 y + everything
else between frame and mass, y read relative to the frame; w = 2 pi f in rad/s; z and the mass
ratio r = m / (mass of the frame) without unit; X = X' = 0 at a recording's first sample.
At its null: r = 0 is the base model; frequency and damping then mean nothing.
Energy: dissipates: what the frame takes it gives back, less what its damper takes.
Valid: one mode of the frame in the direction of motion. A loose body on the oscillator is the same
thing in other numbers: with r = mass of the body / m, every constant of the rig divided by 1 + r.
Velocities and accelerations too are read relative to the frame; an accelerometer on the mass would
read the frame's as well, which is not modelled.
Its absence shows as a second frequency in free flight, and as damping that depends on frequency.
Source: Den Hartog 1956, Mechanical Vibrations, chapter 3 (two degrees of freedom).
Status: matrix exponential in coordinates of the room checked; compiled against two independent
integrators.
"""

from __future__ import annotations

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
    """Displacement of the frame: quasi-static when it is faster than the oscillator."""
    ratio = s.natural_frequency / max(p[0], s.natural_frequency)
    peak = p[2] * s.amplitude * ratio * ratio
    return peak, "m", peak / s.amplitude


EFFECT = Effect(
    id="base_motion",
    family="modes",
    title="motion of the frame",
    equation="X'' + 2 z w X' + w^2 X = r N / m, m (y'' + X'') + N = 0",
    regime="everywhere",
    energy="dissipates",
    statement="The frame moves with the oscillator by about {size} ({share} of the amplitude).",
    parameters=(
        EffectParameter(
            "frequency",
            "Hz",
            scale=lambda s: 3.0 * s.natural_frequency,
            lower=0.0,
            null=None,
            grid=lambda s: np.geomspace(0.4, 12.0, 32) * s.natural_frequency,
        ),
        damping_ratio(0.02),
        EffectParameter("mass_ratio", "-", scale=lambda s: 0.03, lower=0.0),
    ),
    binds=MappingProxyType(
        {"frame_frequency": "frequency", "frame_damping": "damping", "frame_ratio": "mass_ratio"}
    ),
    size=size,
)
