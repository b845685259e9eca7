"""A further mode that the release excites: it rings down beside the motion, and the probe sees it.

Equation: measured y + a exp(-r t) sin(2 pi f t + phase); a in the unit of the reading and phase in
rad for every recording, f in Hz, r in 1/s; t from the recording's first sample.
At its null: a = 0 is the base model; frequency, decay and phases then mean nothing. With r = 0 it
is a hum.
Energy: none: the motion y is untouched, what the mode carries is not taken from it.
Valid: recordings without an obstacle and without an input, that begin when everything is released:
a beam's or a frame's second mode, a rocking, a spring's own surge; no coupling to y after that.
Its absence shows as a spectral line that decays with a rate of its own.
Source: Ewins 2000, Modal Testing, chapter 4 (free decay as a sum of modes).
Status: exact.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.effects.effect import Effect, EffectParameter, phase

Array = NDArray[np.float64]


def observe(y: Array, t: Array, p: Array) -> Array:
    """Readings (K, n) of displacements y (K, n) at times t (n,); p (K, 4) = a, f, r, phase."""
    amplitude, frequency, decay, phase = (p[:, i : i + 1] for i in range(4))
    return y + amplitude * np.exp(-decay * t) * np.sin(2 * np.pi * frequency * t + phase)


EFFECT = Effect(
    id="released_mode",
    family="modes",
    title="second mode excited by the release",
    equation="measured y + a exp(-r t) sin(2 pi f t + phase)",
    regime="measurement",
    energy="none",
    statement=(
        "The release excites a second mode that the probe sees ring down: up to {size} ({share} of "
        "the amplitude)."
    ),
    parameters=(
        EffectParameter(
            "amplitude",
            "m",
            scale=lambda s: 0.02 * s.largest_reading,
            lower=0.0,
            scope="recording",
        ),
        EffectParameter(
            "frequency",
            "Hz",
            scale=lambda s: 5.0 * s.natural_frequency,
            lower=0.0,
            null=None,
            spectral=True,
            grid=lambda s: np.array([2.0, 4.0, 6.0]) * s.natural_frequency,
        ),
        EffectParameter(
            "decay",
            "1/s",
            scale=lambda s: 4.0 / s.duration,
            lower=0.0,
            null=None,
            grid=lambda s: np.array([1.0, 4.0, 16.0]) / s.duration,
        ),
        phase(),
    ),
    observe=observe,
    prefer="sensor_hum",
    condition=lambda s: s.impacts == 0 and not s.driven,
)
