"""What the samples just before and just after a place predict there: one-sided polynomials.

An impact is a corner: what lies before it predicts it badly, what lies after it well, or the other
way round. A reading that neither side predicts, while both agree, is no motion.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FORMS = ((2, 5), (2, 7), (2, 9), (3, 8), (2, 12), (3, 12), (3, 16), (3, 24))
"""Degree and samples of the polynomials; the pair that predicts a recording best is taken."""
SHARE = 1 / 14  # of a period, at most: shorter than half a period against a stiff stop


@dataclass(frozen=True, eq=False)
class OneSidedPrediction:
    """One-sided predictions at every sample; NaN within reach of an end.

    Attributes
    ----------
    before, after : (n,) value at `place`, from the samples before and after it
    slope_before, slope_after : (n,) per sample
    """

    before: Array
    after: Array
    slope_before: Array
    slope_after: Array


def robust_sd(values: Array) -> float:
    """Standard deviation of the bulk: the median of absolute values about 0, for a Gaussian."""
    finite = values[np.isfinite(values)]
    return float(np.median(np.abs(finite)) / 0.67449) if finite.size else 0.0


@lru_cache(maxsize=256)
def _weights(degree: int, length: int, at: float) -> tuple[Array, Array]:
    """Weights of samples -length..-1 for the value and the slope at `at`, (length,) each."""
    place = np.arange(-length, 0, dtype=np.float64)
    fit = np.linalg.pinv(np.vander(place, degree + 1, increasing=True))
    powers = np.arange(degree + 1)
    value = np.power(at, powers) @ fit
    slope = (powers[1:] * np.power(at, powers[1:] - 1)) @ fit[1:]
    return value, slope


def predict_sides(
    samples: Array, form: tuple[int, int], gap: int = 0, place: float = 0.0
) -> OneSidedPrediction:
    """Predictions from samples i-m..i-1 and i+gap..i+gap+m-1, at i + place, for every i.

    A spike of `gap` samples that begins at i is left out on both sides; a slip before sample i is
    seen with gap 0 and place -0.5.
    """
    degree, m = form
    n = samples.size
    result = [np.full(n, np.nan) for _ in range(4)]
    if n < 2 * m + gap + 1:
        return OneSidedPrediction(*result)
    window = np.lib.stride_tricks.sliding_window_view(samples, m)  # rows start at 0..n-m
    value, slope = _weights(degree, m, place)
    result[0][m:] = (window @ value)[: n - m]
    result[2][m:] = (window @ slope)[: n - m]
    # the side after, mirrored: its nearest sample is i + gap, one step beyond i + gap - 1
    value, slope = _weights(degree, m, gap - 1.0 - place)
    count = n - m - gap + 1
    result[1][:count] = (window @ value[::-1])[gap : gap + count]
    result[3][:count] = -(window @ slope[::-1])[gap : gap + count]
    return OneSidedPrediction(*result)


def rounding_error(form: tuple[int, int], place: float, step: float) -> float:
    """What readings rounded to a step may make of a prediction at `place`, at most."""
    return 0.5 * step * float(np.abs(_weights(*form, place)[0]).sum())


def best_form(samples: Array, period: float | None) -> tuple[int, int]:
    """The form whose predictions of the next sample are off least, by the bulk."""
    longest = max(5.0, SHARE * (period or samples.size))
    forms = [form for form in FORMS if form[1] <= longest]
    errors = [robust_sd(samples - predict_sides(samples, form, 1).before) for form in forms]
    return forms[int(np.argmin(errors))]
