"""Runs of bad readings close to each other, by a curve through the good ones on both sides.

`spikes` predicts a reading from the few next to it on one side: where the next spike lies among
those, neither side predicts anything. Here one polynomial goes through the readings on both sides
that are good, wherever those are, and says how far off the others lie. An impact is told from a
spike by what it leaves beside it: a corner bends the curve away from the good readings too, by a
share of its height that is known.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter

from bayesimpact.data.faults.fault import Array, Span, gaussian_threshold
from bayesimpact.data.faults.flat import last_digit
from bayesimpact.data.faults.local import robust_sd
from bayesimpact.data.gaps import Mask, runs
from bayesimpact.data.recording import Recording

LONGEST = 5  # samples of one run
FORMS = ((3, 8), (4, 12))
"""Degree of the curve, and good samples on either side; what either finds counts."""
REACH = 2  # times that many samples: how far away the good ones may lie
CANDIDATE = 4.0  # standard deviations: noise is left out of the curves once in 16000 samples
SOFT = 10  # rounds in which samples count by how far they lie off, before some count no more
SOFTER = 2.0  # medians of the misses near by: a sample that far off counts half
ROUNDS = 30  # at most, until no sample changes sides
SURE = 2.0
"""Times the threshold: noise may come in bursts or be coloured, and motion have several corners;
measured, not derived. Of 1000 clean recordings drawn to be hard (stiff and ringing stops, eight
kinds of noise) one passes it, barely; of 1000 others, from which it was chosen, five passed 1.5."""
MOST = 0.1  # of the samples: with more, a window holds too many to say which are the good ones


@dataclass(frozen=True, eq=False)
class LocalPolynomial:
    """The polynomial through the good samples about a place.

    Attributes
    ----------
    good : (m,) their places
    degree : of the polynomial
    """

    good: Array
    degree: int

    def misses(self, values: Array, other: Array, at_other: Array) -> tuple[Array, Array]:
        """How far values (..., m) at the good places lie off, rms, and at_other (..., k) each."""
        middle, width = 0.5 * (self.good[0] + self.good[-1]), 0.5 * np.ptp(self.good)
        basis = np.vander((self.good - middle) / width, self.degree + 1)
        there = np.vander((other - middle) / width, self.degree + 1)
        found = values @ np.linalg.pinv(basis).T
        freedom = self.good.size - self.degree - 1
        rms = np.sqrt(np.sum((values - found @ basis.T) ** 2, axis=-1) / freedom)
        return np.asarray(rms), np.asarray(at_other - found @ there.T)

    def leverage(self, other: Array) -> float:
        """Largest standard deviation of a miss at other places, for good samples' noise of 1."""
        unit = np.eye(self.good.size)
        _, there = self.misses(unit, other, np.zeros((self.good.size, other.size)))
        return float(np.sqrt(1.0 + np.max(np.sum(there**2, axis=0))))

    def corner(self, other: Array) -> float:
        """Largest miss at other places over the rms at the good ones, of a step or corner."""
        at = np.arange(self.good[0] + 0.5, self.good[-1], 0.5)[:, None]
        beyond, beyond_other = (np.maximum(t - at, 0.0) for t in (self.good, other))
        ratios = []
        for power in (0, 1):  # 0 at the place itself, where a step is still to come
            values, at_other = (np.where(b > 0.0, b**power, 0.0) for b in (beyond, beyond_other))
            rms, there = self.misses(values, other, at_other)
            largest = np.max(np.abs(there), axis=1)
            seen = rms > 1e-9 * largest
            ratios.append(np.max(largest[seen] / rms[seen]) if seen.all() else np.inf)
        return float(max(ratios))


@dataclass(frozen=True)
class Spike:
    """One run of bad samples.

    Attributes
    ----------
    span : first and last-plus-one sample
    size : how far off, with its sign, in the readings' unit
    strength, threshold : that over what is usual, and the value from which on it counts
    """

    span: Span
    size: float
    strength: float
    threshold: float


def find_bursts(recording: Recording) -> list[Spike]:
    """Runs of up to five bad samples, whatever lies between them; impacts are none.

    The strength is the largest miss of a run over the rms miss of the good samples about it, or
    over that of the whole recording, where this is larger. A step or a corner beside noise that
    reaches `gaussian_threshold` has at most the two added in squares: `SURE` times that counts.
    Where the acceleration is measured, a contact is a spike by nature, and none is looked for.
    """
    if recording.order == 2 and recording.case:
        return []
    x = recording.samples
    used = np.ones(x.size, bool) if recording.used is None else recording.used
    best: dict[int, Spike] = {}
    for degree, beside in FORMS:
        if used.sum() > 4 * beside:
            for one in _of_form(x, used, degree, beside):
                best.setdefault(one.span[0], one)
    found = sorted(best.values(), key=lambda one: one.span)
    return found if sum(b - a for a, b in (f.span for f in found)) <= MOST * x.size else []


def _of_form(x: Array, used: Mask, degree: int, beside: int) -> list[Spike]:
    """Bursts off curves of one degree."""
    level, bad = screened(x, used, degree, beside)
    if level == 0.0:
        return []
    good = np.flatnonzero(used & ~bad)
    noise, step = gaussian_threshold(x.size), last_digit(x)
    found = []
    for first, end in runs(bad):
        at = int(np.searchsorted(good, first))
        near = good[max(at - beside, 0) : at + beside]
        fewest = min(np.sum(near < first), np.sum(near >= end))
        if end - first > LONGEST or fewest < beside // 2:
            continue
        if max(first - near[0], near[-1] - end + 1) > REACH * beside:
            continue
        curve = LocalPolynomial(near.astype(np.float64), degree)
        run = np.arange(first, end, dtype=np.float64)
        rms, missed = curve.misses(x[near], run, x[first:end])
        size, leverage = float(missed[np.argmax(np.abs(missed))]), curve.leverage(run)
        strength = abs(size) / max(float(rms), level)
        if abs(size) < 2.0 * leverage * step or strength < SURE * noise:  # the corner costs more
            continue
        threshold = SURE * float(np.hypot(noise * leverage, curve.corner(run)))
        if strength > threshold:
            found.append(Spike((first, end), size, strength, threshold))
    return found


def screened(x: Array, used: Mask, degree: int, beside: int) -> tuple[float, Mask]:
    """Level of the misses, and the samples that lie off the curve through the others."""
    weight = used.astype(np.float64)
    bad = np.zeros(x.size, bool)
    level = 0.0
    for turn in range(ROUNDS):
        missed = _missed(x, weight, degree, beside)
        level = robust_sd(missed[used])
        if level == 0.0:
            break
        size = np.abs(missed)
        if turn < SOFT:  # a curve through all leans towards the bad ones, and good ones miss it too
            usual = np.maximum(median_filter(size, 2 * beside + 1), level)
            weight = used / (1.0 + (size / (SOFTER * usual)) ** 4)
            continue
        before, bad = bad, used & (size > CANDIDATE * level)
        weight = (used & ~bad).astype(np.float64)
        if np.array_equal(before, bad):
            break
    return level, bad


def _missed(x: Array, weight: Array, degree: int, beside: int) -> Array:
    """How far every sample lies off the weighted polynomial through its neighbours."""
    t = np.arange(-beside, beside + 1) / beside
    y = x - np.mean(x)

    def moment(values: Array, power: int) -> Array:
        return np.convolve(values, (t**power)[::-1], mode="same")

    weights = [moment(weight, k) for k in range(2 * degree + 1)]
    values = [moment(weight * y, k) for k in range(degree + 1)]
    weights[0], values[0] = weights[0] - weight, values[0] - weight * y  # without the sample itself
    powers = np.add.outer(np.arange(degree + 1), np.arange(degree + 1))
    normal = np.moveaxis(np.array(weights)[powers], -1, 0) + 1e-9 * np.eye(degree + 1)
    sides = np.zeros((x.size, degree + 1, 2))
    sides[:, :, 0], sides[:, 0, 1] = np.array(values).T, 1.0
    fitted, variance = np.linalg.solve(normal, sides)[:, 0].T
    return np.asarray((y - fitted) / np.sqrt(1.0 + np.abs(variance)))
