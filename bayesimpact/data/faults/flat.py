"""Runs of equal readings, the step of the readings, and how long a run may naturally be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayesimpact.data.faults.fault import Array
from bayesimpact.data.gaps import runs

SINGLE = 5.0  # percentile of the distances of readings that is one step: set by hand
NEIGHBOURS = 4  # samples on either side of a run from which its slope there is taken


@dataclass(frozen=True)
class Flat:
    """A run of equal readings.

    Attributes
    ----------
    first, end : first and last-plus-one sample
    value : the reading
    slope : the gentler of the slopes with which readings enter and leave, per sample, absolute
    jump : the larger of the steps into the run and out of it, absolute, over the steps beyond
    """

    first: int
    end: int
    value: float
    slope: float
    jump: float

    @property
    def size(self) -> int:
        """Samples in the run."""
        return self.end - self.first

    def missed(self, step: float = 0.0) -> float:
        """How far a motion with this slope at its ends gets within the run and back, at least.

        A parabola that enters with slope s turns within r samples at a height of s r / 4. Where
        readings are multiples of a `step`, a slope of one step over the neighbours may be none.
        """
        return 0.25 * max(self.slope - step / NEIGHBOURS, 0.0) * self.size


def flats(samples: Array, least: int) -> list[Flat]:
    """Runs of `least` or more equal readings of samples (n,)."""
    equal = np.diff(samples) == 0.0
    found = []
    for first, last in runs(equal):
        end = last + 1
        if end - first < least:
            continue
        slopes, jumps = [], []
        if first > 0:
            k = min(NEIGHBOURS, first)
            slopes.append(_slope_at_end(samples[first - k : first + 1]))
            jumps.append(_jump_at_end(samples[first - k : first + 1]))
        if end < samples.size:
            k = min(NEIGHBOURS, samples.size - end)
            slopes.append(_slope_at_end(samples[end - 1 : end + k][::-1]))
            jumps.append(_jump_at_end(samples[end - 1 : end + k][::-1]))
        slope, jump = float(min(slopes, default=0.0)), float(max(jumps, default=0.0))
        found.append(Flat(first, end, float(samples[first]), slope, jump))
    return found


def _slope_at_end(samples: Array) -> float:
    """Size of the slope at the last of a few samples, the first of a run.

    The smaller one of the mean and of what the differences before the last, which the run has cut
    short, lead to: a motion slows down towards its turning point, where rounded readings repeat by
    nature.
    """
    steps = np.diff(samples)
    mean = abs(float(steps.mean()))
    if steps.size < NEIGHBOURS:
        return mean
    whole = steps[:-1]
    at_end = float(np.polyfit(np.arange(whole.size) - whole.size - 0.5, whole, 1)[1])
    return min(mean, abs(at_end))


def _jump_at_end(samples: Array) -> float:
    """How much larger the last step of a few samples is than those before it."""
    steps = np.diff(samples)
    return abs(float(steps[-1])) - (abs(float(steps[:-1].mean())) if steps.size > 1 else 0.0)


def reading_step(samples: Array) -> float:
    """The step that the readings are multiples of: the usual smallest distance of two readings.

    The median of the distances of one step between neighbours among the values that occur, less
    what rounding in the file adds: of a large motion most are several steps apart. 0 for readings
    that are all different.
    """
    values = np.unique(samples)
    if values.size < 3 or values.size > 0.5 * samples.size:
        return 0.0
    apart = np.diff(values)
    apart = apart[apart > 1e-9 * float(values[-1] - values[0])]
    return float(np.median(apart[apart < 1.5 * np.percentile(apart, SINGLE)]))


def last_digit(samples: Array) -> float:
    """The smallest distance of two readings but for rounding errors: a step, or a file's digit."""
    values = np.diff(np.unique(samples))
    real = values[values > 1e-9 * float(np.ptp(samples))]
    return float(np.percentile(real, 1.0)) if real.size else 0.0


def equal_share(samples: Array) -> float:
    """How often two neighbours are equal, but for the longest runs (a half per cent of samples)."""
    equal = np.diff(samples) == 0.0
    if not equal.any():
        return 0.0
    lengths = np.sort([end - first for first, end in runs(equal)])[::-1]
    spare = 0.005 * samples.size
    ordinary = lengths[np.cumsum(lengths) > spare] if lengths[0] < 4 else lengths[lengths < 4]
    return float(ordinary.sum() / max(equal.size, 1))
