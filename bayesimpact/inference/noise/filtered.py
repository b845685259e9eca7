"""A bound of the noise behind a filter from what polynomials leave of short windows.

Of white noise behind the filter they leave a known part of its power; motion only adds to that. So
windows of every length tell a level that the noise does not exceed, and the lowest is taken, which
the residual of a fit may lower further. For recordings with a measured input, and where half cycles
(see `spectrum`) are no sinusoids: beside dry friction, and at a stop in a velocity or acceleration.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import stats

from bayesimpact.data.campaign import Smoothing
from bayesimpact.data.hum import find_hum
from bayesimpact.data.recording import Recording
from bayesimpact.errors import InputError
from bayesimpact.inference.noise.remainders import (
    KEPT,
    LARGEST,
    SMALLEST,
    WINDOWS_PER_PERIOD,
    PolynomialRemainder,
    remainder_of,
)
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.inference.noise.windows import period_of
from bayesimpact.model.measurement import covariance

SURE = 2.0  # standard errors: the lowest upper end counts, for the lowest level is one by chance
LARGEST_ERROR = 0.1  # relative: fewer numbers tell a level only where there are no others
FAR = 6.0  # half cycles over remainders: a correlation of 0.85 makes it 5.5, and is noise
STRONG = 0.1  # of the largest variance: combinations of a window that the filter let pass
LEAST_LEFT = 1e-3  # of the noise's variance, at least, in the largest


def filtered_noise(recordings: Sequence[Recording], smoothing: Smoothing) -> Noise:
    """The level before the filter, no less than it is."""
    period, found = min(period_of(r) for r in recordings), []
    hums = [find_hum(r.samples, r.interval) for r in recordings]
    for per_period in WINDOWS_PER_PERIOD:
        length = int(np.clip(period / per_period, SMALLEST, LARGEST))
        for turns in (True,) if recordings[0].order == 0 else (True, False):
            remainder = remainder_of(recordings, hums, length, turns, smoothing)
            if remainder is not None:
                found.append(_level(remainder, smoothing, recordings[0].interval))
    if not found:
        total = sum(r.samples.size for r in recordings)
        raise InputError("noise estimate", f"{total} samples in all", f"at least {5 * SMALLEST}")
    level, error = min(
        [one for one in found if one[1] <= LARGEST_ERROR] or found,
        key=lambda one: one[0] * (1 + SURE * one[1]),
    )
    source = "polynomial remainders behind the filter, a bound"
    return Noise(0.0, smoothing, level, error, 0.0, source, is_bound=True)


def lower(cycles: Noise | None, bound: Noise) -> Noise:
    """What half cycles of free decays say, or the bound where that is lower by far.

    A bound no longer: polynomials follow a free motion. It stays one where half cycles say nothing.
    """
    if cycles is None:
        return bound
    if cycles.level <= FAR * bound.level:
        return cycles
    return replace(bound, source="polynomial remainders behind the filter", is_bound=False)


def _level(
    remainder: PolynomialRemainder, smoothing: Smoothing, interval: float
) -> tuple[float, float]:
    """Level of the raw noise of which the filter would leave this, and its relative error.

    Of the combinations that the filter let pass: in others rounding and motion count more.
    """
    basis = remainder.basis
    left = basis.T @ covariance(smoothing, interval, basis.shape[0]) @ basis
    power, vectors = np.linalg.eigh(left)
    strong = power > STRONG * power[-1]
    energy = np.sum((remainder.values @ vectors[:, strong]) ** 2 / power[strong], axis=1)
    freedom = int(strong.sum())
    usual = float(np.median(energy)) / stats.chi2.median(freedom)
    kept = energy[energy <= usual * stats.chi2.ppf(KEPT, freedom)]
    if not kept.size or power[-1] < LEAST_LEFT:
        return np.inf, np.inf
    return float(np.sqrt(kept.mean() / freedom)), float(np.sqrt(0.5 / (kept.size * freedom)))
