"""The measured input acts later, or earlier, than its column says.

Equation: readings y(t - tau) of the motion y under the input as it was read, tau in s.
At its null: tau = 0 is the base model.
Energy: none: the motion is untouched.
Valid: channels that are sampled one after the other, or of which one passed a filter: a few
samples, the same for all inputs; free decays beside them are shifted too, which their start values
take up. Before the first reading the motion is carried on by a cubic.
Its absence shows as a residual that goes with the velocity at the input's frequencies, like damping
that is right at one frequency only.
Source: Ljung 1999, System Identification, chapter 4 (delay of the input).
Status: exact but for the spline between the samples.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.effects.effect import Effect, EffectParameter

Array = NDArray[np.float64]


def observe(y: Array, t: Array, p: Array) -> Array:
    """Readings (K, n), m, of displacements y (K, n) at times t (n,); p (K, 1) = time."""
    from scipy.interpolate import CubicSpline  # slow to import

    readings = y.copy()
    for row in np.flatnonzero(p[:, 0] != 0.0):
        if np.isfinite(y[row]).all():
            readings[row] = CubicSpline(t, y[row])(t - p[row, 0])
    return readings


EFFECT = Effect(
    id="input_delay",
    family="sensor",
    title="delay of the measured input",
    equation="measured y(t - tau)",
    regime="measurement",
    energy="none",
    statement="The measured input acts {size} later than its column says ({share} of an interval).",
    parameters=(EffectParameter("time", "s", scale=lambda s: s.interval),),
    observe=observe,
    condition=lambda s: s.driven,
    size=lambda p, s: (p[0], "s", abs(p[0]) / s.interval),
)
