"""Colour of the noise from where there is no motion: residuals well above all natural frequencies.

Short windows say little about strongly correlated noise, and an error in its correlation is an
error in the noise where the motion is. A fit takes the motion out of the recordings; what it may
have left out of the physics moves the mass below a few times the contact's natural frequency. The
periodogram of its residuals above that is noise whatever the model lacks (Whittle 1953).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from bayesimpact.inference.fit import Fit
from bayesimpact.inference.noise import Noise

Array = NDArray[np.float64]

ABOVE = 2.0  # times the fastest natural frequency
LEAST_ORDINATES = 200
GROSS = 4.0  # chi-squared per sample from which on a residual is no longer nearly noise
BEND = 0.01  # step in the correlation for the curvature of the likelihood


def refined_noise(fit: Fit) -> Noise:
    """The fit's noise with correlation and level from its residuals above the motion.

    The same noise when it is white, when the recordings are smoothed, when the model misses grossly
    or when too little lies above the motion.
    """
    noise = fit.target.likelihood.noise
    if noise.correlation == 0.0 or noise.smoothing is not None or fit.reduced_chi2 > GROSS:
        return noise
    angle, power = _ordinates(fit, lowest := ABOVE * fastest_frequency(fit))
    if power.size < LEAST_ORDINATES:
        return noise

    rounding = rounding_variance(fit) / noise.level**2  # white, whatever the noise is

    def variance(rho: float) -> float:
        return float(np.mean(power / (_shape(angle, rho) + rounding)))

    def negative(rho: float) -> float:
        spread = power.size * np.log(variance(rho))
        return float(np.sum(np.log(_shape(angle, rho) + rounding)) + spread)

    rho = float(minimize_scalar(negative, bounds=(-0.6, 0.99), method="bounded").x)
    step = min(BEND, 0.5 * (1.0 - abs(rho)))
    bend = negative(rho + step) + negative(rho - step) - 2 * negative(rho)
    error = float(step / np.sqrt(max(bend, step**2)))
    lean = 0.25 * np.log(variance(rho + step) / variance(rho - step)) / step
    return replace(
        noise,
        correlation=rho,
        correlation_error=error,
        level=float(np.sqrt(variance(rho))) if noise.level_error else noise.level,
        level_error=float(np.hypot(np.sqrt(0.5 / power.size), error * lean))
        if noise.level_error
        else 0.0,
        source=f"residuals above {lowest:.3g} Hz",
    )


def fastest_frequency(fit: Fit) -> float:
    """Natural frequency in contact with the stiffest obstacle, or of the oscillator alone, Hz."""
    values = dict(zip(fit.names, fit.mode, strict=True))
    stiffest = max((v for n, v in values.items() if n.startswith("k2")), default=0.0)
    mass = fit.target.oscillator.campaign.mass
    return float(np.sqrt((values["k1"] + stiffest) / mass) / (2 * np.pi))


def rounding_variance(fit: Fit) -> float:
    """Mean variance of what rounding adds, m2: a twelfth of the squared last digit."""
    recordings = fit.target.oscillator.campaign.recordings
    digits = [np.diff(np.unique(r.samples)).min(initial=np.inf) for r in recordings]
    return float(np.mean(np.square(digits)) / 12) if np.isfinite(digits).all() else 0.0


def _ordinates(fit: Fit, lowest: float) -> tuple[Array, Array]:
    """Angular frequencies per sample and periodogram ordinates above `lowest` Hz, m2."""
    angles, powers = [], []
    for residual, interval in zip(fit.residuals, fit.target.oscillator.intervals, strict=True):
        angle = 2 * np.pi * np.fft.rfftfreq(residual.size)
        kept = (angle > 2 * np.pi * lowest * interval) & (angle < np.pi * (1 - 1e-9))
        angles.append(angle[kept])
        powers.append((np.abs(np.fft.rfft(residual)) ** 2 / residual.size)[kept])
    return np.concatenate(angles), np.concatenate(powers)


def _shape(angle: Array, rho: float) -> Array:
    return np.asarray((1 - rho**2) / (1 - 2 * rho * np.cos(angle) + rho**2))
