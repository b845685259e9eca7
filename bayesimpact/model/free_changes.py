"""Two independent free changes of a simulated motion, from which small forces can be superposed.

They are differences of simulations, so they carry every law and every contact, jumps at the touch
included. As they decay they drown in rounding: others take over, stretch by stretch.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.arguments import Inputs
from bayesimpact.model.motions import general_motions
from bayesimpact.model.oscillator import Oscillator
from bayesimpact.model.parameters import SLOTS

Array = NDArray[np.float64]
Laws = NDArray[np.int64]

FADED = 1e-2  # of its largest size a change keeps four digits: of the noise, rounding is 1e-9
POINTS = 6  # samples between which a response to pushes is interpolated
SHORTEST = POINTS + 2  # samples of a stretch
_Y0, _V0, _GAIN, _K1 = (SLOTS.index(name) for name in ("y0", "v0", "A", "k1"))


@dataclass(frozen=True, eq=False)
class Stretch:
    """Two free changes over a part of a recording.

    Attributes
    ----------
    begin : its first sample; the last one is the next stretch's first
    states : (n, 2, 2) displacement and velocity (middle axis) of both changes
    readings : (n, 2) what the recording reads of both
    """

    begin: int
    states: Array
    readings: Array


@dataclass(frozen=True, eq=False)
class FreeChanges:
    """Free changes of one recording's motion.

    Attributes
    ----------
    stretches : one after the other
    mass, interval : kg, s
    order : which time derivative of the displacement the recording reads
    """

    stretches: tuple[Stretch, ...]
    mass: float
    interval: float
    order: int

    @property
    def samples(self) -> int:
        """Of the recording."""
        last = self.stretches[-1]
        return int(last.begin + last.readings.shape[0])

    @property
    def direct(self) -> float:
        """What a newton adds to the reading at once: an acceleration holds the force itself."""
        return 1 / self.mass if self.order == 2 else 0.0

    @cached_property
    def pushes(self) -> tuple[Array, ...]:
        """Both changes (n, 2) that a unit impulse makes at every sample, per stretch.

        Raises
        ------
        LinAlgError : the mass sticks, and what it did before is forgotten
        """
        unit = np.array([[0.0], [1 / self.mass]])
        return tuple(np.linalg.solve(part.states, unit)[..., 0] for part in self.stretches)

    @cached_property
    def carried(self) -> Array:
        """What a change of the stretch before becomes at the begin of each, (S, 2, 2).

        Raises
        ------
        LinAlgError : as `pushes`
        """
        pairs = zip(self.stretches[1:], self.stretches, strict=False)
        found = [np.linalg.solve(part.states[0], last.states[-1]) for part, last in pairs]
        return np.array([np.zeros((2, 2)), *found])


def free_changes(oscillator: Oscillator, r: int, slots: Array, small: float) -> FreeChanges:
    """Changes of recording r's motion by the initial state, later ones by short pushes.

    Parameters
    ----------
    slots : (Q,) of the recording
    small : size of the changes, m: small enough to be linear
    """
    mass, interval = oscillator.campaign.mass, float(oscillator.intervals[r])
    last, rate = int(oscillator.counts[r]) - 1, float(np.sqrt(slots[_K1] / mass))
    apart = max(1, round(0.5 * np.pi / (rate * interval)))
    q = np.tile(slots, (3, 1))
    q[1, _Y0] += small
    q[2, _V0] += small * rate
    waves = np.zeros((3, last + 1))
    whole = _run(oscillator, r, q, waves)
    length = _fading(whole.states * [[1.0], [1 / rate]], 2 * apart + SHORTEST)
    begins = np.arange(0, max(last - SHORTEST, 1), length)
    found = [_part(whole, 0, last if begins.size == 1 else length)]
    q = np.tile(slots, (3, 1))
    runs = []
    for first in (1, 2):  # a push ends the stretch before in its own run: neighbours take turns
        waves[:] = 0.0
        for begin in begins[first::2]:
            waves[[1, 2], [begin - apart - 1, begin - 1]] = small * slots[_K1]
        runs.append(_run(oscillator, r, q, waves) if begins.size > first else whole)
    for number, begin in enumerate(begins[1:]):
        end = last if begin == begins[-1] else begin + length
        found.append(_part(runs[number % 2], int(begin), int(end)))
    return FreeChanges(tuple(found), mass, interval, int(oscillator.orders[r]))


def _run(oscillator: Oscillator, r: int, q: Array, waves: Array) -> Stretch:
    """Both changes over the whole recording."""
    own = int(oscillator.orders[r])
    rows = {n: motions_beside(oscillator, r, q, n, waves=waves) for n in {0, 1, own}}
    changes = {n: (x[1:] - x[0]).T for n, x in rows.items()}
    return Stretch(0, np.stack([changes[0], changes[1]], axis=1), changes[own])


def _part(whole: Stretch, begin: int, end: int) -> Stretch:
    return Stretch(begin, whole.states[begin : end + 1], whole.readings[begin : end + 1])


def _fading(states: Array, least: int) -> int:
    """Samples until one of two changes (n, 2, 2) falls to `FADED` of its largest size."""
    size = np.sqrt(np.sum(states**2, axis=1)).min(axis=1)
    to_come = np.maximum.accumulate(size[::-1])[::-1]
    faded = np.flatnonzero(to_come < FADED * np.maximum.accumulate(size))
    return max(int(faded[0]), least) if faded.size else states.shape[0] - 1


def motions_beside(
    oscillator: Oscillator,
    r: int,
    q: Array,
    order: int,
    *,
    laws: Laws | None = None,
    waves: Array | None = None,
) -> Array:
    """Motions (K, n) of recording r for slots (K, Q), with forces beside its own and its input.

    laws : table for the general simulator; None: the oscillator's own
    waves : (K, n) forces at the samples, N
    """
    rows = np.full(q.shape[0], r)
    inputs = None if oscillator.inputs is None else oscillator.inputs.of(rows)
    if waves is not None:
        q, waves = q.copy(), waves.copy()
        if inputs is None or inputs.starts[0] < 0:
            q[:, _GAIN] = 1.0
        else:
            first = int(inputs.starts[0])
            waves = waves / q[:, [_GAIN]] + inputs.values[first : first + waves.shape[1]]
        inputs = Inputs(waves.reshape(-1), np.arange(q.shape[0]) * waves.shape[1])
    return general_motions(
        q, oscillator.campaign.mass, oscillator.counts[rows], oscillator.intervals[rows],
        oscillator.laws if laws is None else laws, np.full(q.shape[0], order), inputs,
    )  # fmt: skip
