"""Local polynomial fits on equally spaced samples: crossings and extremes below the noise.

Every fit uses the widest window of a ladder whose polynomial leaves nothing but noise, so that the
window shrinks by itself where the motion has a kink (the impact on the stop) and grows where only
noise limits it. Where no window passes, the cubic spline through the samples decides.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.polynomial import polynomial
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

LADDER = tuple(sorted({round(4 * 1.25**k) for k in range(40)}, reverse=True))


def noise_level(samples: Floats, period: float) -> float:
    """Standard deviation of the noise of a smooth signal, robust against a few kinks.

    Parameters
    ----------
    samples : (n,) signal
    period : rough period of the motion, in samples

    Returns
    -------
    The larger of two estimates, in the unit of the samples: from sixth differences (white noise
    only) and from the residuals of local quartic fits over an eighth of a period, which also see
    rounding and noise that a smoothing filter has left with a correlation. Both are medians over
    the record, so that the few samples around an impact do not count.
    """
    n = samples.size
    level = 0.0
    if n >= 16:
        difference = np.diff(samples, 6)
        level = float(np.median(np.abs(difference))) / (0.6745 * math.sqrt(math.comb(12, 6)))
    half = int(period / 16)
    if half >= 4 and n > 4 * half:
        centres = np.arange(half, n - half, half)
        _, rms = fit(samples, centres, half, 4)
        level = max(level, float(np.median(rms)))
    return level


def fit(samples: Floats, centres: Ints, half: int, degree: int) -> tuple[Floats, Floats]:
    """Least-squares polynomials over windows of 2 half + 1 samples.

    Parameters
    ----------
    samples : (n,) signal, n > 2 half
    centres : (k,) index of the middle sample; windows are moved inwards at the ends
    half : half width in samples
    degree : of the polynomials, below 2 half

    Returns
    -------
    (k, degree + 1) coefficients of x = (index - centre) / half, lowest order first, with the centre
    clipped to [half, n - 1 - half], and the (k,) residual standard deviations.
    """
    x = np.linspace(-1.0, 1.0, 2 * half + 1)
    basis = np.vander(x, degree + 1, increasing=True)
    middle = np.clip(centres, half, samples.size - 1 - half)
    window = samples[middle[:, None] + np.arange(-half, half + 1)]
    coefficients = window @ np.linalg.pinv(basis).T
    left = window - coefficients @ basis.T
    rms = np.sqrt((left**2).sum(axis=1) / (2 * half - degree))
    return coefficients, rms


def crossings(samples: Floats, centres: Ints, caps: Floats, noise: float) -> Floats:
    """Where the signal passes zero near the given samples.

    Parameters
    ----------
    samples : (n,) signal relative to the level
    centres : (k,) sample before each change of sign
    caps : (k,) largest half width of a window, samples
    noise : standard deviation of the noise

    Returns
    -------
    (k,) crossing positions in samples (not integers).
    """
    position = _spline_roots(samples, centres)
    open_ = np.ones(centres.size, dtype=bool)
    nearest = np.rint(position).astype(np.intp)
    for half in LADDER:
        use = np.flatnonzero(open_ & (caps >= half))
        if use.size == 0 or samples.size <= 2 * half:
            continue
        coefficients, rms = fit(samples, nearest[use], half, 3)
        middle = np.clip(nearest[use], half, samples.size - 1 - half)
        x = (position[use] - middle) / half
        for _ in range(6):
            value, slope = _value_and_slope(coefficients, x)
            x = np.clip(x - value / np.where(slope == 0, np.inf, slope), -1.0, 1.0)
        good = (rms <= noise * _slack(2 * half - 3)) & (np.abs(x) < 0.9)
        position[use[good]] = middle[good] + half * x[good]
        open_[use[good]] = False
    return position


def extremes(
    samples: Floats, first: Ints, last: Ints, sign: NDArray[np.int_], noise: float
) -> tuple[Floats, Floats]:
    """The largest excursion inside each half cycle.

    Parameters
    ----------
    samples : (n,) signal
    first, last : (k,) first and last sample of each half cycle, inclusive
    sign : (k,) +1 to look for a maximum, -1 for a minimum
    noise : standard deviation of the noise

    Returns
    -------
    (k,) positions in samples and (k,) values of the signal there.
    """
    peak = np.array(
        [
            a + int(np.argmax(s * samples[a : b + 1]))
            for a, b, s in zip(first, last, sign, strict=True)
        ],
        dtype=np.intp,
    )
    position, value = _three_point(samples, peak)
    caps = 0.3 * (last - first)
    # The raw maximum of a flat, noisy top may sit anywhere on it: centre the window instead.
    centre = np.where(caps > 12, np.clip(peak, first + caps, last - caps), peak).astype(np.intp)
    open_ = np.ones(peak.size, dtype=bool)
    for half in LADDER:
        use = np.flatnonzero(open_ & (caps >= half))
        if use.size == 0 or samples.size <= 2 * half:
            continue
        coefficients, rms = fit(samples, centre[use], half, 4)
        middle = np.clip(centre[use], half, samples.size - 1 - half)
        x, top = _tops(coefficients * sign[use, None])
        good = (rms <= noise * _slack(2 * half - 4)) & (np.abs(x) < 0.95)
        chosen = use[good]
        position[chosen] = middle[good] + half * x[good]
        value[chosen] = sign[chosen] * top[good]
        open_[chosen] = False
        centre = np.where(open_, peak, centre)
    return position, value


def _slack(freedom: int) -> float:
    """Upper 99 % point or so of a residual standard deviation over the true one."""
    return 1.1 + 1.8 / math.sqrt(max(freedom, 1))


def _value_and_slope(coefficients: Floats, x: Floats) -> tuple[Floats, Floats]:
    value = polynomial.polyval(x, coefficients.T, tensor=False)
    slope = polynomial.polyval(x, polynomial.polyder(coefficients.T), tensor=False)
    return np.asarray(value, dtype=np.float64), np.asarray(slope, dtype=np.float64)


def _tops(coefficients: Floats) -> tuple[Floats, Floats]:
    """Position in [-1, 1] and value of the maximum of each polynomial."""
    grid = np.linspace(-1.0, 1.0, 41)
    x = grid[np.argmax(polynomial.polyval(grid, coefficients.T), axis=1)]
    slope = polynomial.polyder(coefficients.T)
    bend = polynomial.polyder(slope)
    for _ in range(4):
        curvature = np.minimum(polynomial.polyval(x, bend, tensor=False), -1e-300)
        step = polynomial.polyval(x, slope, tensor=False) / curvature
        x = np.clip(x - np.clip(step, -0.05, 0.05), -1.0, 1.0)
    return x, polynomial.polyval(x, coefficients.T, tensor=False)


def _three_point(samples: Floats, peak: Ints) -> tuple[Floats, Floats]:
    """Extreme of the cubic spline through the samples around `peak` (by parabola, then spline)."""
    inner = np.clip(peak, 1, samples.size - 2)
    left, mid, right = samples[inner - 1], samples[inner], samples[inner + 1]
    bend = left - 2 * mid + right
    shift = np.where(bend == 0, 0.0, 0.5 * (left - right) / np.where(bend == 0, 1.0, bend))
    position = inner + np.clip(shift, -1.0, 1.0)
    spline = _spline(samples)
    for _ in range(3):
        curvature = spline(position, 2)
        step = np.where(
            curvature == 0, 0.0, spline(position, 1) / np.where(curvature == 0, 1, curvature)
        )
        position = np.clip(position - np.clip(step, -0.3, 0.3), inner - 1.0, inner + 1.0)
    return position, np.asarray(spline(position), dtype=np.float64)


def _spline_roots(samples: Floats, centres: Ints) -> Floats:
    """Roots of the cubic spline between the samples `centres` and `centres + 1`, by bisection."""
    spline = _spline(samples)
    low, high = centres.astype(np.float64), centres + 1.0
    rising = samples[centres] < samples[centres + 1]
    for _ in range(45):
        middle = 0.5 * (low + high)
        above = (np.asarray(spline(middle)) > 0) == rising
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    return 0.5 * (low + high)


def _spline(samples: Floats) -> CubicSpline:
    return CubicSpline(np.arange(samples.size), samples)
