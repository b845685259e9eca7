"""Noise of recordings with a measured input, where the motion is as fast as the input.

Polynomials over short windows follow a slow motion, driven or not. Where a window of the fewest
samples spans more than a part of a period, what they leave is motion. The spectrum then tells the
noise where the input has none: above its band. Nonlinear distortion may fall there too, and the
recorder's own filter cuts noise; both show as a floor that is not flat, of which the loudest part
is taken: no less than the noise is. Nor are the polynomials' remainders, and the lower one counts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.recording import Recording
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.response.driven_displacement import seen_displacement
from bayesimpact.response.half_cycles import spectral_period

Array = NDArray[np.float64]

SHORTEST_PERIOD = 36.0  # samples: three windows of twelve
# ordinates of a band, over which powers are averaged: as many as leave a gap that is wide enough,
# for of a sixteenth as many the median errs by 9 % in level
BANDS = (64, 32, 16)
# of a band's ordinates, the strongest: a line of a million times the rest's power reaches no
# farther through the window, whose side lobes fall with the sixth power of the distance
LINE = 1 / 4
SILENT = 1e-3  # of the input's strongest band: below, it leaves a gap
LEAST_BANDS = 4  # above the input's own
TOP = 0.98  # of half the sampling rate: beyond, a recorder's filter may end
FLAT = 4.0  # loudest over quietest band, in power, up to which a floor is flat
MEDIAN = float(np.log(2.0))  # of an ordinate of white noise, over its mean


def driven_noise(recordings: Sequence[Recording], remainders: Noise) -> Noise:
    """The level from the gaps that the inputs leave, or what the polynomial `remainders` say.

    The latter where the motion is slow against the sampling, or no input leaves a gap: the source
    then says that they are no more than a bound, which the residual of a fit may lower.
    """
    moved = ((r, seen_displacement(r).samples) for r in recordings)
    fast = [r for r, y in moved if spectral_period(y) < SHORTEST_PERIOD]
    if not fast:
        return remainders
    floors = [bands for r in fast if (bands := _gap(r)) is not None]
    powers = np.concatenate([found for found, _ in floors]) if floors else np.full(1, np.inf)
    numbers = sum(found.size * width for found, width in floors)
    flat = float(powers.max()) <= FLAT * float(powers.min())
    power = float(np.mean(powers) if flat else powers.max())
    if remainders.level**2 < power:  # impacts may fill the gap of a velocity or acceleration
        bound = "polynomial remainders, a bound: the motion is fast and leaves no gap"
        return replace(remainders, correlation=0.0, source=bound, is_bound=True)
    said = "" if flat else ", its loudest part"
    return Noise(
        level=float(np.sqrt(power)),
        level_error=float(np.sqrt(0.5 / numbers)),
        correlation_error=0.0,
        source=f"spectrum above the input's band{said}",
        is_bound=not flat,
    )


def _gap(recording: Recording) -> tuple[Array, int] | None:
    """Mean powers per sample, m2, of bands above the input's own, and how many ordinates each has;
    None where there are few.

    A hum in the input, one line, is not its band.
    """
    assert recording.input is not None
    driving, response = powers(recording.input.samples), powers(recording.samples)
    for width in BANDS:
        count = int(TOP * driving.size) // width
        if count < LEAST_BANDS:
            continue
        ordinates = np.sort(driving[: count * width].reshape(count, width), axis=1)
        bands = ordinates[:, : -int(LINE * width)].mean(axis=1)
        loud = np.flatnonzero(bands > SILENT * bands.max())
        first = int(loud[-1]) + 2 if loud.size else 0  # a window leaks into its neighbour
        if count - first >= LEAST_BANDS:
            own = response[first * width : count * width].reshape(-1, width)
            return np.asarray(np.median(own, axis=1) / MEDIAN), width  # blind to lines of a hum
    return None


def powers(samples: Array) -> Array:
    """Periodogram under a Hann window, (n // 2 + 1,), of mean 1 for white noise of variance 1."""
    window = np.hanning(samples.size)
    spectrum = np.fft.rfft((samples - samples.mean()) * window)
    return np.asarray(np.abs(spectrum) ** 2 / np.sum(window**2))
