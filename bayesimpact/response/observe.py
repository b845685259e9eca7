"""What the recordings of a campaign show directly: flights, cycles between them, free tails."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import Campaign
from bayesimpact.response import local
from bayesimpact.response.contact import Contact, Cycles
from bayesimpact.response.cycles import cycle
from bayesimpact.response.flight import Arc, Flight, lower_arcs, solve_flight, waves_of
from bayesimpact.response.rest import rest_position
from bayesimpact.response.swings import half_swings, rough_period

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Observed:
    """Recordings and what a first look tells of them; one entry per recording.

    Attributes
    ----------
    samples : (n,) each, m
    intervals : s
    periods : rough period, samples
    noises : standard deviation of the noise, m
    rests : rest reading, m
    arcs : flights on the free side, [first, end)
    """

    samples: Sequence[Floats]
    intervals: Sequence[float]
    periods: Sequence[float]
    noises: Sequence[float]
    rests: Sequence[float]
    arcs: Sequence[Sequence[Arc]]

    def size(self, r: int) -> float:
        """Largest distance of a recording from its rest reading."""
        return float(np.abs(self.samples[r] - self.rests[r]).max())

    @property
    def omega(self) -> float:
        """Rough angular frequency of all recordings, rad/s."""
        pairs = zip(self.periods, self.intervals, strict=True)
        return 2 * np.pi / float(np.median([p * dt for p, dt in pairs]))


def look(campaign: Campaign) -> Observed:
    """Period, noise, rest reading and flights of every recording."""
    samples = [r.samples for r in campaign.recordings]
    intervals = [r.interval for r in campaign.recordings]
    periods = [rough_period(x) for x in samples]
    noises = [local.noise_level(x, p) for x, p in zip(samples, periods, strict=True)]
    rests = [rest_position(*args) for args in zip(samples, periods, noises, strict=True)]
    first = Observed(samples, intervals, periods, noises, rests, [[] for _ in samples])
    if not campaign.stop:
        return replace(first, arcs=[[(0, x.size)] for x in samples])
    return replace(first, arcs=_flight_arcs(first))


def _flight_arcs(observed: Observed) -> list[list[Arc]]:
    """Arcs below rest; of a preloaded stop only as far down as the flight is seen to be free."""
    count = len(observed.samples)
    arcs = [
        lower_arcs(observed.samples[r], observed.rests[r], observed.periods[r], observed.noises[r])
        for r in range(count)
    ]
    if not any(_preloaded(observed, r) for r in range(count)):
        return arcs
    # The stop reaches below rest by an unknown depth. Deeper arcs are free for sure but short, so
    # take the shallowest at which the fit is as good as at any.
    deepest = min(observed.size(r) for r in range(count))
    trials = []
    for depth in np.linspace(0.05, 0.7, 8) * deepest:
        cut = [
            _below(arcs[r], observed.samples[r], observed.rests[r] - depth, observed.periods[r])
            for r in range(count)
        ]
        flight = solve_flight(observed.samples, cut, observed.intervals, observed.omega)
        if flight is not None:
            trials.append((flight.rms, cut))
    if not trials:
        return arcs
    best = min(rms for rms, _ in trials)
    return next(cut for rms, cut in trials if rms <= 1.15 * best)


def _preloaded(observed: Observed, r: int) -> bool:
    """Whether lower half swings get shorter as the motion decays: the stop holds them at rest."""
    swings = half_swings(
        observed.samples[r], observed.rests[r], observed.periods[r], observed.noises[r]
    )
    lower = swings.durations[swings.side < 0]
    return bool(lower.size >= 6 and lower[:2].mean() > 1.08 * np.median(lower[-3:]))


def _below(arcs: Sequence[Arc], samples: Floats, level: float, period: float) -> list[Arc]:
    """The parts of arcs below an absolute level."""
    kept: list[Arc] = []
    for first, end in arcs:
        deep = np.flatnonzero(samples[first:end] < level)
        if deep.size >= max(6, period / 12):
            kept.append((first + int(deep[0]), first + int(deep[-1]) + 1))
    return kept


def observe_flights(observed: Observed, stop: bool) -> Flight | None:
    """The free oscillator from the flights of all recordings; without a stop from all samples."""
    if stop:
        return solve_flight(observed.samples, observed.arcs, observed.intervals, observed.omega)
    rates, weights = [], []
    for r, samples in enumerate(observed.samples):
        swings = half_swings(samples, observed.rests[r], observed.periods[r], observed.noises[r])
        if swings.side.size < 3:
            continue
        # Least squares over the whole recording sees the large swings most.
        weight = float(np.sum(swings.amplitudes**2))
        period = 2 * float(np.average(swings.durations, weights=swings.amplitudes**2))
        rates.append(2 * np.pi / (period * observed.intervals[r]))
        weights.append(weight)
    if not rates:
        return None
    omega = float(np.average(rates, weights=weights))
    return solve_flight(
        observed.samples, observed.arcs, observed.intervals, omega, scan=1.05
    )


def observe_cycles(campaign: Campaign, observed: Observed, flight: Flight) -> tuple[Cycles, Ints]:
    """Cycles between neighbouring flights of all recordings, and the recording of each."""
    rows: list[list[float]] = []
    owner: list[int] = []
    for r, recording in enumerate(campaign.recordings):
        times, depths = flight.minima(r)
        arcs = observed.arcs[r]
        noise = max(observed.noises[r], flight.rms)
        for j in range(len(arcs) - 1):
            between = arcs[j][1], arcs[j + 1][0] - 1
            length = float(times[j + 1] - times[j])
            shallow = min(depths[j], depths[j + 1]) < 4 * noise
            if shallow or between[1] - between[0] < 2 or not 0 < length < 6 * np.pi / flight.omega:
                continue
            height = _height(observed, r, between) - float(flight.offsets[r])
            spread = [
                noise * np.sqrt(2 / (b - a)) / d
                for (a, b), d in zip(arcs[j : j + 2], depths[j : j + 2], strict=True)
            ]
            error = float(np.hypot(*spread))
            coarse = 2.0 / (between[1] - between[0]) ** 2
            rows.append(
                [
                    depths[j],
                    depths[j + 1],
                    length,
                    height,
                    float(np.hypot(error / flight.omega, 3e-4 * length)),
                    float(np.hypot(error, 2e-3)),
                    float(np.hypot(noise, (3e-3 + coarse) * depths[j])),
                    campaign.cases.index(recording.case),
                ]
            )
            owner.append(r)
    table = np.array(rows).reshape(-1, 8)
    columns = [table[:, k] for k in range(7)]
    return Cycles(*columns, table[:, 7].astype(np.intp)), np.array(owner, dtype=np.intp)


def _height(observed: Observed, r: int, between: Arc) -> float:
    """Highest reading between two flights."""
    first, last = np.array([between[0]]), np.array([between[1]])
    _, value = local.extremes(observed.samples[r], first, last, np.array([1]), observed.noises[r])
    return float(value[0])


def with_tails(
    observed: Observed,
    flight: Flight,
    cycles: Cycles,
    owner: Ints,
    contact: Contact | None,
    mass: float,
) -> tuple[Flight, list[int]]:
    """Fit the flights again with every free tail as one long flight; and count the impacts.

    Returns
    -------
    The better flight fit, still with one wave per arc, and the number of cycles with an impact per
    recording.
    """
    count = len(observed.samples)
    impact = np.zeros(owner.size, dtype=bool)
    if contact is not None and owner.size:
        stop = (np.array(contact.c2), np.array(contact.g), contact.k2[cycles.case])
        impact = cycle(1.01 * cycles.depth, mass, contact.c1, contact.k1, *stop).impact
    impacts = [int(np.sum(impact & (owner == r))) for r in range(count)]
    if contact is not None and contact.g < 0:
        return flight, impacts
    joined: list[list[Arc]] = []
    for r in range(count):
        arcs, hits = list(observed.arcs[r]), np.flatnonzero(impact[owner == r])
        last = int(hits[-1]) + 1 if hits.size else 0
        if last < len(arcs) - 1:
            arcs = [*arcs[:last], (arcs[last][0], observed.samples[r].size)]
        joined.append(arcs)
    better = solve_flight(
        observed.samples, joined, observed.intervals, flight.omega, scan=1.0
    )
    if better is None or better.rms > 1.5 * max(flight.rms, max(observed.noises)):
        return flight, impacts
    return waves_of(better, observed.samples, observed.arcs, observed.intervals), impacts
