"""The probe's characteristic flattens or steepens: it reads the cube of the displacement as well.

Equation: measured y + a y^3, a in 1/m2 (for angles 1/rad2).
At its null: a = 0 is the base model.
Energy: none: the motion is untouched.
Valid: probes near the ends of their range; |a| y^2 well below one.
Its absence shows as a third harmonic, in fixed ratio to the cube of the amplitude, that no force
explains.
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
    return y + p[:, :1] * y * y * y


EFFECT = Effect(
    id="sensor_cubic",
    family="sensor",
    title="cubic characteristic of the probe",
    equation="measured y + a y^3",
    regime="measurement",
    energy="none",
    statement=(
        "The probe is not linear: a cubic term adds up to {size} ({share} of the amplitude)."
    ),
    parameters=(EffectParameter("gain", "1/m2", scale=lambda s: 0.01 / s.largest_reading**2),),
    observe=observe,
)
