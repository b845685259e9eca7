"""Initial estimates where recordings have a measured input: the equation of motion in weak form.

Initial conditions do not enter there, and all unknowns but the gap are found by linear least
squares over many stretches; the reading at which a recording touches the stop is scanned, for each
by itself. Recordings of other quantities are brought to displacements first
(`driven_displacement`), by what is known of the oscillator so far.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import Campaign
from bayesimpact.response.driven_displacement import (
    Guess,
    displacement_under,
    first_guess,
    without_base,
)
from bayesimpact.response.half_cycles import spectral_period
from bayesimpact.response.weak_form import Rows, least_squares, rows_of

Floats = NDArray[np.float64]

FREE, STOPPED = 0.6, 0.2  # half width of the bump, natural periods, without and with a stop
ROUNDS, ROUNDS_DERIVED = 3, 20  # the latter at most, where displacements are not read
PLACES = 41  # of the stop that are tried at once, between these quantiles of the readings
LOW, HIGH = 0.02, 0.98
FINER = 3  # rounds in which their spacing shrinks
SEEN = 1.5  # times less is left, in squares, where a stop is seen
LEAST_DAMPING = 1e-3  # damping ratio
STARTING = 1 / 6  # of a natural period: readings that tell the initial motion


@dataclass(frozen=True, eq=False)
class Driven:
    """What the weak form gives; names as in `bayesimpact.inference.initial.estimates.Estimates`.

    k2 : (cases,) NaN where an obstacle was never touched; gap infinite without a stop
    gain : of inputs with a free one; 1 without
    offset, y0, v0 : one per recording; offsets in the unit of the reading
    moved : displacements from rest, (n,) m, one per recording
    """

    k1: float
    c1: float
    gap: float
    c2: float
    k2: Floats
    gain: float
    offset: Floats
    y0: Floats
    v0: Floats
    moved: tuple[Floats, ...] = ()


def estimate_driven(campaign: Campaign) -> Driven:
    """Estimates from all recordings of a campaign, free decays among them.

    In rounds: the width of the bumps follows the natural period, and displacements that no probe
    read follow stiffnesses, gap and gain.
    """
    read = campaign.recordings
    onset, biases = np.full(len(read), np.inf), np.array([r.samples.mean() for r in read])
    guess = first_guess(read, campaign.mass, stop=campaign.stop)
    derived = not all(r.is_displacement for r in read)
    natural = 2 * np.pi * float(np.sqrt(guess.mass / guess.k1))
    if not derived:
        natural = float(np.median([spectral_period(r.samples) * r.interval for r in read]))
    for _ in range(ROUNDS_DERIVED if derived else ROUNDS):
        relative = [without_base(r, guess.gain) for r in read]
        moved = [displacement_under(r, guess, b) for r, b in zip(relative, biases, strict=True)]
        seen = replace(campaign, recordings=tuple(moved))
        width = (STOPPED if campaign.stop else FREE) * natural
        rows = [rows_of(r, campaign.mass, width) for r in relative]
        if campaign.stop:
            onset = np.array([_onset(seen, r, own) for r, own in enumerate(rows)])
        found = _solve(seen, rows, onset)
        biases = found.offset
        stiffness = found.k1 if found.k1 > 0.0 else campaign.mass * (2 * np.pi / natural) ** 2
        natural = 2 * np.pi * float(np.sqrt(campaign.mass / stiffness))
        before, guess = guess, _guess(campaign, found, stiffness, onset)
        if derived and guess.has_converged(before):
            break
    return _made_usable(seen, rows, found, stiffness)


def _guess(campaign: Campaign, found: Driven, k1: float, onset: Floats) -> Guess:
    """What the next displacements are made with."""
    if not campaign.stop:
        return Guess(campaign.mass, k1, found.gain)
    known = found.k2[found.k2 > 0.01 * k1]
    if not (np.isfinite(onset).any() and known.size):
        return Guess(campaign.mass, k1, found.gain, 0.0)
    return Guess(campaign.mass, k1, found.gain, found.gap, float(np.median(known)))


def _system(
    campaign: Campaign, chosen: Sequence[int], rows: Sequence[Rows], onset: Floats
) -> tuple[Floats, Floats]:
    """Matrix and right-hand side of the recordings `chosen`, whose rows and readings at impact
    these are; unknowns k1, c1, gain, [c2, k2 of every case], k1 times offsets.

    Where no gain is free, its column is 0.
    """
    cases = campaign.cases
    first = 3 + (1 + len(cases) if campaign.stop else 0)
    alike = len({own.order for own in rows}) == 1  # else in units of their own
    blocks, right = [], []
    for i, (r, own) in enumerate(zip(chosen, rows, strict=True)):
        recording = campaign.recordings[r]
        block = np.zeros((own.target.size, first + len(rows)))
        block[:, :2] = own.base[:, :2]
        target = own.target
        if recording.input is not None and recording.input.free:
            block[:, 2] = -own.base[:, 2]
        else:
            target = target + own.base[:, 2]
        if np.isfinite(onset[i]):
            inside = np.maximum(recording.samples - onset[i], 0.0)
            contact_products = own.of_force(inside)
            block[:, 3] = contact_products[:, 1]
            block[:, 4 + cases.index(recording.case)] = contact_products[:, 0]
        block[:, first + i] = -own.base[:, 3]
        size = 1.0 if alike else max(float(np.linalg.norm(own.target)), 1e-300)
        blocks.append(block / size)
        right.append(target / size)
    return np.concatenate(blocks), np.concatenate(right)


def _onset(campaign: Campaign, r: int, own: Rows) -> float:
    """Reading at which a recording, by itself, touches the stop; inf where none is seen."""

    def left(onset: float) -> float:
        return least_squares(*_system(campaign, [r], [own], np.array([onset])))[1]

    low, high = np.quantile(campaign.recordings[r].samples, [LOW, HIGH])
    best, least = np.inf, left(np.inf) / SEEN
    for _ in range(FINER):
        places = np.linspace(low, high, PLACES)
        lefts = [left(place) for place in places]
        at = int(np.argmin(lefts))
        if lefts[at] < least:
            best, least = float(places[at]), lefts[at]
        spacing = float(places[1] - places[0])
        low, high = places[at] - 2 * spacing, places[at] + 2 * spacing
    return best


def _solve(campaign: Campaign, rows: Sequence[Rows], onset: Floats) -> Driven:
    """Estimates without the initial motion."""
    solution, _ = least_squares(*_system(campaign, range(len(rows)), rows, onset))
    k1, c1, gain = (float(x) for x in solution[:3])
    c2, k2 = 0.0, np.zeros(0)
    if campaign.stop:
        c2, k2 = float(solution[3]), solution[4 : 4 + len(campaign.cases)]
    readings = [r.samples for r in campaign.recordings]
    offset = solution[-len(rows) :] / k1 if k1 > 0.0 else np.array([x.mean() for x in readings])
    free = any(r.input is not None and r.input.free for r in campaign.recordings)
    seen, rest = np.isfinite(onset), _rest(rows, offset)
    gap = np.inf
    if campaign.stop:  # never touched: no less than what was reached
        reached = [float(x.max()) for x in readings]
        gap = float(np.median((onset - rest)[seen]) if seen.any() else max(reached - rest))
    none = np.zeros(len(rows))
    return Driven(k1, c1, gap, c2, k2, gain if free else 1.0, offset, none, none)


def _rest(rows: Sequence[Rows], offset: Floats) -> Floats:
    """Where displacements rest: those behind a derivative count from there already."""
    return np.array([o if own.order == 0 else 0.0 for own, o in zip(rows, offset, strict=True)])


def _made_usable(campaign: Campaign, rows: Sequence[Rows], found: Driven, k1: float) -> Driven:
    """The same inside physical bounds, with the initial motion of every recording."""
    least = 2 * LEAST_DAMPING * float(np.sqrt(k1 * campaign.mass))
    y0, v0 = [], []
    rests = _rest(rows, found.offset)
    for recording, rest in zip(campaign.recordings, rests, strict=True):
        natural = 2 * np.pi * float(np.sqrt(campaign.mass / k1))
        count = int(np.clip(STARTING * natural / recording.interval, 4, recording.samples.size))
        times = recording.times[:count]
        degree = 2 if count < 8 else 3
        fit = np.polynomial.Polynomial.fit(times, recording.samples[:count] - rest, degree)
        y0.append(float(fit(0.0)))
        v0.append(float(fit.deriv()(0.0)))
    return Driven(
        k1=k1,
        c1=max(found.c1, least),
        gap=found.gap,
        c2=max(found.c2, least if campaign.stop else 0.0),
        k2=np.where(found.k2 > 0.01 * k1, found.k2, np.nan),
        gain=found.gain,
        offset=found.offset,
        y0=np.array(y0),
        v0=np.array(v0),
        moved=tuple(r.samples - o for r, o in zip(campaign.recordings, rests, strict=True)),
    )
