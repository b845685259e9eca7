"""A start under a force, told by what any three readings of a free motion must obey.

Readings of a free decay, or of any derivative of it, a fixed time s apart obey exactly

    x(t + s) = 2 exp(-b s) cos(w s) x(t) - exp(-2 b s) x(t - s) + constant,

so that no simulation is needed, and a force that acts for a while is seen while it acts and not
after, as a trajectory's misfit is. The end of a start is where the variance of what this law leaves
changes, by the largest likelihood, the law being that of what follows.

Missing physics leaves something too, and less as the motion decays: a force of third power leaves
a^3 where the amplitudes are in the ratio a. What changes at a start has to drop by more than the
amplitude does by far. Obstacles that large motions meet, a steep spring and a mode of the release
can do as much: this is to be asked where all of these have been looked for in vain.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as f_distribution

from bayesimpact.data.faults.fault import FALSE_ALARM, Fault, start_fault
from bayesimpact.data.recording import Recording
from bayesimpact.inference.fit import Fit

Array = NDArray[np.float64]

APART = 1 / 6  # of a period, between the three readings: 2 cos(w s) is 1, noise counts least
LONGEST = 3.0  # periods that a hand, a hammer or a settling filter lasts
SHARE = 0.4  # of the readings that count, at most: what follows has to say what is free
LEAST_ROWS = 12  # of what follows, for three unknowns and a variance
STEEPER = 3.0
"""Times the ratio of the amplitudes that what is left has to drop by. By root mean squares alone
(the median has to drop as well), of 80 simulated decays each
(damping ratios of 0.005 to 0.1, 6 to 100 readings per period, noise of 0.05 to 2 %) it is reached
by none that is linear or has dry friction, 4 with a cubic spring of up to 60 % of k1, 5 with
quadratic drag, 13 with a quintic spring, 34 with a bumper that the first swings meet and 38 with a
mode of the release; of 80 with a push of 0.2 to 3 periods by 76, and by 54 to 74 beside other
physics."""


@dataclass(frozen=True)
class StartOfFreeMotion:
    """The likeliest end of a forced start.

    Attributes
    ----------
    first : sample from which on the motion is free
    drop : what the law leaves before over that of the period after it, the root mean square or the
        median, whichever drops less: a spike is no start
    amplitudes : ratio of the amplitudes there, 1 at least
    chance : of so much more before than in all that follows, by noise alone
    """

    first: int
    drop: float
    amplitudes: float
    chance: float

    @property
    def is_forced(self) -> bool:
        """Whether neither noise nor physics that decays with the motion explains it."""
        return self.drop > STEEPER * self.amplitudes and self.chance < FALSE_ALARM


def forced_starts(fit: Fit) -> tuple[Fault, ...]:
    """First instants of free recordings without a stop and with one channel, that a force moved."""
    campaign = fit.density.oscillator.campaign
    channels, stiffness = any(r.motion_name for r in campaign.recordings), fit.value("k1")
    if campaign.stop or campaign.keep_faults or channels or not stiffness > 0.0:
        return ()
    period = 2 * np.pi * float(np.sqrt(campaign.mass / stiffness))
    found = []
    for recording in campaign.recordings:
        start = None if recording.input is not None else start_of_free(recording, period)
        if start is not None and start.is_forced:
            least = STEEPER * start.amplitudes
            found.append(start_fault(recording, start.first, start.drop, least))
    return tuple(found)


def start_of_free(recording: Recording, period: float) -> StartOfFreeMotion | None:
    """Where the variance of what the law of what follows leaves changes most, period in s; None
    where a recording is too short.
    """
    cycle = period / recording.interval
    rows = _Rows(recording, max(1, round(APART * cycle)), cycle)
    most = int(min(LONGEST * cycle, SHARE * recording.count))
    firsts = range(max(2, rows.apart // 2), most + 1, max(1, rows.apart // 3))
    tried = [(rows.log_likelihood(first), first) for first in firsts]
    tried = [one for one in tried if np.isfinite(one[0])]
    return rows.start_at(max(tried)[1], len(tried)) if tried else None


class _Rows:
    """The law's rows: readings that are `apart` by so many samples, three of which count."""

    def __init__(self, recording: Recording, apart: int, cycle: float) -> None:
        x = recording.samples - np.median(recording.samples)
        used = np.ones(x.size, bool) if recording.used is None else recording.used
        n = np.arange(apart, x.size - apart)
        n = n[used[n - apart] & used[n] & used[n + apart]]
        self.apart, self.cycle, self.begin = apart, cycle, n - apart
        self.columns = np.column_stack([x[n], x[n - apart], np.ones(n.size)])
        self.target = x[n + apart]
        beside = (self.target - x[n - apart]) / (2 * np.sin(2 * np.pi * apart / cycle))
        self.power = x[n] ** 2 + beside**2  # squared amplitude of a sine

    def _left(self, by: NDArray[np.bool_]) -> Array:
        """What the law of some rows leaves of all of them."""
        law = np.linalg.lstsq(self.columns[by], self.target[by], rcond=None)[0]
        return np.asarray(self.target - self.columns @ law)

    def log_likelihood(self, first: int) -> float:
        """Of a change of variance at a sample; -inf where too little would follow."""
        free = self.begin >= first
        if free.sum() < LEAST_ROWS or free.all():
            return -np.inf
        left = self._left(free)
        parts = [left[~free], left[free]]
        return -0.5 * float(sum(p.size * np.log(max(np.mean(p**2), 1e-300)) for p in parts))

    def start_at(self, first: int, tried: int) -> StartOfFreeMotion:
        """What changes at a sample; before it by the law of all rows, which leaves less there than
        one that is carried to amplitudes beyond those it was found at.
        """
        free = self.begin >= first
        near = free & (self.begin < first + self.cycle)
        before, after = self._left(np.ones(free.size, bool))[~free], self._left(free)
        drop = min(
            np.sqrt(size(before**2) / max(size(after[near] ** 2), 1e-300))
            for size in (np.mean, np.median)
        )
        amplitudes = np.sqrt(np.mean(self.power[~free]) / np.mean(self.power[near]))
        ratio = np.mean(before**2) / max(np.mean(after[free] ** 2), 1e-300)
        # a reading stands in three rows: half of them are taken to be independent
        chance = tried * f_distribution.sf(ratio, 0.5 * before.size, 0.5 * free.sum())
        return StartOfFreeMotion(first, float(drop), float(max(amplitudes, 1.0)), float(chance))
