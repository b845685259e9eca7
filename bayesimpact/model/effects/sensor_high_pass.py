"""The chain passes no constant: a first-order high-pass stands before the readings.

Equation: measured y - z + s (1 - exp(-w t)) / w with z' = w (y - z), z = 0 at t = 0 and w = 2 pi f;
f in Hz, s in m/s (for other readings their unit, per s), t from the recording's first sample; y is
what the recording is of. s = w z0, where z0 is what the filter took for the constant before that
sample, counted from rest: 0 where it had settled on the rest, y where on a mass that was held.
Every recording has its own; its offset is that of the first sample, s / w before that of the last.
At its null: f = 0 and s = 0 is the base model; f = 0 alone leaves a drift s t.
Energy: none: the motion is untouched.
Valid: one real pole, far below half the sampling rate, the same for all recordings: charge
amplifiers, AC-coupled inputs. Between samples y is smooth: a jump of it (an acceleration's at a
touch) errs by up to w T / 2 of its height, T the interval.
Its absence shows as a zero that follows the mean of the motion, and readings that are ahead of it,
the more the slower it is.
Source: Doebelin 1990, Measurement Systems, chapter 4 (piezoelectric transducers with charge
amplifiers).
Status: checked against the filter's own equation in fine steps.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.effects.effect import Effect, EffectParameter
from bayesimpact.model.measurement import high_passed, settling

Array = NDArray[np.float64]
TYPICAL = 0.1
"""Corner over natural frequency: amplifiers that take more off are seen to do so at once."""


def observe(y: Array, t: Array, p: Array) -> Array:
    """Readings (K, n), m, of displacements y (K, n) at times t (n,); p (K, 2) = corner, rate."""
    passed = [high_passed(one, f, t[1] - t[0]) for one, f in zip(y, p[:, 0], strict=True)]
    return np.stack(passed) + p[:, 1:] * settling(p[:, :1], t)


EFFECT = Effect(
    id="sensor_high_pass",
    family="sensor",
    title="high-pass of the measuring chain",
    equation="measured y - z + s (1 - exp(-2 pi f t)) / (2 pi f), z' = 2 pi f (y - z)",
    regime="measurement",
    energy="none",
    statement=(
        "The measuring chain passes no constant: a first-order high-pass at {size} ({share} of the "
        "natural frequency)."
    ),
    parameters=(
        EffectParameter("corner", "Hz", scale=lambda s: TYPICAL * s.natural_frequency, lower=0.0),
        EffectParameter(
            "rate",
            "m/s",
            scale=lambda s: 2 * np.pi * TYPICAL * s.natural_frequency * s.largest_reading,
            scope="recording",
            initial=True,
        ),
    ),
    observe=observe,
    size=lambda p, s: (p[0], "Hz", p[0] / s.natural_frequency),
)
