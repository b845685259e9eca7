"""The half cycles of a decaying signal: where it turns, where it rests, where it passes rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.signal import find_peaks

from bayesimpact.response import local

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

ALIKE = 0.2  # of the power of the strongest line


@dataclass(frozen=True, eq=False)
class HalfCycles:
    """Consecutive complete half cycles about a level; positions are in samples.

    Attributes
    ----------
    crossings : (k + 1,) where the signal passes the level
    side : (k,) +1 above the level, -1 below
    peaks : (k,) position of each extreme
    amplitudes : (k,) distance of each extreme from the level, positive
    """

    crossings: Floats
    side: NDArray[np.int_]
    peaks: Floats
    amplitudes: Floats

    @property
    def durations(self) -> Floats:
        """(k,) time between the crossings of each half cycle, samples."""
        return np.diff(self.crossings)


def rest_at_end(samples: Floats) -> float:
    """Median of the last fifth of a recording."""
    return float(np.median(samples[-max(samples.size // 5, 1) :]))


def with_motion(samples: Floats) -> Floats:
    """The part with motion: a decay that dies early must not drown in the noise after it."""
    size = np.abs(samples - rest_at_end(samples))
    last = int(np.flatnonzero(size > 0.05 * size.max())[-1]) if size.any() else 0
    return samples[: min(samples.size, max(16, int(1.2 * last)))]


def spectral_period(samples: Floats, order: int = 0) -> float:
    """Period of the strongest component, in samples: good to some ten per cent.

    `order` says which time derivative of the displacement the samples are.
    """
    rest_reading = rest_at_end(samples)
    active = with_motion(samples)
    fade = np.cos(0.5 * np.pi * np.arange(active.size) / active.size) ** 2
    if order > 0:  # a derivative averages to zero, and its median may lie off that
        rest_reading = float(np.average(active, weights=fade))
    points = 1 << int(np.ceil(np.log2(4 * active.size)))
    power = np.abs(np.fft.rfft((active - rest_reading) * fade, points)) ** 2
    # A stop moves the middle of the cycles as they decay: in the velocity this drift counts little,
    # but white noise would count more than the motion, so its floor goes first.
    floor = float(np.median(power[power.size // 2 :]))
    power = np.maximum(power - 30 * floor, 0.0)
    lowest = max(1, int(1.2 * points / active.size))
    if order < 2:
        power[1:] *= np.arange(1, power.size) ** (2.0 - 2.0 * order)
        peak = lowest + int(np.argmax(power[lowest:]))
        return points / peak
    # Short contacts give an acceleration's harmonics the size of its first line, and to weigh them
    # less would weigh the drift of the probe more: so the lowest line of those alike.
    strong = lowest + int(np.argmax(power[lowest:] >= ALIKE * power[lowest:].max()))
    peak = strong + int(np.argmax(power[strong : int(1.3 * strong) + 2]))
    return points / peak


def turning_points(samples: Floats, period: float, noise: float) -> tuple[Ints, NDArray[np.int_]]:
    """Alternating maxima and minima, whatever the level they lie about.

    Returns
    -------
    (k,) indices and (k,) signs, +1 for a maximum. A turn counts when the signal comes back by more
    than six standard deviations of the noise that a running mean over period / 24 leaves.
    """
    width = max(1, int(period / 24))
    smooth = uniform_filter1d(samples, width, mode="nearest") if width > 2 else samples
    least = 6 * noise / np.sqrt(width)
    reach = 2 * int(2 * period) + 1
    high, _ = find_peaks(smooth, prominence=least, wlen=reach)
    low, _ = find_peaks(-smooth, prominence=least, wlen=reach)
    index = np.concatenate([high, low])
    sign = np.concatenate([np.ones(high.size, dtype=int), -np.ones(low.size, dtype=int)])
    order = np.argsort(index)
    index, sign = index[order], sign[order]
    keep: list[int] = []
    for k in range(index.size):
        if keep and sign[keep[-1]] == sign[k]:
            if sign[k] * smooth[index[k]] > sign[k] * smooth[index[keep[-1]]]:
                keep[-1] = k
        else:
            keep.append(k)
    return index[keep].astype(np.intp), sign[keep]


def half_cycles(samples: Floats, level: float, period: float, noise: float) -> HalfCycles:
    """Complete half cycles about `level`, until the motion is lost in the noise.

    A crossing counts when the signal goes from four standard deviations of the noise on one side
    to four on the other (a Schmitt trigger), so that noise near zero makes no double crossings.

    Parameters
    ----------
    samples : (n,) signal
    level : rest reading
    period : rough period, samples
    noise : standard deviation of the noise
    """
    signal = samples - level
    threshold = max(4 * noise, 1e-9 * float(np.abs(signal).max(initial=0.0)))
    strong = np.flatnonzero(np.abs(signal) > threshold)
    state = np.sign(signal[strong]).astype(int)
    flips = np.flatnonzero(np.diff(state))
    if flips.size < 2:
        return _none()
    before, after = strong[flips], strong[flips + 1]
    centre = middle_changes(signal, before, after)
    side = state[flips[:-1] + 1]
    first, last = centre[:-1] + 1, centre[1:]
    spline = local.cubic(signal)
    peaks, values = local.extremes(signal, first, last, side, noise, spline)
    amplitudes = side * values
    lengths = (last - first + 1).astype(np.float64)
    shorter = np.minimum(np.append(lengths, lengths[-1]), np.append(lengths[0], lengths))
    positions = local.crossings(signal, centre, 0.25 * shorter, noise, spline)
    lost = amplitudes < max(6 * noise, 1.5 * threshold)
    lost |= _merged(signal, turning_points(signal, period, noise), first, last, side, amplitudes)
    count = int(np.argmax(lost)) if lost.any() else lost.size
    return HalfCycles(positions[: count + 1], side[:count], peaks[:count], amplitudes[:count])


def _none() -> HalfCycles:
    return HalfCycles(np.empty(0), np.empty(0, dtype=int), np.empty(0), np.empty(0))


def middle_changes(signal: Floats, before: Ints, after: Ints) -> Ints:
    """The middle ones of the changes of sign between samples (k,) on either side."""
    changes = np.flatnonzero(np.diff(np.signbit(signal)))
    first, past = np.searchsorted(changes, before), np.searchsorted(changes, after)
    return changes[first + (past - first) // 2]


def _merged(
    signal: Floats,
    turns: tuple[Ints, NDArray[np.int_]],
    first: Ints,
    last: Ints,
    side: NDArray[np.int_],
    amplitudes: Floats,
) -> NDArray[np.bool_]:
    """Half cycles that hold a further cycle, to the other side, too short or small to be seen.

    The signal then comes back more than half of its way to the level in between.
    """
    index, sign = turns
    owner = np.searchsorted(first, index, side="right") - 1
    inside = (owner >= 0) & (index <= last[owner])
    index, sign, owner = index[inside], sign[inside], owner[inside]
    back = (sign == -side[owner]) & (side[owner] * signal[index] < 0.5 * amplitudes[owner])
    merged = np.zeros(side.size, dtype=bool)
    merged[owner[back]] = True
    return merged
