"""How the recordings would change under a small force of the state, without simulating it.

About a fitted motion a small force f(t) moves the state by

    (u, u')(t) = Phi(t) W(t),     W(t) = -1/m int_0^t Phi(s)^-1 (0, 1) f(s) ds,

where Phi is the derivative of the state with respect to the initial one, jumps at the obstacle
included (Mueller 1995, Chaos Solitons Fractals 5:1671, saltation). Phi is had from four simulated
motions per recording; after that every term of the grammar costs one sum over its own force history
along the motion. A spline a(y) + b(y) v would show only what is linear in v; the force history
itself, scored on the residual, tells |v| v from v.

Of laws with a memory or a further mode in the fitted model only displacement and velocity are
perturbed here; such a score is approximate, and the refit that follows is not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.formula.grammar import ONE, Term
from bayesimpact.inference.fit import Fit
from bayesimpact.model.motions import general_motions, motions
from bayesimpact.model.parameters import BASE_SLOTS, SLOTS

Array = NDArray[np.float64]

STEP = 1e-4  # of the initial state, relative to amplitude and speed
POINTS = 200  # in a free period; errors are below 0.5 % (2 % for a box) of a response, by test
FINEST = 12  # times finer than the samples
BLOCK = 64  # terms at once, so that memory stays bounded
_Y0, _V0, _GAP = (SLOTS.index(n) for n in ("y0", "v0", "g"))


@dataclass(frozen=True, eq=False)
class Motion:
    """One recording's fitted motion on a grid `factor` times as fine as its samples.

    Attributes
    ----------
    y, v, d, t : displacement m, velocity m/s, indentation m, time s, (n,)
    kernel : (2, n) Phi^-1 (0, 1) / -m
    rows : (2, samples) derivative of what the probe reads, before filter, by the initial state
    direct : what an acceleration reads of the force itself, 1/kg; 0 for other quantities
    steps : (2, n - 1) weights of both ends of every step in an integral over time, s
    factor : fine steps in a sample
    """

    y: Array
    v: Array
    d: Array
    t: Array
    kernel: Array
    rows: Array
    direct: float
    steps: Array
    factor: int


def motion_of(fit: Fit, r: int) -> Motion:
    """The fitted motion of one recording and its dependence on the initial state."""
    oscillator = fit.target.oscillator
    mass, interval = oscillator.campaign.mass, float(oscillator.intervals[r])
    q = oscillator.layout.slots(fit.mode)[r]
    period = 2 * np.pi * np.sqrt(mass / q[SLOTS.index("k1")])
    factor = int(np.clip(np.ceil(POINTS * interval / period), 1, FINEST))
    if oscillator.inputs is not None:  # a measured force is known at the samples
        factor = 1
    count = (int(oscillator.counts[r]) - 1) * factor + 1
    reach = float(np.abs(fit.displacements[r]).max())
    steps = STEP * reach * np.array([1.0, 2 * np.pi / period])
    points = np.repeat(q[None], 5, axis=0)
    for i, slot in enumerate((_Y0, _V0)):
        points[1 + 2 * i, slot] += steps[i]
        points[2 + 2 * i, slot] -= steps[i]
    order = int(oscillator.orders[r])
    y, v = (_simulated(fit, r, points, k, count, interval / factor) for k in (0, 1))
    change = [(x[1::2] - x[2::2]) / (2 * steps[:, None]) for x in (y, v)]
    read = change[order] if order < 2 else _change_of_acceleration(fit, r, points, steps)
    (a, b), (c, e) = change
    kernel = np.stack([b, -a]) / ((a * e - b * c) * mass)
    d = y[0] - q[_GAP] if oscillator.campaign.stop else np.full(count, -np.inf)
    return Motion(
        y[0], v[0], d, np.arange(count, dtype=np.float64) * (interval / factor), kernel,
        read[:, ::factor] if order < 2 else read, -1 / mass if order == 2 else 0.0,
        _steps(v[0], d, interval / factor),
        factor,
    )  # fmt: skip


def _simulated(fit: Fit, r: int, points: Array, order: int, count: int, interval: float) -> Array:
    """Motions, (B, count), of slot vectors (B, Q)."""
    oscillator = fit.target.oscillator
    size = points.shape[0]
    inputs = None if oscillator.inputs is None else oscillator.inputs.of(np.full(size, r))
    counts, intervals = np.full(size, count, dtype=np.int64), np.full(size, interval)
    orders, mass = np.full(size, order, dtype=np.int64), oscillator.campaign.mass
    if oscillator.is_base:
        base = np.ascontiguousarray(points[:, : len(BASE_SLOTS)])
        return motions(base, mass, counts, intervals, orders, inputs)
    return general_motions(points, mass, counts, intervals, oscillator.laws, orders, inputs)


def _change_of_acceleration(fit: Fit, r: int, points: Array, steps: Array) -> Array:
    oscillator = fit.target.oscillator
    count, interval = int(oscillator.counts[r]), float(oscillator.intervals[r])
    x = _simulated(fit, r, points, 2, count, interval)
    return np.asarray((x[1::2] - x[2::2]) / (2 * steps[:, None]))


def _steps(v: Array, d: Array, h: float) -> Array:
    """Weights of the first and of the last point of every step, (2, n - 1), s.

    The trapezoidal rule with Gregory's corrections at every touch and turn, where forces jump: a
    sum over a whole swing is then as good as its ends. The rest of a step to that moment is the
    integral of the parabola through the three nearest points on its side.
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


def responses(motion: Motion, terms: Sequence[Term]) -> tuple[Array, Array, Array]:
    """What the probe would read of each term's force of unit size, before its filter.

    Returns
    -------
    responses (K, samples); the largest force of each term along the motion, (K,); its mean power
    with the motion, W, (K,)
    """
    out = np.empty((len(terms), motion.rows.shape[1]))
    largest, power = np.empty(len(terms)), np.empty(len(terms))
    for first in range(0, len(terms), BLOCK):
        block = slice(first, first + BLOCK)
        forces = _forces(motion, terms[block])
        out[block] = _answers(motion, forces)
        largest[block] = np.maximum(forces.max(axis=1), -forces.min(axis=1))
        power[block] = forces @ motion.v / motion.v.size
    return out, largest, power


def _answers(motion: Motion, forces: Array) -> Array:
    """Responses (K, samples) to forces along the motion (K, n)."""
    before, after = motion.steps[0] * motion.kernel[:, :-1], motion.steps[1] * motion.kernel[:, 1:]
    count, samples = forces.shape[0], motion.rows.shape[1]
    inner = before[:, 1:] + after[:, :-1]
    nodes = np.concatenate([before[:, :1], inner], axis=1).reshape(2, samples - 1, motion.factor)
    cells = forces[:, :-1].reshape(count, samples - 1, motion.factor)
    state = np.zeros((count, 2, samples))
    np.cumsum(np.einsum("ksf,tsf->tks", nodes, cells), axis=2, out=state[:, :, 1:])
    at_samples = forces[:, :: motion.factor]
    last = after[:, motion.factor - 1 :: motion.factor]  # the last half step to each sample
    state[:, :, 1:] += last * at_samples[:, None, 1:]
    out = np.einsum("ks,tks->ts", motion.rows, state)
    return np.asarray(out + motion.direct * at_samples if motion.direct else out)


def _forces(motion: Motion, terms: Sequence[Term]) -> Array:
    """Force of each term along the motion, (K, n); factors that terms share are computed once."""
    out = np.empty((len(terms), motion.y.size))
    known: dict[object, Array] = {}
    for i, term in enumerate(terms):
        where = replace(term, speed=ONE, fade=0.0, drift=0)
        if where not in known:
            known[where] = where.of_position(motion.y, motion.d)
        speed = (term.speed, term.fade)
        if speed not in known:
            known[speed] = term.of_speed(motion.v)
        np.multiply(known[where], known[speed], out=out[i])
        if term.drift:
            out[i] *= motion.t
    return out


def largest_force(
    motions: Sequence[Motion], terms: Sequence[Term], sizes: Sequence[float]
) -> float:
    """Peak of the force of some terms together along all motions, N."""
    weights = np.array(sizes)
    return max(float(np.abs(weights @ _forces(m, terms)).max()) for m in motions)
