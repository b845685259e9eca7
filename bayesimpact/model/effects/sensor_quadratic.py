"""The probe's characteristic is bent: it reads the square of the displacement as well.

Equation: measured y + a y^2, a in 1/m (for angles 1/rad).
At its null: a = 0 is the base model.
Energy: none: the motion is untouched.
Valid: inductive and eddy-current probes near the ends of their range; |a y| well below one.
Its absence shows as a second harmonic, in fixed ratio to the square of the amplitude, that no
force explains.
Source: Doebelin 1990, Measurement Systems, chapter 3 (static calibration, nonlinearity).
Status: exact.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.effects.effect import Effect, EffectParameter

Array = NDArray[np.float64]


def observe(y: Array, t: Array, p: Array) -> Array:
    """Readings (K, n), m, of displacements y (K, n) at times t (n,); p (K, 1) = gain."""
    return y + p[:, :1] * y * y


EFFECT = Effect(
    id="sensor_quadratic",
    family="sensor",
    title="quadratic characteristic of the probe",
    equation="measured y + a y^2",
    regime="measurement",
    energy="none",
    statement=(
        "The probe is not linear: a quadratic term adds up to {size} ({share} of the amplitude)."
    ),
    parameters=(EffectParameter("gain", "1/m", scale=lambda s: 0.01 / s.largest_reading),),
    observe=observe,
)
