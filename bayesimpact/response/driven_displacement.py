"""The displacement behind a velocity, an acceleration or a motion in space, where an input drives.

A reading's integral I has the right cycles and a drift. What the equation of motion says has none:
the mass times its acceleration and the input leave the force of spring and stop, and this tells
where the mass is, roughly (restoring force: Masri and Caughey 1979, J. Appl. Mech. 46:433). So the
displacement is I plus the trend of the difference of both (smoother of Whittaker 1923 and
Henderson), slow against a cycle. An input may move the middle of the cycles, which anchors within
the cycles, as `displacement` has them, would take for drift.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.linalg import solveh_banded
from scipy.signal import savgol_filter

from bayesimpact.data.quantity import Quantity
from bayesimpact.data.recording import Recording
from bayesimpact.response.displacement import displacement_of
from bayesimpact.response.half_cycles import spectral_period
from bayesimpact.response.weak_form import least_squares, rows_of

Floats = NDArray[np.float64]

CORNER = (0.0, 0.15, 0.3)  # of the natural frequency: slower than that is trend, per order
BLOCKS = 30  # per radian of it, so that the smoother stays well conditioned at any sampling rate
WIDTH, ROUNDS = 0.6, 3  # half width of the bumps for a first guess, natural periods
SMALL = 0.4  # quantile of a force that is the spring's alone
CONVERGED = 0.01  # relative change in a round
SLOPE = 1 / 16  # of a period: half of the window in which a velocity is differentiated


@dataclass(frozen=True)
class Guess:
    """What is known of the oscillator so far.

    Attributes
    ----------
    mass, k1 : kg, N/m
    gain : of the input
    gap, k2 : of the stop, m and N/m; where k2 is 0 and the gap finite there is a stop of which
        nothing is known yet
    both : there is a stop on either side
    """

    mass: float
    k1: float
    gain: float
    gap: float = np.inf
    k2: float = 0.0
    both: bool = False

    def has_converged(self, before: Guess) -> bool:
        """True where a round has changed little."""
        own, other = np.array([(g.k1, g.gain, g.gap, g.k2) for g in (self, before)])
        known = np.isfinite(own) & np.isfinite(other)
        changed = np.abs(own[known] - other[known])
        return bool(np.all(changed <= CONVERGED * np.abs(other[known])))


def first_guess(
    recordings: Sequence[Recording], mass: float, *, stop: bool, free: bool = False
) -> Guess:
    """Stiffness and gain from the equation of motion, differentiated as often as readings are.

    Impacts make the stiffness too large, by some ten per cent, which hurts nothing that follows.

    free : take the gain as unknown everywhere: then any mass will do, and only ratios to it count
    """
    natural = float(
        np.median([spectral_period(r.samples, r.order) * r.interval for r in recordings])
    )
    k1, gain = mass * (2 * np.pi / natural) ** 2, 1.0
    for _ in range(ROUNDS):
        width = WIDTH * 2 * np.pi * float(np.sqrt(mass / k1))
        blocks, right = [], []
        for recording in recordings:
            relative = without_base(recording, gain)
            own = rows_of(relative, mass, width)
            base_term = own.base[:, 2]
            own_gain = free or (relative.input is not None and relative.input.free)
            size = max(float(np.linalg.norm(own.target)), 1e-300)
            known, unknown = (0.0, base_term) if own_gain else (base_term, 0.0 * base_term)
            blocks.append(np.column_stack([own.base[:, :2], -unknown, -own.base[:, 3]]) / size)
            right.append((own.target + known) / size)
        solution, _ = least_squares(np.concatenate(blocks), np.concatenate(right))
        k1 = float(solution[0]) if solution[0] > 0.0 else k1
        gain = float(solution[2]) if solution[2] != 0.0 else gain
    return Guess(mass, k1, gain, 0.0 if stop else np.inf)


def without_base(recording: Recording, gain: float) -> Recording:
    """The recording as one relative to the base, for this gain of its input."""
    if recording.input is None or not recording.input.absolute:
        return recording
    given = recording.input
    own = given.carried(recording.interval, recording.order)
    samples = recording.samples - gain * own
    return replace(recording, samples=samples, input=replace(given, absolute=False))


def seen_displacement(recording: Recording, *, both: bool = False) -> Recording:
    """The displacement from the recording alone, whatever mass and gain of its input are.

    Of a free decay by its own anchors, see `displacement`. `both` says that there are two stops.
    """
    if recording.is_displacement:
        return recording
    if recording.input is None:
        quantity: Quantity = "angle" if recording.angular else "displacement"
        return replace(
            recording, samples=displacement_of(recording, both=both).samples, quantity=quantity
        )
    guess = replace(first_guess([recording], 1.0, stop=True, free=True), both=both)
    return displacement_under(recording, guess, float(recording.samples.mean()))


def displacement_under(recording: Recording, guess: Guess, bias: float) -> Recording:
    """A recording as one of displacement, relative to a base.

    bias : offset of a probe of a velocity or an acceleration, in its unit; the displacement behind
        it counts from rest. A displacement keeps its rest reading
    """
    relative = without_base(recording, guess.gain)
    order, dt = relative.order, relative.interval
    if order == 0:
        return relative
    rate = np.sqrt(guess.k1 / guess.mass)
    moving = relative.samples - bias
    times = np.arange(moving.size) * dt
    integral = CubicSpline(times, moving).antiderivative(order)(times)
    place, known = _place(relative, moving, guess)
    drift = trend(place - integral, known, CORNER[order] * rate * dt, order)
    quantity: Quantity = "angle" if relative.angular else "displacement"
    return replace(relative, samples=integral + drift, quantity=quantity)


def _place(recording: Recording, moving: Floats, guess: Guess) -> tuple[Floats, Floats]:
    """Where the force of spring and stop says that the mass is, (n,) m, and 1.0 where it does."""
    acceleration, dt = moving, recording.interval
    if recording.order == 1:
        period = 2 * np.pi * np.sqrt(guess.mass / guess.k1) / dt
        half = max(2, min(round(SLOPE * period), (moving.size - 1) // 2))
        acceleration = savgol_filter(moving, 2 * half + 1, 3, deriv=1, delta=dt)
    force = -guess.mass * acceleration
    if recording.input is not None:
        force = force + guess.gain * recording.input.shown(guess.mass, dt)
    place = force / guess.k1
    if not np.isfinite(guess.gap):
        return place, np.ones(place.size)
    if guess.both:  # where the force is small, no stop has a part in it
        return place, np.where(np.abs(place) < np.quantile(np.abs(place), SMALL), 1.0, 0.0)
    if guess.k2 == 0.0:  # on the side away from the stop it is the spring's alone
        return place, np.where(place < 0.0, 1.0, 0.0)
    touching = (force + guess.k2 * guess.gap) / (guess.k1 + guess.k2)
    return np.where(place > guess.gap, touching, place), np.ones(place.size)


def trend(values: Floats, weights: Floats, corner: float, order: int) -> Floats:
    """Slow part (n,) of values (n,), by squared differences of this order against it.

    corner : angular frequency per sample at which half of an amplitude is trend
    """
    step = max(1, int(1.0 / (BLOCKS * corner)))
    edges = np.arange(0, values.size, step)
    share = np.add.reduceat(weights, edges)
    middle = np.add.reduceat(np.arange(values.size, dtype=np.float64), edges)
    middle /= np.diff(np.append(edges, values.size))
    if edges.size <= order + 2 or share.sum() == 0.0:
        return np.full(values.size, np.average(values))
    stiffness = step / (corner * step) ** (2 * order)
    difference = np.diff(np.eye(order + 1), order, axis=0)[0]
    band = np.zeros((order + 1, edges.size))
    for lag in range(order + 1):
        for first in range(order + 1 - lag):
            span = slice(first, edges.size - order + first)
            band[lag, span] += stiffness * difference[first] * difference[first + lag]
    band[0] += share
    slow = solveh_banded(band, np.add.reduceat(weights * values, edges), lower=True)
    return np.asarray(CubicSpline(middle, slow)(np.arange(values.size)))
