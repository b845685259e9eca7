"""Noise of free decays that few samples a period show, from the spectrum above their motion.

Polynomials over short windows follow a motion of many samples a period. Of fewer, part of a period
is left in a window of the fewest samples, and passes for noise of the motion's own correlation. The
spectrum tells the noise between the lines above the motion: medians of bands do not see lines, and
their slope is the noise's colour; of a recording so short that it leaves hardly any band, one
median tells the level of white noise. What a law makes of the motion there may fill it, so that
white noise is no more than this either, and the lower one counts. Of coloured noise, which is
strongest below where it is seen, the level may be less than it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.gaps import runs
from bayesimpact.data.recording import Recording
from bayesimpact.inference.noise.driven import MEDIAN, SHORTEST_PERIOD, TOP, powers
from bayesimpact.inference.noise.ordinates import Ordinates
from bayesimpact.inference.noise.remainders import SMALLEST
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.response.half_cycles import spectral_period

Array = NDArray[np.float64]

ABOVE = 1.5  # times the motion's frequency: a window's side lobes are gone, multiples to come
BANDS = (64, 32, 16, 8)  # ordinates, as many as leave enough bands
LEAST_BANDS = 4
LEAST_GAIN = 6.5  # nats of bands' likelihood, to call the noise coloured; neighbours are not
# independent behind a window: by test one call of 100 is false
AS_GOOD = 1.0  # nats below the likeliest correlation: 1.4 standard errors
WEAKER = 50  # correlations up to it
UNTOLD = 0.5  # relative error of a level, beyond which it is not told
PARTS = 4  # bands of the upper half of a spectrum
SHORTEST = 400  # samples: one so long stretch tells the level of a band to 21 %
EFFICIENCY = 0.48  # of a median of exponential numbers, against their mean: ln(2)^2


def fast_noise(recordings: Sequence[Recording], remainders: Noise | None) -> Noise | None:
    """The polynomial `remainders`, or what the spectra of free recordings of one quantity without a
    stop say, where that is less and their motion is fast; whatever it is where there are none.
    """
    longest = max(spectral_period(r.samples, r.order) for r in recordings)
    if longest >= SHORTEST_PERIOD or any(r.case for r in recordings):
        return remainders
    bands = [own for r in recordings if (own := _bands(r)) is not None]
    if not bands:
        return remainders
    angle, power, weight = (np.concatenate(parts) for parts in zip(*bands, strict=True))
    ordinates = Ordinates(angle, power, np.ones(power.size), 0.0)
    each = EFFICIENCY * float(weight.mean())  # independent ordinates of a band
    rho = _correlation(ordinates, each) if power.size >= LEAST_BANDS else 0.0
    level = float(np.sqrt(ordinates.variance(rho)))
    error = float(np.sqrt(0.5 / (each * power.size)))
    errors = np.array(ordinates.errors(rho) if rho else (0.0, 0.0)) / np.sqrt(each)
    if remainders is not None and remainders.level < level * (1.0 + 3.0 * error):
        # what windows of a period and more leave is motion too
        whole = longest <= SMALLEST and not remainders.correlation
        return replace(remainders, is_bound=True) if whole else remainders
    return Noise(
        rho,
        level=level,
        level_error=max(error, float(errors[1])),
        correlation_error=float(errors[0]),
        source="spectrum above the motion",
        is_bound=rho == 0.0,
    )


def floor_noise(recordings: Sequence[Recording], remainders: Noise | None) -> Noise | None:
    """The polynomial `remainders` where they tell the level; else white noise that is no more than
    the quietest part of the upper half of the spectra of free recordings of one quantity.

    Velocities and accelerations have kinks and jumps at every contact: between stops on either side
    no window may be free of them, and what is left passes for noise as slow as the motion. What
    contacts add falls with frequency.
    """
    if remainders is not None and remainders.level_error < UNTOLD:
        return remainders
    spectra = [powers(s) for s in map(_longest_stretch, recordings) if s.size > SHORTEST]
    if not spectra:
        return remainders
    edges = np.linspace(0.5, TOP, PARTS + 1)
    bands = [
        np.concatenate([own[int(low * own.size) : int(high * own.size)] for own in spectra])
        for low, high in pairwise(edges)
    ]
    quietest = min(bands, key=np.median)
    level = float(np.sqrt(np.median(quietest) / MEDIAN))
    if remainders is not None and remainders.level < level:
        return remainders
    return Noise(
        level=level,
        level_error=float(np.sqrt(0.5 / (EFFICIENCY * quietest.size))),
        correlation_error=0.0,
        source="upper end of the spectrum",
        is_bound=True,
    )


def _longest_stretch(recording: Recording) -> Array:
    """The samples of a recording, of one with gaps those between two."""
    if recording.used is None:
        return recording.samples
    first, end = max(runs(recording.used), key=lambda run: run[1] - run[0], default=(0, 0))
    return recording.samples[first:end]


def _correlation(ordinates: Ordinates, each: float) -> float:
    """The weakest one that is as good as likeliest: below the motion, where nothing is seen of the
    noise, a stronger one would add any power. 0 where the gain over white noise is small.
    """
    found = ordinates.correlation()
    best = ordinates.cost(found)
    if each * (ordinates.cost(0.0) - best) < LEAST_GAIN:
        return 0.0
    weaker = np.linspace(0.0, found, WEAKER)
    return float(next(rho for rho in weaker if each * (ordinates.cost(rho) - best) <= AS_GOOD))


def _bands(recording: Recording) -> tuple[Array, Array, Array] | None:
    """Angular frequencies per sample of bands above the motion, their mean powers per sample as
    medians tell them, and their numbers of ordinates: one of all ordinates where there are few, by
    test of the error that their number says; None where these are fewer than a band's. Of a
    recording with gaps the longest stretch between two.
    """
    samples = _longest_stretch(recording)
    if samples.size <= BANDS[-1]:
        return None
    own = powers(samples)
    last = int(TOP * own.size)
    first = int(np.ceil(ABOVE * samples.size / spectral_period(recording.samples, recording.order)))
    left = last - first
    if left < BANDS[-1]:
        return None
    width = next((w for w in BANDS if left // w >= LEAST_BANDS), left)
    count = left // width
    some = own[first : first + count * width].reshape(count, width)
    middle = first + width * (np.arange(count) + 0.5)
    angle = 2 * np.pi * middle / samples.size
    return angle, np.median(some, axis=1) / MEDIAN, np.full(count, float(width))
