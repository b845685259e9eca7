"""Samples that are set aside: which they are, and what stands in their place.

What needs a whole recording to start from (a period, turning points, start values) finds a smooth
stand-in there; what weighs evidence asks `Recording.used`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.period import crossing_period
from bayesimpact.data.recording import Recording
from bayesimpact.errors import InputError

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

BRIDGED = 0.3  # of a period: up to here a cubic bridges a gap
PERIODS = 3.0  # that have to come before a long gap to tell what a recording does
NEAR = 6  # samples on either side that tell its ends
LEAST = 0.2  # of a recording's samples that have to be left


def runs(mask: Mask) -> list[tuple[int, int]]:
    """First and last-plus-one position of every run of True in a mask (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(int(first), int(end)) for first, end in edges.reshape(-1, 2)]


def without(recording: Recording, spans: Iterable[tuple[int, int]]) -> Recording:
    """The recording with samples first..end-1 of every span set aside, and bridged.

    Raises `ValueError` when less than a fifth of the recording would be left.
    """
    used = np.ones(recording.samples.size, bool) if recording.used is None else recording.used
    used = used.copy()
    for first, end in spans:
        used[max(first, 0) : max(end, 0)] = False
    if used.sum() < max(LEAST * used.size, 2):
        raise ValueError(f"{int(used.sum())} of {used.size} samples left")
    return replace(recording, samples=bridged(recording.samples, used), used=used)


def before_gap(recording: Recording) -> Recording:
    """The recording up to its first gap that is too long for a cubic, where that is long enough.

    What stands in a long gap is no motion, and neither cycles nor turning points may be read there.
    """
    if recording.used is None:
        return recording
    used, samples = recording.used, recording.samples
    period = _period(samples, used) or np.inf
    for first, end in runs(~used):
        if first > 0 and end - first > max(BRIDGED * period, 2.0):
            return recording.part(0, first) if first >= PERIODS * period else recording
    return recording


def after_lone_readings(recording: Recording) -> Recording:
    """The recording without readings before a gap that are too few to tell how the motion goes on.

    A mass may be released in such a gap: one reading at rest says nothing of what follows. The gap
    is one that no cubic bridges.
    """
    if recording.used is None:
        return recording
    used, begin = recording.used, 0
    long = max(BRIDGED * (_period(recording.samples, used) or np.inf), 2.0)
    for (first, end), (following, _) in pairwise(runs(used)):
        if end - first >= NEAR or following - end <= long:
            break
        begin = following
    return recording.part(begin, used.size) if begin else recording


def shown_period(recording: Recording) -> float | None:
    """Rough period, s, of the longest stretch of samples that count, or where that shows none, of
    all with their stand-ins; None where neither shows one.
    """
    used = np.ones(recording.samples.size, bool) if recording.used is None else recording.used
    period = _period(recording.samples, used) or crossing_period(recording.samples, 1.0)
    return None if period is None else period * recording.interval


def _period(samples: Array, used: Mask) -> float | None:
    """Rough period of the longest run of samples that count, in samples."""
    longest = max(runs(used), key=lambda run: run[1] - run[0], default=(0, 0))
    return crossing_period(samples[slice(*longest)], 1.0)


def excluded_spans(where: str, recording: Recording, spans: Sequence[Sequence[float]]) -> Recording:
    """The recording without the samples in spans of time, s on the file's own clock.

    All stand-ins are made anew, so that they follow from the samples that count, and a recording
    that was saved is read as it was.

    Raises
    ------
    InputError
        when a span holds no sample, or hardly any sample is left; `where` names the key.
    """
    chosen = []
    for start, end in spans:
        margin = 1e-6  # a sample at the very end of a span counts in, however its time was rounded
        first = int(np.ceil((start - recording.start) / recording.interval - margin))
        last = int(np.floor((end - recording.start) / recording.interval + margin))
        if last < max(first, 0) or first >= recording.samples.size:
            span = f"{recording.start:.6g} to {recording.start + recording.duration:.6g} s"
            raise InputError(
                where, f"no sample from {start:g} to {end:g} s", f"times within {span}"
            )
        chosen.append((first, last + 1))
    if not chosen and recording.used is None:
        return recording
    try:
        return without(recording, chosen)
    except ValueError as error:
        raise InputError(where, str(error), f"{LEAST:.0%} or more that count") from None


def excluded(recording: Recording, spans: Iterable[tuple[int, int]]) -> str:
    """The line `exclude_s = ...` for samples first..end-1 of every span.

    The times lie nearly half an interval outside, written to a tenth of one.
    """
    places = max(0, math.ceil(1.0 - math.log10(recording.interval)))

    def time(sample: float) -> str:
        return f"{recording.start + sample * recording.interval:.{places}f}"

    pairs = (f"[{time(first - 0.4)}, {time(end - 0.6)}]" for first, end in spans)
    return f"exclude_s = [{', '.join(pairs)}]"


def bridged(samples: Array, used: Mask) -> Array:
    """Samples (n,) with a smooth stand-in where they are set aside.

    Up to 0.3 of a period, a cubic from the neighbours; beyond, what the signal did whole
    periods before and after, the nearer the more; at the ends, the value of the neighbour.
    """
    good = np.flatnonzero(used)
    place = np.arange(samples.size)
    filled = np.where(used, samples, np.interp(place, good, samples[good]))
    period = _period(samples, used)
    for first, end in runs(~used):
        if first == 0 or end == samples.size:
            continue
        if period is None or end - first <= max(BRIDGED * period, 2.0):
            filled[first:end] = _cubic(samples, good, first, end)
        else:
            filled[first:end] = _repeated(filled, first, end, period)
    return filled


def _cubic(samples: Array, good: NDArray[np.int64], first: int, end: int) -> Array:
    """The cubic that leaves and meets the parabolas through six neighbours on either side."""
    at = int(np.searchsorted(good, first))
    left, right = good[max(at - NEAR, 0) : at], good[at : at + NEAR]
    if min(left.size, right.size) < 3:
        return np.asarray(np.interp(np.arange(first, end), good, samples[good]))
    ends = []
    for places, origin in ((left, first - 1), (right, end)):
        fit = np.polynomial.Polynomial.fit(places - origin, samples[places], 2).convert().coef
        ends.append(np.append(fit, np.zeros(3))[:2])
    (y0, v0), (y1, v1) = ends
    span = end - first + 1
    t = np.arange(1, span) / span
    h = [2 * t**3 - 3 * t**2 + 1, t**3 - 2 * t**2 + t, -2 * t**3 + 3 * t**2, t**3 - t**2]
    return np.asarray(h[0] * y0 + h[1] * span * v0 + h[2] * y1 + h[3] * span * v1)


def _repeated(samples: Array, first: int, end: int, period: float) -> Array:
    """Whole periods earlier and later, weighted by nearness, made to meet both neighbours."""
    shift = round(np.ceil((end - first + 1) / period) * period)
    copies, weights = [], []
    near = np.linspace(1.0, 0.0, end - first + 2)
    for offset, weight in ((-shift, near), (shift, near[::-1])):
        low, high = first - 1 + offset, end + 1 + offset
        if low >= 0 and high <= samples.size:
            copies.append(samples[low:high])
            weights.append(weight)
    line = np.linspace(samples[first - 1], samples[end], end - first + 2)
    if not copies:
        return line[1:-1]
    shape = np.sum([c * w for c, w in zip(copies, weights, strict=True)], axis=0)
    shape = shape / np.maximum(np.sum(weights, axis=0), 1e-12)
    shape[0], shape[-1] = copies[0][0], copies[-1][-1]
    ends = np.linspace(shape[0], shape[-1], shape.size)
    return np.asarray((shape + line - ends)[1:-1], dtype=np.float64)
