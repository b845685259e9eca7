"""Hum: the probe's signal contains a steady sine, with a phase of its own in every recording.

Equation: measured y + a sin(2 pi f t + phase); a in m (for angles rad), f in Hz, phase in rad; t
from the recording's first sample.
At its null: a = 0 is the base model; frequency and phases then mean nothing.
Energy: none: the motion is untouched.
Valid: pick-up from the mains and other steady electrical sources of one frequency.
Its absence shows as a spectral line that does not decay and does not excite the oscillator.
Source: Horowitz and Hill 1989, The Art of Electronics, chapter 7 (interference).
Status: exact.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.effects.effect import Effect, EffectParameter, phase

Array = NDArray[np.float64]


def observe(y: Array, t: Array, p: Array) -> Array:
    """Readings (K, n), m, of displacements y (K, n) at times t (n,); p (K, 3) = a, f, phase."""
    return y + p[:, :1] * np.sin(2 * np.pi * p[:, 1:2] * t + p[:, 2:3])


EFFECT = Effect(
    id="sensor_hum",
    family="sensor",
    title="hum in the probe's signal",
    equation="measured y + a sin(2 pi f t + phase)",
    regime="measurement",
    energy="none",
    statement="The probe's signal carries a hum of {size} ({share} of the amplitude).",
    parameters=(
        EffectParameter("amplitude", "m", scale=lambda s: 0.005 * s.largest_reading, lower=0.0),
        EffectParameter(
            "frequency",
            "Hz",
            scale=lambda s: min(50.0, 0.25 / s.interval),
            lower=0.0,
            null=None,
            spectral=True,
            grid=lambda s: mains(0.5 / s.interval),
        ),
        phase(),
    ),
    observe=observe,
)


def mains(nyquist: float) -> Array:
    """Frequencies of the mains and their first overtones below `nyquist`, Hz; at least one."""
    usual = np.array([16.7, 50.0, 60.0, 100.0, 120.0, 150.0, 180.0])
    below = usual[usual < nyquist]
    return below if below.size else np.array([0.5 * nyquist])
