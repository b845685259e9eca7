"""Local polynomial fits on equally spaced samples: crossings and extremes below the noise.

Every fit uses the widest window of a ladder whose polynomial leaves nothing but noise, so that the
window shrinks by itself where the motion has a kink (the impact on the stop) and grows where only
noise limits it. Where no window passes, the cubic spline through the samples decides.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
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
    basis, inverse = _window(half, degree)
    middle = np.clip(centres, half, samples.size - 1 - half)
    window = samples[middle[:, None] + np.arange(-half, half + 1)]
    coefficients = window @ inverse.T
    left = window - coefficients @ basis.T
    rms = np.sqrt((left**2).sum(axis=1) / (2 * half - degree))
    return coefficients, rms


@lru_cache(maxsize=256)
def _window(half: int, degree: int) -> tuple[Floats, Floats]:
    """Powers at the samples of a window, and their pseudoinverse: met again in every signal."""
    basis = np.vander(np.linspace(-1.0, 1.0, 2 * half + 1), degree + 1, increasing=True)
    inverse = np.asarray(np.linalg.pinv(basis), dtype=np.float64)
    basis.setflags(write=False)
    inverse.setflags(write=False)
    return basis, inverse


def crossings(
    samples: Floats,
    centres: Ints,
    caps: Floats,
    noise: float,
    spline: CubicSpline | None = None,
) -> Floats:
    """Where the signal passes zero near the given samples.

    Parameters
    ----------
    samples : (n,) signal relative to the level
    centres : (k,) sample before each change of sign
    caps : (k,) largest half width of a window, samples
    noise : standard deviation of the noise
    spline : `cubic` of the samples, where it is known already

    Returns
    -------
    (k,) crossing positions in samples (not integers).
    """
    position = _spline_roots(cubic(samples) if spline is None else spline, samples, centres)
    open_ = np.ones(centres.size, dtype=bool)
    nearest = np.rint(position).astype(np.intp)
    for half in LADDER:
        use = np.flatnonzero(open_ & (caps >= half))
        if use.size == 0 or samples.size <= 2 * half:
            continue
        coefficients, rms = fit(samples, nearest[use], half, 3)
        passed = rms <= noise * _slack(2 * half - 3)
        use, powers = use[passed], coefficients[passed].T
        if use.size == 0:
            continue
        slopes = _derivative(powers)
        middle = np.clip(nearest[use], half, samples.size - 1 - half)
        x = (position[use] - middle) / half
        for _ in range(6):
            slope = _polynomial(slopes, x)
            step = _polynomial(powers, x) / np.where(slope == 0, np.inf, slope)
            x = _within(x - step, 1.0)
        good = np.abs(x) < 0.9
        position[use[good]] = middle[good] + half * x[good]
        open_[use[good]] = False
    return position


def extremes(
    samples: Floats,
    first: Ints,
    last: Ints,
    sign: NDArray[np.int_],
    noise: float,
    spline: CubicSpline | None = None,
) -> tuple[Floats, Floats]:
    """The largest excursion inside each half cycle.

    Parameters
    ----------
    samples : (n,) signal
    first, last : (k,) first and last sample of each half cycle, inclusive
    sign : (k,) +1 to look for a maximum, -1 for a minimum
    noise : standard deviation of the noise
    spline : `cubic` of the samples, where it is known already

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
    spline = cubic(samples) if spline is None else spline
    position, value = _three_point(spline, samples, peak)
    caps = 0.3 * (last - first)
    # The raw maximum of a flat, noisy top may sit anywhere on it: centre the window instead.
    centre = np.where(caps > 12, np.clip(peak, first + caps, last - caps), peak).astype(np.intp)
    open_ = np.ones(peak.size, dtype=bool)
    for half in LADDER:
        use = np.flatnonzero(open_ & (caps >= half))
        if use.size == 0 or samples.size <= 2 * half:
            continue
        coefficients, rms = fit(samples, centre[use], half, 4)
        passed = rms <= noise * _slack(2 * half - 4)
        use, powers = use[passed], (coefficients[passed] * sign[use[passed], None]).T
        if use.size:
            middle = np.clip(centre[use], half, samples.size - 1 - half)
            x, top = _tops(powers)
            good = np.abs(x) < 0.95
            chosen = use[good]
            position[chosen] = middle[good] + half * x[good]
            value[chosen] = sign[chosen] * top[good]
            open_[chosen] = False
        centre = np.where(open_, peak, centre)
    return position, value


def _slack(freedom: int) -> float:
    """Upper 99 % point or so of a residual standard deviation over the true one."""
    return 1.1 + 1.8 / math.sqrt(max(freedom, 1))


def _tops(powers: Floats) -> tuple[Floats, Floats]:
    """Position in [-1, 1] and value of the maximum of each polynomial, (degree + 1, k)."""
    grid = np.linspace(-1.0, 1.0, 41)
    x = grid[np.argmax(_polynomial(powers[:, :, None], grid), axis=1)]
    slope = _derivative(powers)
    bend = _derivative(slope)
    for _ in range(4):
        curvature = np.minimum(_polynomial(bend, x), -1e-300)
        x = _within(x - _within(_polynomial(slope, x) / curvature, 0.05), 1.0)
    return x, _polynomial(powers, x)


def _polynomial(powers: Floats, x: Floats) -> Floats:
    """Polynomials at x by Horner; `powers` (degree + 1, ...), lowest order first. NumPy's own takes
    ten times as long on arrays so small.
    """
    value = np.asarray(powers[-1])
    for power in powers[-2::-1]:
        value = power + value * x
    return value


def _derivative(powers: Floats) -> Floats:
    return np.asarray(powers[1:] * np.arange(1.0, len(powers))[:, None])


def _within(x: Floats, most: float) -> Floats:
    """`np.clip` between -most and most, in a third of its time on arrays so small."""
    return np.asarray(np.minimum(np.maximum(x, -most), most))


def _three_point(spline: CubicSpline, samples: Floats, peak: Ints) -> tuple[Floats, Floats]:
    """Extreme of the cubic spline through the samples around `peak` (by parabola, then spline)."""
    inner = np.clip(peak, 1, samples.size - 2)
    left, mid, right = samples[inner - 1], samples[inner], samples[inner + 1]
    bend = left - 2 * mid + right
    shift = np.where(bend == 0, 0.0, 0.5 * (left - right) / np.where(bend == 0, 1.0, bend))
    position = inner + np.clip(shift, -1.0, 1.0)
    for _ in range(3):
        curvature = spline(position, 2)
        step = np.where(
            curvature == 0, 0.0, spline(position, 1) / np.where(curvature == 0, 1, curvature)
        )
        position = np.clip(position - np.clip(step, -0.3, 0.3), inner - 1.0, inner + 1.0)
    return position, np.asarray(spline(position), dtype=np.float64)


def _spline_roots(spline: CubicSpline, samples: Floats, centres: Ints) -> Floats:
    """Roots of the cubic spline between the samples `centres` and `centres + 1`, by bisection."""
    powers = spline.c[::-1, centres]
    low, high = np.zeros(centres.size), np.ones(centres.size)
    rising = samples[centres] < samples[centres + 1]
    for _ in range(45):
        middle = 0.5 * (low + high)
        above = (_polynomial(powers, middle) > 0) == rising
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    return np.asarray(centres + 0.5 * (low + high))


def cubic(samples: Floats) -> CubicSpline:
    """The cubic spline through samples."""
    return CubicSpline(np.arange(samples.size), samples)
