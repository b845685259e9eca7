"""A release that takes a while, by the equation of motion in flight: a magnet's field that fades, a
thread that stretches, a hand.

Between the first sample and the first contact, or without a stop in the first half period, the mass
moves as it does in every later flight, by the same laws, but for what still holds it. That force is
seen along the measured motion while it acts; what it does to a simulation lasts to the end, and a
hysteresis or a drag is found in its place. So the laws that stretches of flight ask for are sought
with and without first flights. What more is left of these than of what follows is held against the
flights that come second: missing physics leaves more in a larger motion too, but does not end.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import f as f_distribution

from bayesimpact.data.faults.fault import FALSE_ALARM, Fault, start_fault
from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.candidates.equation_error import Path, measured_paths
from bayesimpact.diagnosis.candidates.likely_sets import LikelySets
from bayesimpact.diagnosis.faults.forced_start import STEEPER
from bayesimpact.diagnosis.faults.unfree_start import POWER
from bayesimpact.diagnosis.thresholds import ALPHA
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect, Scales

MOST = 3  # effects that the equation may have
LEAST_ROWS = 12  # stretches that have to follow, for the laws of flight

Span = tuple[int, int]


@dataclass(frozen=True)
class _Squares:
    """What laws, by their ids, leave of some stretches, in units of their noise, and the number of
    these; of noise alone as much as their number.
    """

    left: float
    rows: int
    laws: Sequence[str]

    def beyond(self, other: _Squares) -> float:
        """Mean square of what is left of the stretches that the other has not."""
        more = max(self.rows - other.rows, 1)
        return max(self.left - other.left, 0.0) / more


def soft_releases(
    fit: Fit, effects: Sequence[Effect], scales: Scales, rested: Collection[str] = ()
) -> tuple[Fault, ...]:
    """First flights of free recordings in which something holds the mass that no law of flight
    explains; of motions with one channel each. Without a stop, of recordings that began with a rest
    only: a push is told otherwise (`pushed_start`), and so is what a release sets off.

    Recordings of one rig are released alike: where it stands out over all of them together, each is
    asked no more than whether it shows it beside the laws of what follows; and where most do, it is
    left out of all, for what is too little to show would still be taken for a law of the largest
    motions.
    """
    campaign = fit.density.oscillator.campaign
    channels = any(r.motion_name for r in campaign.recordings)
    driven = fit.density.oscillator.inputs is not None
    if campaign.keep_faults or driven or channels or scales.stiffness <= 0.0:
        return ()
    paths = measured_paths(fit, flight=True)
    half = np.pi * float(np.sqrt(scales.mass / scales.stiffness))
    flights = [
        _flights(path) if campaign.stop else _half_periods(path, half, recording.name in rested)
        for path, recording in zip(paths, campaign.recordings, strict=True)
    ]
    told = [r for r, own in enumerate(flights) if len(own) > 1]
    first = {r: flights[r][0] for r in told}
    whole = _left(fit, effects, scales, {})
    rest = _left(fit, effects, scales, first)
    if whole is None or rest is None or rest.rows < LEAST_ROWS or whole.rows == rest.rows:
        return ()
    if _chance(whole, rest) > FALSE_ALARM:
        return ()
    later = _left(fit, effects, scales, {r: (0, flights[r][1][1]) for r in told})
    second = 1.0 if later is None else max(rest.beyond(later), 1.0)
    depth = {r: [float(np.abs(paths[r].y[a:b]).max()) for a, b in flights[r]] for r in told}
    least = {r: _least_drop(depth[r], second) for r in told}
    shared = whole.beyond(rest) > max(least.values())
    power, shown = dict[int, float](), list[int]()
    for r in told:
        others = {q: span for q, span in first.items() if q != r}
        own = _left(fit, effects, scales, others, rest.laws if shared else None)
        power[r], chance = (0.0, 1.0) if own is None else (own.beyond(rest), _chance(own, rest))
        if chance < ALPHA if shared else power[r] > least[r] and chance * len(told) < FALSE_ALARM:
            shown.append(r)
    until, found = "the stop" if campaign.stop else "the other side", list[Fault]()
    alike = [r for r, own in enumerate(flights) if own] if 2 * len(shown) > len(told) else shown
    for r in alike:
        reached = power.get(r, 0.0), least.get(r, 0.0)
        words = f"held on release: the first {{seconds}}, up to {until}, are not free"
        if r not in shown:
            words = f"released as the others: the first {{seconds}}, up to {until}, left out"
        strength, threshold = (one / second for one in reached)
        end = flights[r][0][1]
        found.append(start_fault(campaign.recordings[r], end, strength, threshold, words))
    return tuple(found)


def _flights(path: Path) -> list[Span]:
    """The flight that a motion begins in, to the last sample before the stop, and where both hold a
    stretch the next one that does, [first, end) each; none where it begins elsewhere.
    """
    inside = np.concatenate([[True], path.d > 0.0, [True]]).astype(np.int8)
    begins, ends = (np.flatnonzero(np.diff(inside) == step) for step in (-1, 1))
    spans = [(int(a), int(b)) for a, b in zip(begins, ends, strict=True)]
    long = [(a, b) for a, b in spans if b - a > path.rows.phi.size]
    if not spans or spans[0][0] > 0:
        return []
    return long[:2] if len(long) > 1 and long[0] == spans[0] else spans[:1]


def _half_periods(path: Path, half: float, rested: bool) -> list[Span]:
    """The first two half periods, of so many s each, of a motion that began with a rest."""
    count = round(half / float(path.t[1] - path.t[0]))
    is_told = rested and path.t.size > 4 * count and count > path.rows.phi.size // 2
    return [(0, count), (count, 2 * count)] if is_told else []


def _least_drop(depth: Sequence[float], second: float) -> float:
    """Mean square that first flights must leave: far more than a force that grows with the third
    power of the amplitude would, by what second flights leave.
    """
    ratio = max(depth[0] / max(depth[1], 1e-300), 1.0)
    return second * (STEEPER * ratio**POWER) ** 2


def _chance(whole: _Squares, rest: _Squares) -> float:
    """Of so much more left of the stretches that are only in the whole, by noise alone."""
    more = whole.rows - rest.rows
    return float(f_distribution.sf(whole.beyond(rest), more, rest.rows)) if more > 0 else 1.0


def _left(
    fit: Fit,
    effects: Sequence[Effect],
    scales: Scales,
    without: dict[int, Span],
    laws: Sequence[str] | None = None,
) -> _Squares | None:
    """What some laws, or the likeliest ones, leave of flights, but for spans of some recordings;
    None where nothing is told.
    """
    recordings = list(fit.density.oscillator.campaign.recordings)
    for r, span in without.items():
        recordings[r] = _set_aside(recordings[r], span)
    problem = LikelySets(fit.with_recordings(recordings), effects, scales, flight=True)
    if not problem.terms:
        return None
    if laws is None:
        sets = problem.best(MOST)
        laws = [e.id for e in sets[-1].effects] if sets else []
    left = float(np.exp(problem.solve(problem.shaped(laws))[1])) * problem.rows
    return _Squares(left, problem.rows, laws)


def _set_aside(recording: Recording, span: Span) -> Recording:
    used = np.ones(recording.samples.size, bool)
    if recording.used is not None:
        used &= recording.used
    used[span[0] : span[1]] = False
    return replace(recording, used=used)
