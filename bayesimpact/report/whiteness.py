"""Are residuals white? For information: refitting hides most of a missing effect from this."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from bayesimpact.diagnosis.whiteness import ljung_box

Array = NDArray[np.float64]


def flat_spectrum(power: Array) -> float:
    """p-value that powers in the order of frequency are of one level (Bartlett's cumulative test).

    Largest distance of the normalised cumulative power from the straight line (Kolmogorov-Smirnov;
    Bartlett 1955).

    Parameters
    ----------
    power : (m,) squared Fourier coefficients, each the sum of two squares
    """
    total = float(power.sum())
    if power.size < 3 or total == 0.0:
        return float("nan")
    # m exponential variables over their sum: m - 1 order statistics of uniform ones.
    return float(stats.kstest(np.cumsum(power)[:-1] / total, "uniform").pvalue)


def whiteness(white: Array, banded: bool) -> float:
    """p-value of a whitened residual.

    Parameters
    ----------
    white : (n,) numbers of `inference.noise.Noise.whiten`
    banded : they are Fourier coefficients (mean, real parts, imaginary parts) instead of a series
    """
    if not banded:
        return ljung_box(white)
    real, imaginary = np.split(white[1:], 2)
    return flat_spectrum(real**2 + imaginary**2)
