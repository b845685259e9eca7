"""The measuring chain smooths the signal by a first-order lag.

Equation: reading x with tau x' + x = y, tau in s; y holds its last sample and x begins on the
first one.
At its null: tau = 0 is the base model.
Energy: none: the motion is untouched.
Valid: a single analogue low pass, or exponential smoothing; a Savitzky-Golay filter of the chain is
found by the nulls of the noise spectrum instead (`bayesimpact.inference.noise.spectrum`).
Its absence shows as contacts that begin and end too softly, while free flight, which a lag only
delays and shrinks, fits perfectly.
Source: Doebelin 1990, Measurement Systems, chapter 3 (first-order instruments).
Status: exact.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.effects.effect import Effect, EffectParameter

Array = NDArray[np.float64]


def observe(y: Array, t: Array, p: Array) -> Array:
    """Readings (K, n), m, of displacements y (K, n) at times t (n,); p (K, 1) = time_constant."""
    from scipy.signal import lfilter  # slow to import

    readings = y.copy()
    for row in np.flatnonzero(p[:, 0] > 0.0):
        decay = np.exp(-(t[1] - t[0]) / p[row, 0])
        readings[row], _ = lfilter([1 - decay], [1, -decay], y[row], zi=[decay * y[row, 0]])
    return readings


EFFECT = Effect(
    id="smoothing",
    family="sensor",
    title="smoothing by the measuring chain",
    equation="measured x with tau x' + x = y",
    regime="measurement",
    energy="none",
    statement=(
        "The chain smoothed the recordings: a first-order lag of {size} "
        "({share} of the reciprocal of the fastest natural frequency)."
    ),
    parameters=(
        EffectParameter(
            "time_constant",
            "s",
            scale=lambda s: 0.1 / max(s.contact_rate, (s.stiffness / s.mass) ** 0.5),
            lower=0.0,
        ),
    ),
    observe=observe,
    size=lambda p, s: (p[0], "s", p[0] * max(s.contact_rate, (s.stiffness / s.mass) ** 0.5)),
)
