"""How a recording would change under small forces along its motion, without simulating them.

About a motion the state's change obeys a linear equation, whatever laws act: it is a sum of two
free changes (`free_changes`, jumps at the obstacle included), and a force changes both, instant by
instant (variation of parameters: Coddington and Levinson 1955, chapter 3). The free changes are had
from a few simulated motions; after that every force costs one sum over its history.

Of laws with a memory or a further mode only displacement and velocity are perturbed here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.jit.workload import count
from bayesimpact.model.linear_response.free_changes import FreeChanges, free_changes
from bayesimpact.model.oscillator import Oscillator
from bayesimpact.model.parameters import SLOTS

Array = NDArray[np.float64]

STEP = 1e-6  # of the state, over the largest one: small enough for free changes
POINTS = 200  # in a free period; errors are below 0.5 % (2 % for a box) of a response, by test
FINEST = 12  # times finer than the samples
_GAP, _K1 = (SLOTS.index(n) for n in ("g", "k1"))


@dataclass(frozen=True, eq=False)
class Motion:
    """One recording's motion on a grid `factor` times as fine as its samples.

    Attributes
    ----------
    y, v, d, t : displacement m, velocity m/s, indentation m, time s, (n,)
    changes : its free changes on that grid
    steps : (2, n - 1) weights of both ends of every step in an integral over time, s
    factor : fine steps in a sample
    """

    y: Array
    v: Array
    d: Array
    t: Array
    changes: FreeChanges
    steps: Array
    factor: int

    @property
    def samples(self) -> int:
        """Of the recording."""
        return (self.y.size - 1) // self.factor + 1


def motion_along(oscillator: Oscillator, r: int, q: Array, reach: float) -> Motion:
    """Recording r's motion for slots q (Q,), of displacements up to `reach` m; its free changes."""
    rate = np.sqrt(q[_K1] / oscillator.campaign.mass)
    points = POINTS * float(oscillator.intervals[r]) * rate / (2 * np.pi)
    factor = int(np.clip(np.ceil(points), 1, FINEST))
    changes = free_changes(oscillator, r, q, STEP * reach, factor=factor)
    y, v = changes.motion
    d = y - q[_GAP] if oscillator.campaign.stop else np.full(y.size, -np.inf)
    t, steps = np.arange(y.size) * changes.interval, _steps(v, d, changes.interval)
    return Motion(y, v, d, t, changes, steps, factor)


def _steps(v: Array, d: Array, h: float) -> Array:
    """Weights of the first and of the last point of every step, (2, n - 1), s.

    The trapezoidal rule with Gregory's corrections at every contact onset and turning point, where
    forces jump: a sum over a whole cycle is then as good as its ends. The rest of a step to that
    moment is the integral of the parabola through the three nearest points on its side.
    """
    weights = np.full((2, v.size - 1), 0.5 * h)
    for x, rate in ((v, None), (d, v)):
        if not np.isfinite(x).all():
            continue
        i = np.flatnonzero(np.sign(x[1:]) * np.sign(x[:-1]) < 0)
        i = i[(i > 1) & (i < v.size - 3)]
        share = x[i] / (x[i] - x[i + 1])
        if rate is not None:
            share = _crossing(share, x[i], x[i + 1], h * rate[i], h * rate[i + 1])
        weights[:, i] = 0.0
        for side, step, part in ((0, -1, share), (1, 1, 1.0 - share)):
            for k, own in enumerate(_end(part)):
                np.add.at(weights[side], i + step * k, h * own)
    return weights


def _end(part: Array) -> tuple[Array, Array, Array]:
    """Weights, in steps, of the last three points before a jump that lies `part` of a step on."""
    slope, bend = part**2 / 4, part**3 / 6 - 1 / 24
    return part + 3 * slope + bend - 1 / 12, -4 * slope - 2 * bend + 1 / 12, slope + bend


def _crossing(u: Array, x0: Array, x1: Array, r0: Array, r1: Array) -> Array:
    """Zero of the cubic with values x and slopes r at 0 and 1, from near u: two Newton steps."""
    for _ in range(2):
        a, b = 2 * (x0 - x1) + r0 + r1, 3 * (x1 - x0) - 2 * r0 - r1
        value = ((a * u + b) * u + r0) * u + x0
        slope = (3 * a * u + 2 * b) * u + r0
        u = np.clip(u - value / np.where(slope == 0.0, np.inf, slope), 0.0, 1.0)
    return u


@dataclass(frozen=True, eq=False)
class StateSpace:
    """How forces change one recording, sample by sample, by way of both free changes.

    Attributes
    ----------
    readings : (n, 2), the reading's quantity per unit of either
    increments : (n, 2), what a newton during the interval before a sample adds to either
    transitions : (n, 2, 2), what either becomes at a sample, where others take their place
    """

    readings: Array
    increments: Array
    transitions: Array


def state_space(motion: Motion) -> StateSpace:
    """The motion's free changes at its samples; what an acceleration reads of a force at once is
    left out.
    """
    n, changes, factor = motion.samples, motion.changes, motion.factor
    readings, increments = np.zeros((n, 2)), np.zeros((n, 2))
    transitions = np.tile(np.eye(2), (n, 1, 1))
    parts = zip(changes.stretches, changes.impulses, changes.carried, strict=True)
    for part, impulses, carried in parts:
        own = slice(part.begin, part.begin + part.readings.shape[0] - 1)
        rows = part.readings[::factor]
        first, count = part.begin // factor, rows.shape[0]
        unit = np.ones((1, part.readings.shape[0]))
        states = _states(-impulses.T, unit, motion.steps[:, own], factor)[:, 0]
        if first > 0:
            transitions[first] = carried
        readings[first : first + count] = rows
        increments[first + 1 : first + count] = np.diff(states, axis=1).T
    return StateSpace(readings, increments, transitions)


def answers(motion: Motion, forces: Array) -> Array:
    """What the probe would read of forces (K, n) along the motion, before its filter, (K, samples).

    Laws stand on the left-hand side: their force acts against the motion's direction.
    """
    count(forces.size, "response")
    out = np.empty((forces.shape[0], motion.samples))
    state = np.zeros((2, forces.shape[0]))
    changes, factor = motion.changes, motion.factor
    for part, impulses, carried in zip(
        changes.stretches, changes.impulses, changes.carried, strict=True
    ):
        own = slice(part.begin, part.begin + part.readings.shape[0])
        rows = part.readings[::factor].T
        first = part.begin // factor
        state = carried @ state
        states = _states(
            -impulses.T, forces[:, own], motion.steps[:, own][:, : impulses.shape[0] - 1], factor
        )
        states += state[..., None]
        np.einsum("ks,kts->ts", rows, states, out=out[:, first : first + rows.shape[1]])
        state = states[..., -1]
    return out - changes.direct * forces[:, ::factor] if changes.direct else out


def _states(impulses: Array, forces: Array, steps: Array, factor: int) -> Array:
    """What forces (K, n) make of both free changes by every sample, (2, K, samples)."""
    before, after = steps[0] * impulses[:, :-1], steps[1] * impulses[:, 1:]
    number, samples = forces.shape[0], (forces.shape[1] - 1) // factor + 1
    inner = before[:, 1:] + after[:, :-1]
    nodes = np.concatenate([before[:, :1], inner], axis=1).reshape(2, samples - 1, factor)
    nodes[:, 1:, 0] = before[:, factor::factor]  # what ends at a sample is added there
    cells = forces[:, :-1].reshape(number, samples - 1, factor)
    last = after[:, None, factor - 1 :: factor] * forces[:, factor::factor]
    states = np.zeros((2, number, samples))
    np.cumsum(np.einsum("ksf,tsf->kts", nodes, cells) + last, axis=2, out=states[:, :, 1:])
    return states
