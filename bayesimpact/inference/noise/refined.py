"""Colour of the noise from where there is no motion: residuals well above all natural frequencies.

Short windows say little about strongly correlated noise, and an error in its correlation is an
error in the noise where the motion is. A fit takes the motion out of the recordings; what it may
have left out of the physics moves the mass below a few times the contact's natural frequency. The
periodogram of its residuals above that is noise whatever the model lacks (Whittle 1953), but for
the lines of a hum. Behind a filter, half cycles tell the level of the noise and nothing of its
colour: what the filter let pass of it is compared with what it makes of white noise.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.inference.fit import Fit
from bayesimpact.inference.noise.ordinates import Ordinates
from bayesimpact.inference.noise.spectrum import without_lines
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.measurement import magnitude_response

Array = NDArray[np.float64]

ABOVE = 2.0  # times the fastest natural frequency
LEAST_ORDINATES = 200
LARGE_MISFIT = 4.0  # chi-squared per sample from which on a residual is no longer nearly noise
PASSED = 0.05  # of the power, at least: what a filter has left of noise more than of anything else
COLOURED = 20.0  # nats over white noise, behind a filter


def refined_noise(fit: Fit) -> Noise:
    """The fit's noise with correlation and level from its residuals above the motion.

    The same noise when it is white, when the model misses by far or when too little lies above the
    motion.
    """
    noise = fit.density.likelihood.noise
    if noise.is_bound and fit.reduced_chi2 < 1.0:
        error = float(np.sqrt(0.5 / fit.density.likelihood.sizes.sum()))
        # of the noise before a filter; the residual's rms is that behind it
        level = noise.level * float(np.sqrt(fit.reduced_chi2))
        told = replace(noise, level=level, level_error=error, is_independent=False)
        return replace(told, source="residual of the base model")
    plain = noise.correlation == 0.0 and noise.smoothing is None
    # of coarse steps the residual is rounding, which no correlation describes
    plain = plain or any(fit.density.likelihood.steps)
    if plain or fit.reduced_chi2 > LARGE_MISFIT or fit.density.oscillator.campaign.mixed:
        return noise
    found = _ordinates(fit, lowest := ABOVE * fastest_frequency(fit))
    if found.power.size < LEAST_ORDINATES:
        return noise
    rho = found.correlation()
    if noise.correlation == 0.0 and found.cost(0.0) - found.cost(rho) < COLOURED:
        return noise
    error, level_error = found.errors(rho)
    refined = replace(
        noise,
        correlation=rho,
        correlation_error=error,
        source=f"residuals above {lowest:.3g} Hz",
    )
    if not noise.level_error:  # known beforehand
        return refined
    return replace(refined, level=float(np.sqrt(found.variance(rho))), level_error=level_error)


def fastest_frequency(fit: Fit) -> float:
    """Natural frequency in contact with the stiffest obstacle, or of the oscillator alone, Hz."""
    values = dict(zip(fit.names, fit.mode, strict=True))
    stiffest = max((v for n, v in values.items() if n.startswith("k2")), default=0.0)
    mass = fit.density.oscillator.campaign.mass
    return float(np.sqrt((values["k1"] + stiffest) / mass) / (2 * np.pi))


def rounding_variance(fit: Fit) -> float:
    """Mean variance of what rounding adds, m2: a twelfth of the squared last digit."""
    recordings = fit.density.oscillator.campaign.recordings
    read = [r.samples if r.used is None else r.samples[r.used] for r in recordings]
    digits = [np.diff(np.unique(samples)).min(initial=np.inf) for samples in read]
    return float(np.mean(np.square(digits)) / 12) if np.isfinite(digits).all() else 0.0


def _ordinates(fit: Fit, lowest: float) -> Ordinates:
    """Of all recordings above `lowest` Hz, but for lines and what a filter has suppressed."""
    found, smoothing = [], fit.density.oscillator.smoothing
    recordings = fit.density.oscillator.campaign.recordings
    for residual, recording in zip(fit.residuals, recordings, strict=True):
        interval = recording.interval
        frequency: Array = np.fft.rfftfreq(residual.size, interval).astype(np.float64)
        kept = (frequency > lowest) & (frequency < 0.5 / interval * (1 - 1e-9))
        kept &= magnitude_response(smoothing, interval, frequency) ** 2 > PASSED
        power = np.abs(np.fft.rfft(residual)) ** 2 / recording.count
        frequency, power, _ = without_lines(frequency[kept], power[kept], interval)
        passed = magnitude_response(smoothing, interval, frequency) ** 2
        found.append((2 * np.pi * frequency * interval, power, passed))
    angle, power, passed = (np.concatenate(parts) for parts in zip(*found, strict=True))
    rounding = rounding_variance(fit) / fit.density.likelihood.noise.level**2
    return Ordinates(angle, power, passed, rounding)
