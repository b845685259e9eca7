"""Noise level and colour from the recordings alone, before any model of the oscillator is believed.

A recording is cut into windows so short that any oscillation is a polynomial of degree five in
them; what the polynomials leave is noise. Level and correlation maximise the likelihood of exactly
these remainders (restricted maximum likelihood, Patterson and Thompson 1971), so no degrees of
freedom are counted twice. Where there is a stop, only cycles on its free side count: impacts are
kinks that no polynomial follows. Of velocities and accelerations only windows between two turning
points count, for dry friction changes its sign there (see `noise.windows`). Windows that something
else disturbs stand out and are left aside. A steady hum is no noise: its sine is fitted to the
remainders of all windows and taken off.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.linalg import toeplitz
from scipy.optimize import minimize_scalar

from bayesimpact.data.campaign import Campaign, Smoothing
from bayesimpact.data.faults.flat import reading_step
from bayesimpact.data.hum import Hum, find_hum
from bayesimpact.data.recording import Recording
from bayesimpact.errors import InputError
from bayesimpact.inference.noise.driven import driven_noise
from bayesimpact.inference.noise.fast import UNTOLD, fast_noise, floor_noise
from bayesimpact.inference.noise.filtered import filtered_noise, lower
from bayesimpact.inference.noise.growth import with_growth
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

Array = NDArray[np.float64]

SHORT = 6  # samples between two turning points of a motion that is sampled coarsely
LEAST_CORRELATION = 0.03  # a weaker AR(1) changes no interval by more than 3 %
LEAST_GAIN = 4.0  # in log likelihood, to call the noise coloured: 1 false call in 200
ROUNDING = 1e-9  # of the largest remainder: what arithmetic leaves of readings that do not change


def estimate_noise(campaign: Campaign) -> Noise:
    """Level and AR(1) correlation of the raw noise, pooled over recordings of one quantity.

    Where there are several quantities, the correlation is that of the first recording's.

    Free decays tell it best: recordings with a measured input only where there is none (see
    `driven_noise`). For recordings that were smoothed the remainders say what the filter left; the
    raw level is scaled up by the filter's power (see `smoothed_level`). Of free decays of
    displacements or angles that passed no filter it is told, too, whether the noise grows
    (`with_growth`).
    """
    known, smoothing = campaign.measurement.noise, campaign.measurement.smoothing
    orders = list(dict.fromkeys(r.order for r in campaign.recordings))
    found = {
        order: _of_one([r for r in campaign.recordings if r.order == order], smoothing)
        for order in orders
    }
    noise = found[orders[0]]
    if len(found) > 1:  # alike everywhere
        first, second, third = (found.get(o, noise).level / noise.level for o in range(3))
        return replace(noise, scales=(first, second, third))
    if known is None:
        # of a bound, what windows leave is motion
        plain = not (smoothing or noise.is_bound) and all(
            r.input is None and r.order == 0 for r in campaign.recordings
        )
        return with_growth(noise, campaign.recordings) if plain else noise
    return Noise(noise.correlation, smoothing, known, 0.0, noise.correlation_error, "campaign.toml")


def _of_one(recordings: Sequence[Recording], smoothing: Smoothing | None) -> Noise:
    """Of recordings of one quantity, behind a filter or none."""
    if smoothing is None:
        return unfiltered_noise(recordings)
    free = [r for r in recordings if r.input is None]
    if not free:
        return filtered_noise(recordings, smoothing)
    from bayesimpact.inference.noise.spectrum import smoothed_noise

    return lower(smoothed_noise(free, smoothing), filtered_noise(free, smoothing))


def unfiltered_noise(recordings: Sequence[Recording]) -> Noise:
    """Of recordings of one quantity that passed no filter: of free decays, where there are any.

    Raises `InputError` when the recordings are too short.
    """
    free = [r for r in recordings if r.input is None]
    told = free or recordings
    found = _of_windows(told)
    if free:
        found = floor_noise(free, fast_noise(free, found))
    if found is None:
        raise _too_short(told)
    if found.level_error >= UNTOLD:
        found = _white(told) or found
    found = _with_step(found, told)
    return found if free else driven_noise(recordings, found)


def _too_short(recordings: Sequence[Recording]) -> InputError:
    total, least = sum(r.samples.size for r in recordings), 5 * SMALLEST
    if total < least:
        return InputError("noise estimate", f"{total} samples in all", f"at least {least}")
    rows = f"{SMALLEST} samples in a row"
    return InputError("noise estimate", f"hardly any {rows} among {total}", f"{least} in such rows")


def _of_windows(recordings: Sequence[Recording]) -> Noise | None:
    """Level and correlation from polynomial remainders; None where there are too few windows."""
    hums = [find_hum(r.samples, r.interval) for r in recordings]
    found = _longest(recordings, hums, False) if recordings[0].order > 0 else None
    if found is None or any(r.input is not None for r in recordings):
        # under an input few windows fit between turning points: they count where a jump shows
        across = _longest(recordings, hums, True)
        found = found if found and across and _rises(found, across.level) else across
    return found


def _longest(
    recordings: Sequence[Recording], hums: Sequence[Hum | None], turns: bool
) -> Noise | None:
    """What the longest windows say that follow the motion; None where there are too few.

    `turns`: also windows across turning points, where dry friction would show.
    """
    smallest = SMALLEST if turns or any(r.input is not None for r in recordings) else SHORT
    periods = [period_of(r) for r in recordings]
    chosen, numbers = None, 0
    for per_period in WINDOWS_PER_PERIOD:
        length = int(np.clip(min(periods) / per_period, smallest, LARGEST))
        remainder = remainder_of(recordings, hums, length, turns)
        if remainder is None:
            continue
        if not turns and remainder.values.size < numbers:
            break  # hardly any fits between two turning points
        found = _restricted_ml(remainder)
        if chosen is not None and _rises(chosen, found.level, found.level_error):
            break  # the oscillation itself begins to show
        chosen, numbers = found, remainder.values.size
    return chosen


def _white(recordings: Sequence[Recording]) -> Noise | None:
    """White noise of what the shortest windows leave, for readings that tell no level of coloured
    noise: a correlation at the end of its range makes any level of the same remainders.
    """
    hums = [find_hum(r.samples, r.interval) for r in recordings]
    remainder = remainder_of(recordings, hums, SMALLEST, True)
    if remainder is None:
        return None
    white = np.eye(remainder.values.shape[1])
    kept = remainder.values[_undisturbed(remainder.values, white)]
    level, error = float(np.sqrt(_variance(kept, white))), float(np.sqrt(0.5 / kept.size))
    source = "polynomial remainders, whose colour is not told"
    return Noise(0.0, None, level, error, 0.0, source, is_bound=True)


def _with_step(noise: Noise, recordings: Sequence[Recording]) -> Noise:
    """No less than a twelfth of the squared step that readings come in (Sheppard 1898).

    Where a step is coarser than the noise, slow motion stays on one reading for whole windows, and
    their remainders hide it.
    """
    floor = float(np.sqrt(np.mean([reading_step(r.samples) ** 2 for r in recordings]) / 12))
    if noise.level >= floor:
        return noise
    return replace(noise, level=floor, source="the step of the readings")


def _rises(before: Noise, level: float, error: float = 0.0) -> bool:
    """Whether other windows leave more than the errors of both levels explain."""
    return bool(level > before.level * (1.02 + 3 * np.hypot(before.level_error, error)))


def _restricted_ml(remainder: PolynomialRemainder) -> Noise:
    values, rho = remainder.values, 0.0
    sizes = np.abs(values).max(axis=1)
    if np.median(sizes) <= ROUNDING * sizes.max():
        # most windows do not leave a step of the readings: it is their noise
        error = float(np.sqrt(0.5 / values.size))
        return Noise(0.0, None, 0.0, error, 0.0, "polynomial remainders")
    kept = values
    for _ in range(3):  # outlier test and estimate in turn
        kept = values[_undisturbed(values, _covariance(remainder.basis, rho))]
        rho, best = _best_correlation(kept, remainder.basis)
    white = _log_likelihood(kept, np.eye(kept.shape[1]))
    error = _correlation_error(kept, remainder.basis, rho)
    if best - white < LEAST_GAIN or abs(rho) < LEAST_CORRELATION:
        rho = 0.0
    level = np.sqrt(_variance(kept, _covariance(remainder.basis, rho)))
    relative = np.sqrt(
        0.5 / kept.size + (rho != 0.0) * (error * _lean(kept, remainder.basis, rho)) ** 2
    )
    return Noise(rho, None, float(level), float(relative), error, "polynomial remainders")


def _correlation_error(values: Array, basis: Array, rho: float) -> float:
    """Standard error of the correlation, from the bend of the likelihood."""
    step = min(0.01, 0.5 * (1.0 - abs(rho)))
    low, middle, high = (
        _log_likelihood(values, _covariance(basis, rho + d)) for d in (-step, 0.0, step)
    )
    return float(step / np.sqrt(max(2 * middle - low - high, step**2)))


def _lean(values: Array, basis: Array, rho: float) -> float:
    """Derivative of the log level by the correlation: an error of one is an error of the other."""
    step = min(0.01, 0.5 * (1.0 - abs(rho)))
    low, high = (_variance(values, _covariance(basis, rho + d)) for d in (-step, step))
    return float(0.25 * np.log(high / low) / step)


def _best_correlation(values: Array, basis: Array) -> tuple[float, float]:
    found = minimize_scalar(
        lambda rho: -_log_likelihood(values, _covariance(basis, rho)),
        bounds=(-0.6, 0.98),
        method="bounded",
    )
    return float(found.x), -float(found.fun)


def _covariance(basis: Array, rho: float) -> Array:
    return np.asarray(basis.T @ toeplitz(rho ** np.arange(basis.shape[0])) @ basis)


def _energies(values: Array, covariance: Array) -> Array:
    return np.asarray(np.einsum("wi,ij,wj->w", values, np.linalg.inv(covariance), values))


def _undisturbed(values: Array, covariance: Array) -> NDArray[np.bool_]:
    energy, freedom = _energies(values, covariance), values.shape[1]
    scale = np.median(energy) / stats.chi2.median(freedom)
    return np.asarray(energy <= scale * stats.chi2.ppf(KEPT, freedom))


def _variance(values: Array, covariance: Array) -> float:
    return float(_energies(values, covariance).mean() / values.shape[1])


def _log_likelihood(values: Array, covariance: Array) -> float:
    windows, freedom = values.shape
    _, log_det = np.linalg.slogdet(covariance)
    log_volume = freedom * np.log(_variance(values, covariance)) + log_det
    return float(-0.5 * windows * log_volume)
