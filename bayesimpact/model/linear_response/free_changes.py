"""Two independent free changes of a simulated motion, from which small forces can be superposed.

They are differences of simulations, so they carry every law and every contact, jumps at impact
included. As they decay they drown in rounding, and where contacts stretch the motion they turn
parallel: others take over, stretch by stretch. Where the mass sticks there are none, and it does
not answer.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.exact.arguments import Inputs
from bayesimpact.model.motions import general_motions
from bayesimpact.model.oscillator import Oscillator
from bayesimpact.model.parameters import SLOTS

Array = NDArray[np.float64]
Laws = NDArray[np.int64]
Mask = NDArray[np.bool_]
Places = NDArray[np.int64]

FADED = 1e-2  # of its largest size a change keeps four digits: of the noise, rounding is 1e-9
ALIGNED = 1e-2  # sine between two changes, displacement and velocity in units of their size
PARALLEL = 0.1  # a sine below which they stay to the end of a stretch: others take over
ROUNDS = 4  # of stretches divided where their changes turn parallel
POINTS = 6  # samples between which a response to impulses is interpolated
SHORTEST = POINTS + 2  # samples of a stretch
_Y0, _V0, _GAIN, _K1 = (SLOTS.index(name) for name in ("y0", "v0", "A", "k1"))
_BODIES = [SLOTS.index(name) for name in ("second_gain", "obstacle_mass", "frame_ratio")]


@dataclass(frozen=True, eq=False)
class Stretch:
    """Two free changes over a part of a recording.

    Attributes
    ----------
    begin : its first point; the last one is the next stretch's first
    states : (n, 2, 2) displacement and velocity (middle axis) of both changes
    readings : (n, 2) what the recording reads of both
    """

    begin: int
    states: Array
    readings: Array

    @cached_property
    def sine(self) -> Array:
        """Of the angle between both changes, (n,); 0 where one of them is none."""
        size = np.sqrt(np.mean(self.states**2, axis=(0, 2)))
        scaled = self.states / np.where(size > 0.0, size, 1.0)[:, None]
        one, other = np.linalg.norm(scaled, axis=1).T
        product = one * other
        return np.asarray(np.abs(np.linalg.det(scaled)) / np.where(product > 0.0, product, 1.0))

    @cached_property
    def apart(self) -> Mask:
        """Where both changes still tell displacement from velocity, (n,): not where friction holds
        the mass, or it creeps under a root of its speed, for there no small force moves it.
        """
        return np.asarray(self.sine > ALIGNED)

    def parallel_from(self, held: Mask) -> int | None:
        """From where on both changes stay parallel, although the mass moves; None where they do
        not. Where it is `held` (n,) they say nothing.
        """
        to_come = np.maximum.accumulate(np.where(held, 0.0, self.sine)[::-1])[::-1]
        found = np.flatnonzero((to_come < PARALLEL) & ~held)
        return int(found[0]) if found.size else None


@dataclass(frozen=True, eq=False)
class FreeChanges:
    """Free changes of one recording's motion.

    Attributes
    ----------
    stretches : one after the other
    motion : (2, n) displacement, m, and velocity, m/s, of the motion that is changed
    mass, interval : kg, s between points, one or several of which make a sample
    order : which time derivative of the displacement the recording reads
    """

    stretches: tuple[Stretch, ...]
    motion: Array
    mass: float
    interval: float
    order: int

    @property
    def points(self) -> int:
        """Of the recording: its samples, where there is one point for each."""
        last = self.stretches[-1]
        return int(last.begin + last.readings.shape[0])

    @property
    def direct(self) -> float:
        """What a newton adds to the reading at once: an acceleration holds the force itself."""
        return 1 / self.mass if self.order == 2 else 0.0

    @cached_property
    def impulses(self) -> tuple[Array, ...]:
        """Both changes (n, 2) that a unit impulse makes at every sample, per stretch."""
        unit = np.array([[0.0], [1 / self.mass]])
        return tuple(_solved(part.states, part.apart, unit)[..., 0] for part in self.stretches)

    @cached_property
    def carried(self) -> Array:
        """What a change of the stretch before becomes at the begin of each, (S, 2, 2)."""
        pairs = zip(self.stretches[1:], self.stretches, strict=False)
        found = [_solved(p.states[:1], p.apart[:1], last.states[-1])[0] for p, last in pairs]
        return np.array([np.zeros((2, 2)), *found])


def free_changes(
    oscillator: Oscillator, r: int, slots: Array, small: float, *, factor: int = 1
) -> FreeChanges:
    """Changes of recording r's motion by the initial state, later ones by short impulses; where
    these turn parallel, by states begun anew.

    Parameters
    ----------
    slots : (Q,) of the recording
    small : size of the changes, m: small enough to be linear
    factor : points per sample
    """
    mass, interval = oscillator.campaign.mass, float(oscillator.intervals[r]) / factor
    last, rate = (int(oscillator.counts[r]) - 1) * factor, float(np.sqrt(slots[_K1] / mass))
    quarter = max(1, round(0.5 * np.pi / (rate * interval)))
    own = int(oscillator.orders[r])
    waves = np.zeros((3, last + 1))

    def motions(q: Array, restarts: Sequence[Array] = ()) -> dict[int, Array]:
        return {
            n: motions_beside(
                oscillator, r, q, n, waves=waves[: len(q)], factor=factor, restarts=restarts
            )
            for n in {0, 1, own}
        }

    base = motions(slots[None])
    motion = np.concatenate([base[0], base[1]])
    held = motion[1] == 0.0  # where the mass stays is not forgotten, and an impulse moves nothing
    moved = small * np.array([[0.0, 0.0], [1.0, 0.0], [0.0, rate]])

    def changes(rows: dict[int, Array], from_rows: dict[int, Array]) -> Stretch:
        """Two motions less one, over the whole recording."""
        apart = {n: (x[-2:] - from_rows[n][0]).T for n, x in rows.items()}
        return Stretch(0, np.stack([apart[0], apart[1]], axis=1), apart[own])

    def by_impulses(begins: Places) -> Stretch:
        """Changes anew before some points, by two short impulses."""
        waves[:] = 0.0
        for begin in begins:
            waves[[0, 1], [begin - quarter - 1, begin - 1]] = small * slots[_K1]
        found = changes(motions(np.tile(slots, (2, 1))), base)
        waves[:] = 0.0
        return found

    def by_restarts(begins: Places) -> Stretch:
        """Changes anew from some points on, whatever they were before."""
        states = [np.column_stack([begins, motion[:, begins].T + move]) for move in moved]
        rows = motions(np.tile(slots, (3, 1)), states)
        return changes(rows, rows)

    def stretches(begins: Places, anew: Callable[[Places], Stretch]) -> tuple[Stretch, ...]:
        """Each ends where the next one begins, in the other one of two runs."""
        runs = [anew(begins[first::2]) for first in (1, 2)[: begins.size - 1]]
        ends = [*(int(b) for b in begins[1:]), last]
        found = [_part(whole, 0, ends[0])]
        for i, (begin, end) in enumerate(zip(begins[1:], ends[1:], strict=True)):
            found.append(_part(runs[i % 2], int(begin), end))
        return tuple(found)

    def length(points: int) -> int:
        """Of a stretch; they begin on samples."""
        return -(-max(points, 2 * quarter + SHORTEST) // factor) * factor

    q = np.tile(slots, (2, 1))
    q[:, [_Y0, _V0]] += moved[1:]
    whole = changes(motions(q), base)
    faded = length(_fading(whole.states * [[1.0], [1 / rate]]))
    begins = np.arange(0, max(last - SHORTEST, 1), faded, dtype=np.int64)
    begins = begins[[b == 0 or not held[b - quarter - 1 : b + 1].any() for b in begins]]
    found = stretches(begins, by_impulses)
    for _ in range(ROUNDS if _may_restart(oscillator, slots) else 0):
        more = [
            np.arange(part.begin, part.begin + part.states.shape[0] - SHORTEST, length(at))[1:]
            for part in found
            if (at := part.parallel_from(held[part.begin :][: part.states.shape[0]])) is not None
        ]
        divided = np.unique(np.concatenate([begins, *more]))
        divided = divided[(divided == 0) | ~held[divided]]
        if divided.size == begins.size:
            break
        begins, found = divided, stretches(divided, by_restarts)
    return FreeChanges(found, motion, mass, interval, own)


def _may_restart(oscillator: Oscillator, slots: Array) -> bool:
    """Whether displacement and velocity are all that a motion is begun anew from: no law remembers
    a place, no body or mode moves by itself.
    """
    laws = [e.law for e in oscillator.acting if e.law is not None]
    return not (np.any(slots[_BODIES]) or any(law.rate or law.travel for law in laws))


def _solved(states: Array, apart: Mask, wanted: Array) -> Array:
    """Sizes of both changes (n, 2, k) that make states (2, k) of them; 0 where they are alike."""
    found = np.zeros((*states.shape[:2], wanted.shape[1]))
    found[apart] = np.linalg.solve(states[apart], wanted)
    return found


def _part(whole: Stretch, begin: int, end: int) -> Stretch:
    return Stretch(begin, whole.states[begin : end + 1], whole.readings[begin : end + 1])


def _fading(states: Array) -> int:
    """Points until one of two changes (n, 2, 2) falls to `FADED` of its largest size."""
    size = np.sqrt(np.sum(states**2, axis=1)).min(axis=1)
    to_come = np.maximum.accumulate(size[::-1])[::-1]
    faded = np.flatnonzero(to_come < FADED * np.maximum.accumulate(size))
    return int(faded[0]) if faded.size else states.shape[0] - 1


def motions_beside(
    oscillator: Oscillator,
    r: int,
    q: Array,
    order: int,
    *,
    laws: Laws | None = None,
    waves: Array | None = None,
    factor: int = 1,
    restarts: Sequence[Array] = (),
) -> Array:
    """Motions (K, n) of recording r for slots (K, Q), with forces beside its own and its input.

    laws : table for the general simulator; None: the oscillator's own
    waves : (K, n) forces at the points, N
    factor : points per sample
    restarts : per row points and states from which it begins anew, see `integrate_many`
    """
    count = (int(oscillator.counts[r]) - 1) * factor + 1
    own = _measured_input(oscillator, r, factor)
    if waves is None:
        inputs = None if own is None else Inputs(own, np.zeros(q.shape[0], dtype=np.int64))
    else:
        if own is None:
            q = q.copy()
            q[:, _GAIN] = 1.0
            inputs = Inputs(waves.reshape(-1), np.arange(q.shape[0]) * count)
        else:  # the impulses act at the samples as well, and add nothing to readings of their own
            acting = np.array([[1.0], [1.0], [0.0]])[..., None]
            both = own[:, None] + acting * (waves / q[:, [_GAIN]])
            inputs = Inputs(both.reshape(3, -1), np.arange(q.shape[0]) * count)
    return general_motions(
        q, oscillator.campaign.mass, np.full(q.shape[0], count),
        np.full(q.shape[0], float(oscillator.intervals[r]) / factor),
        oscillator.laws if laws is None else laws, np.full(q.shape[0], order), inputs, restarts,
    )  # fmt: skip


def _measured_input(oscillator: Oscillator, r: int, factor: int) -> Array | None:
    """Recording r's input at its points, (3, n) as in `Inputs`, for motions; None without one.

    Linear between the samples.
    """
    inputs = None if oscillator.inputs is None else oscillator.inputs.of(np.array([r]))
    if inputs is None or inputs.starts[0] < 0:
        return None
    first, count = int(inputs.starts[0]), int(oscillator.counts[r])
    values = inputs.of_motion().values[:, first : first + count]
    points = np.arange((count - 1) * factor + 1) / factor
    if factor == 1:
        return values
    return np.stack([np.interp(points, np.arange(count), row) for row in values])
