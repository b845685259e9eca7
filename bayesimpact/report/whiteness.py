"""Are residuals white? For information: refitting hides most of a missing effect from this."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from bayesimpact.diagnosis.measurement.whiteness import ljung_box
from bayesimpact.inference.fit import Fit

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


def whiteness(fit: Fit, r: int) -> float:
    """p-value of a recording's whitened residual.

    Behind a filter the numbers are Fourier coefficients: their powers must be of one level.
    """
    white, noise = fit.linearisation[r].residual, fit.density.likelihood.noise
    if noise.smoothing is None:
        return ljung_box(white)
    recording = fit.density.oscillator.campaign.recordings[r]
    n, interval = recording.samples.size, recording.interval
    return flat_spectrum(noise.ordinates(white, n, interval, recording.used)[1])
