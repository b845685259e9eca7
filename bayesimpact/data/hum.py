"""A steady hum in the readings: a line of the spectrum that the motion does not make."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from bayesimpact.data.period import crossing_period

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

FROM = 1.25  # times the motion's lowest frequency: below are slow drifts of its own
MULTIPLES = 3  # of all frequencies that a motion goes through, between which a line is its own
HARMONICS = 5  # of the lowest of them, that of free flight: what impacts make does not last
BESIDE = 0.03  # of a frequency, and `APART` lines of the spectrum: what its band is widened by
APART = 3
MOVES = 0.2  # of the largest excursion: a part with less does not tell the motion's frequency
SKIPPED = 2  # lines on either side of one that its taper reaches
NEIGHBOURS = 20  # lines beyond those, half on either side, whose middle one is the level there
FALSE_ALARM = 1e-6  # chance per recording for Gaussian noise: a periodogram is exponential
CANDIDATES = 8  # lines that stand out most: a motion's own may be among them
PARTS = 4  # of a recording, in which the hum has to be the same
STEADY = 3  # of them: impacts may drown it in one
COMB = 0.25  # of its amplitude: neighbours one motion's frequency away make it one of a comb
ALIKE = 0.3  # how far amplitudes (of their median) and phases (rad) of the parts may differ
LEAST_PART = 64  # samples
LIKE = 2.0  # times the amplitude that another recording has of the same hum


@dataclass(frozen=True)
class Hum:
    """A sine in the readings of one recording.

    Attributes
    ----------
    frequency : Hz
    cosine, sine : amplitudes from the first sample on, unit of the readings
    strength : power of the line over the level about it
    threshold : the strength from which on it counts
    """

    frequency: float
    cosine: float
    sine: float
    strength: float
    threshold: float

    @property
    def amplitude(self) -> float:
        """Amplitude, unit of the readings."""
        return float(np.hypot(self.cosine, self.sine))

    def readings(self, times: Array) -> Array:
        """The hum at `times` (n,) since the first sample, s."""
        angle = 2 * np.pi * self.frequency * times
        return np.asarray(self.cosine * np.cos(angle) + self.sine * np.sin(angle))


def find_hum(samples: Array, interval: float, motion: Array | None = None) -> Hum | None:
    """The steady line that stands out most beside the motion's own, if there is one; the motion is
    that of the `samples` (n,), or of others at the same times, where these are what a model leaves.

    Second differences of the readings are tapered (Hann) and transformed. A line has to stand out
    of the level beside it, away from the frequencies that the motion goes through and their first
    multiples; to stand alone (harmonics of sharp impacts come as a comb), and to keep its amplitude
    and phase through the recording (harmonics of a decaying motion do not for long).
    """
    motion = samples if motion is None else motion
    period = crossing_period(motion, interval)
    if period is None or samples.size < PARTS * LEAST_PART:
        return None
    own = _own_frequencies(motion, interval) or [1.0 / period]
    lines = _lines(samples, interval, 1.0 / period, own)
    found = (_steady(samples, interval, *line) for line in lines)
    return next((hum for hum in found if hum is not None), None)


def hum_at(samples: Array, interval: float, known: Hum) -> Hum | None:
    """The steady line of another recording in this one, if it has it: at that frequency, up to what
    the duration resolves, beside the motion's own, and no more than `LIKE` times as strong or weak.
    """
    period = crossing_period(samples, interval)
    if period is None or samples.size < PARTS * LEAST_PART:
        return None
    resolution = 1.0 / ((samples.size - 2) * interval)
    place, count = round(known.frequency / resolution), (samples.size - 2) // 2 + 1
    own = _own_frequencies(samples, interval) or [1.0 / period]
    if place >= count or not _beside(own, resolution, count)[place]:
        return None
    found = _steady(samples, interval, known.frequency, np.nan, np.nan)
    if found is None or abs(found.frequency - known.frequency) > resolution:
        return None
    return found if 1 / LIKE < found.amplitude / known.amplitude < LIKE else None


def _lines(
    samples: Array, interval: float, spacing: float, own: Sequence[float]
) -> Iterator[tuple[float, float, float]]:
    """Frequency (Hz), strength and threshold of lines that stand out, the strongest first."""
    curvature = np.diff(samples, 2)
    power = np.abs(np.fft.rfft(curvature * np.hanning(curvature.size))) ** 2
    if power.size < 2 * (NEIGHBOURS + SKIPPED):
        return
    resolution = 1.0 / (curvature.size * interval)
    ratio = power / np.maximum(_level(power), np.finfo(float).tiny)
    peak = np.zeros(power.size, dtype=bool)
    peak[1:-1] = (power[1:-1] >= power[:-2]) & (power[1:-1] >= power[2:])
    threshold = _threshold(power.size)
    peak &= (ratio > threshold) & _beside(own, resolution, power.size)
    places = np.flatnonzero(peak)
    for k in places[np.argsort(-ratio[places])][:CANDIDATES]:
        if _of_a_comb(power, k, spacing / resolution):
            continue
        low, middle, high = np.log(np.maximum(power[k - 1 : k + 2], np.finfo(float).tiny))
        bend = low - 2 * middle + high
        shift = 0.5 * (low - high) / bend if bend < 0 else 0.0
        yield float((k + shift) * resolution), float(ratio[k]), threshold


def _level(power: Array) -> Array:
    """The middle one of the neighbours of every line, the lower of two."""
    half = NEIGHBOURS // 2
    padded = np.pad(power, half + SKIPPED, mode="reflect")
    beside = np.lib.stride_tricks.sliding_window_view(padded, NEIGHBOURS + 2 * SKIPPED + 1)
    neighbours = np.concatenate([beside[:, :half], beside[:, -half:]], axis=1)
    return np.asarray(np.partition(neighbours, half - 1, axis=1)[:, half - 1])


@cache
def _threshold(count: int) -> float:
    """The ratio that one of `count` lines exceeds by chance `FALSE_ALARM` times, were lines
    independent; behind a taper they are not, and at 1e-3 twice as many do.

    Of n independent exponentials the k-th smallest is a sum of k exponentials of means 1 / (n - k +
    1) to 1 / n (Renyi 1953); another one exceeds it t times with the product of i / (i + t) over
    these i.
    """
    orders = np.arange(NEIGHBOURS - NEIGHBOURS // 2 + 1, NEIGHBOURS + 1)
    wanted = np.log(FALSE_ALARM / count)
    return float(brentq(lambda t: -np.log1p(t / orders).sum() - wanted, 0.0, 1e6))


def _own_frequencies(samples: Array, interval: float) -> list[float]:
    """Of a motion, Hz, in parts of it that move: the mean of all counts a hum's too."""
    size = samples.size // PARTS
    parts = samples[: PARTS * size].reshape(PARTS, size)
    moving = parts[np.ptp(parts, axis=1) > MOVES * np.ptp(samples)]
    periods = [crossing_period(part, interval) for part in moving]
    return [1.0 / period for period in periods if period is not None]


def _beside(own: Sequence[float], resolution: float, count: int) -> Flags:
    """Which of `count` lines are none of a motion that goes through its own frequencies, Hz."""
    frequencies = resolution * np.arange(count)
    free = frequencies > FROM * min(own)
    for n in range(1, MULTIPLES + 1):
        low = n * min(own) * (1.0 - BESIDE) - APART * resolution
        high = n * max(own) * (1.0 + BESIDE) + APART * resolution
        free &= (frequencies < low) | (frequencies > high)
    for n in range(MULTIPLES + 1, HARMONICS + 1):
        one = n * min(own)
        free &= np.abs(frequencies - one) > one * BESIDE + APART * resolution
    free[-NEIGHBOURS // 2 :] = False
    return np.asarray(free)


def _of_a_comb(power: Array, k: int, spacing: float) -> bool:
    """Whether lines of a like amplitude stand one motion's frequency below and above line `k`."""
    reach = 2 + int(0.02 * spacing)  # the taper's width, and what the period may be off

    def highest(place: float) -> float:
        middle = round(place)
        near = power[max(middle - reach, 0) : middle + reach + 1]
        return float(near.max()) if near.size else 0.0

    return bool(min(highest(k - spacing), highest(k + spacing)) > COMB**2 * power[k])


def _steady(
    samples: Array, interval: float, frequency: float, strength: float, threshold: float
) -> Hum | None:
    """The line with its frequency refined from its phases in the parts; None where these differ."""
    size = samples.size // PARTS
    middles = (np.arange(PARTS) + 0.5) * size * interval
    parts = samples[: PARTS * size].reshape(PARTS, size)
    found = np.array([_amplitude(part, interval, frequency) for part in parts])
    found *= np.exp(-2j * np.pi * frequency * (middles - middles[0]))
    usual = float(np.median(np.abs(found)))
    kept = np.abs(np.abs(found) - usual) < ALIKE * usual
    if kept.sum() < STEADY:
        return None
    phases = np.unwrap(np.angle(found[kept]))
    slope, start = np.polyfit(middles[kept], phases, 1)
    if np.abs(phases - slope * middles[kept] - start).max() > ALIKE:
        return None
    height = float(np.abs(found[kept]).mean())
    # each part's phase counts from its own first sample
    angle = start + slope * middles[0] - (slope * 0.5 * size * interval)
    return Hum(
        frequency + float(slope) / (2 * np.pi),
        height * float(np.cos(angle)),
        -height * float(np.sin(angle)),
        strength,
        threshold,
    )


def _amplitude(part: Array, interval: float, frequency: float) -> complex:
    """Complex amplitude of a line in a part (n,), from its tapered second differences."""
    turn = np.exp(-2j * np.pi * frequency * interval * np.arange(part.size - 2))
    taper = np.hanning(part.size - 2)
    gain = np.exp(2j * np.pi * frequency * interval) * (
        2.0 * np.cos(2 * np.pi * frequency * interval) - 2.0
    )
    return complex(2.0 * (np.diff(part, 2) * taper) @ turn / (taper.sum() * gain))
