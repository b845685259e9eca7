"""A steady hum in the readings: a line of the spectrum that the motion does not make."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.period import crossing_period

Array = NDArray[np.float64]

FROM = 4.0  # times the motion's frequency: below are its own low harmonics
NEIGHBOURS = 101  # lines of the spectrum about one, whose median is the level there
FALSE_ALARM = 1e-6  # chance per recording for Gaussian noise: a periodogram is exponential
PARTS = 4  # of a recording, in which the hum has to be the same
STEADY = 3  # of them: impacts may drown it in one
COMB = 0.25  # of its amplitude: neighbours one motion's frequency away make it one of a comb
ALIKE = 0.3  # how far amplitudes (of their median) and phases (rad) of the parts may differ
LEAST_PART = 64  # samples


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


def find_hum(samples: Array, interval: float) -> Hum | None:
    """The strongest steady line above `FROM` times the motion's frequency, if there is one.

    Second differences of the readings are tapered (Hann) and transformed. A line has to stand out
    of the level about it, to stand alone (harmonics of sharp impacts come as a comb), and to keep
    its amplitude and phase through the recording (harmonics of a decaying motion do not for long).
    """
    period = crossing_period(samples, interval)
    if period is None or samples.size < PARTS * LEAST_PART:
        return None
    line = _line(samples, interval, 1.0 / period)
    return None if line is None else _steady(samples, interval, *line)


def _line(samples: Array, interval: float, motion: float) -> tuple[float, float, float] | None:
    """Frequency (Hz), strength and threshold of the line that stands out most."""
    from scipy.ndimage import median_filter

    curvature = np.diff(samples, 2)
    power = np.abs(np.fft.rfft(curvature * np.hanning(curvature.size))) ** 2
    level = median_filter(power, NEIGHBOURS, mode="nearest")
    resolution = 1.0 / (curvature.size * interval)
    half = NEIGHBOURS // 2  # on both sides
    first, last = max(int(np.ceil(FROM * motion / resolution)), half), power.size - half
    if last <= first:
        return None
    ratio = power[first:last] / np.maximum(level[first:last], np.finfo(float).tiny)
    k = first + int(np.argmax(ratio))
    threshold = float(np.log(ratio.size / FALSE_ALARM) / np.log(2.0))  # median = ln 2 of the mean
    if ratio[k - first] < threshold or _of_a_comb(power, k, motion / resolution):
        return None
    low, middle, high = np.log(np.maximum(power[k - 1 : k + 2], np.finfo(float).tiny))
    bend = low - 2 * middle + high
    shift = 0.5 * (low - high) / bend if bend < 0 else 0.0
    return (k + float(shift)) * resolution, float(ratio[k - first]), threshold


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
