"""How often a residual repeats itself: how many of its samples tell something new."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.hum import find_hum
from bayesimpact.data.recording import Recording
from bayesimpact.inference.fit import Fit

Array = NDArray[np.float64]

WHITE_SD = 4.0  # one lag of 16,000 of white noise lies beyond: none in a recording


def residual_repetition(fit: Fit) -> float:
    """Samples per independent one in a residual, as far as its variance is concerned; at least 1.

    n / n_eff = 1 + 2 sum (1 - k/n) rho_k^2 for a stationary Gaussian series (Bayley and Hammersley
    1946, for the variance): what a comparison of residual variances rests on. Correlations that
    white noise would show, up to `WHITE_SD` standard errors 1 / sqrt(n), count nothing. Nor does a
    steady hum beside the motion: it repeats itself for ever, and hides nothing of what moves.
    """
    total = effective = 0.0
    recordings = fit.density.oscillator.campaign.recordings
    for part, recording in zip(fit.linearisation, recordings, strict=True):
        x = _without_hum(part.residual, recording)
        x = x - x.mean()
        n = x.size
        power = np.abs(np.fft.rfft(x, 2 * n)) ** 2
        rho = np.fft.irfft(power)[:n]
        rho = rho / max(rho[0], 1e-300)
        seen = np.where(np.abs(rho) > WHITE_SD / np.sqrt(n), rho, 0.0)[1:]
        weights = 1.0 - np.arange(1, n) / n
        total += n
        effective += n / (1.0 + 2.0 * float(np.sum(weights * seen**2)))
    return max(1.0, total / effective)


def _without_hum(residual: Array, recording: Recording) -> Array:
    """A residual less the steady hum that it shows, if any; a driven motion may be one itself."""
    told = recording.input is None and residual.size == recording.samples.size
    hum = find_hum(residual, recording.interval, recording.samples) if told else None
    return residual if hum is None else residual - hum.readings(recording.times)
