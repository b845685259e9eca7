"""The probe's zero drifts steadily.

Equation: measured y + r t, r in m/s (for angles rad/s); t from the recording's first sample.
At its null: r = 0 is the base model.
Energy: none: the motion is untouched.
Valid: slow thermal drift, linear over one recording; the rest offset takes its constant part.
Its absence shows as a residual that is a straight line in time, also where the mass is at rest.
Source: Doebelin 1990, Measurement Systems, chapter 3 (zero drift).
Status: exact.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.effects.effect import Effect, EffectParameter

Array = NDArray[np.float64]


def observe(y: Array, t: Array, p: Array) -> Array:
    """Readings (K, n), m, of displacements y (K, n) at times t (n,); p (K, 1) = rate."""
    return y + p[:, :1] * t


EFFECT = Effect(
    id="sensor_drift",
    family="sensor",
    title="drift of the probe's zero",
    equation="measured y + r t",
    regime="measurement",
    energy="none",
    statement="The probe's zero drifts by {size} during a recording ({share} of the amplitude).",
    parameters=(
        EffectParameter("rate", "m/s", scale=lambda s: 0.01 * s.largest_reading / s.duration),
    ),
    observe=observe,
)
