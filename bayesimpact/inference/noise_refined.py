"""Colour of the noise from where there is no motion: residuals well above all natural frequencies.

Short windows say little about strongly correlated noise, and an error in its correlation is an
error in the noise where the motion is. A fit takes the motion out of the recordings; what it may
have left out of the physics moves the mass below a few times the contact's natural frequency. The
periodogram of its residuals above that is noise whatever the model lacks (Whittle 1953), but for
the lines of a hum. Behind a filter, half swings tell the level of the noise and nothing of its
colour: what the filter let pass of it is compared with what it makes of white noise.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from bayesimpact.inference.fit import Fit
from bayesimpact.inference.noise import Noise
from bayesimpact.inference.spectrum import without_lines
from bayesimpact.model.measurement import gain

Array = NDArray[np.float64]

ABOVE = 2.0  # times the fastest natural frequency
LEAST_ORDINATES = 200
GROSS = 4.0  # chi-squared per sample from which on a residual is no longer nearly noise
PASSED = 0.05  # of the power, at least: what a filter has left of noise more than of anything else
COLOURED = 20.0  # nats over white noise, behind a filter
BEND = 0.01  # step in the correlation for the curvature of the likelihood


def refined_noise(fit: Fit) -> Noise:
    """The fit's noise with correlation and level from its residuals above the motion.

    The same noise when it is white, when the model misses grossly or when too little lies above the
    motion.
    """
    noise = fit.target.likelihood.noise
    if (noise.correlation == 0.0 and noise.smoothing is None) or fit.reduced_chi2 > GROSS:
        return noise
    angle, power, passed = _ordinates(fit, lowest := ABOVE * fastest_frequency(fit))
    if power.size < LEAST_ORDINATES:
        return noise

    rounding = rounding_variance(fit) / noise.level**2  # white, whatever the noise is

    def shape(rho: float) -> Array:
        return passed * _shape(angle, rho) + rounding

    def variance(rho: float) -> float:
        return float(np.mean(power / shape(rho)))

    def negative(rho: float) -> float:
        return float(np.sum(np.log(shape(rho))) + power.size * np.log(variance(rho)))

    rho = float(minimize_scalar(negative, bounds=(-0.6, 0.99), method="bounded").x)
    if noise.correlation == 0.0 and negative(0.0) - negative(rho) < COLOURED:
        return noise
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


def _ordinates(fit: Fit, lowest: float) -> tuple[Array, Array, Array]:
    """Angular frequencies per sample, periodogram ordinates above `lowest` Hz, m2, and the power
    that the filter let pass there.
    """
    found, smoothing = [], fit.target.oscillator.smoothing
    for residual, interval in zip(fit.residuals, fit.target.oscillator.intervals, strict=True):
        frequency = np.fft.rfftfreq(residual.size, interval)
        kept = (frequency > lowest) & (frequency < 0.5 / interval * (1 - 1e-9))
        kept &= gain(smoothing, interval, frequency) ** 2 > PASSED
        power = np.abs(np.fft.rfft(residual)) ** 2 / residual.size
        frequency, power, _ = without_lines(frequency[kept], power[kept], interval)
        passed = gain(smoothing, interval, frequency) ** 2
        found.append((2 * np.pi * frequency * interval, power, passed))
    angles, powers, shares = zip(*found, strict=True)
    return np.concatenate(angles), np.concatenate(powers), np.concatenate(shares)


def _shape(angle: Array, rho: float) -> Array:
    return np.asarray((1 - rho**2) / (1 - 2 * rho * np.cos(angle) + rho**2))
