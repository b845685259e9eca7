"""What the recordings of a campaign show directly: flights, cycles between them, free tails."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import Campaign
from bayesimpact.inference.initial.contact import Contact, Cycles
from bayesimpact.inference.initial.cycles import cycle
from bayesimpact.inference.initial.lines import has_line
from bayesimpact.response import local
from bayesimpact.response.displacement import displacement_of
from bayesimpact.response.flight import Arc, Flight, lower_arcs, solve_flight, waves_of
from bayesimpact.response.half_cycles import half_cycles, spectral_period
from bayesimpact.response.rest import rest_position

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

MOST_LEFT = 0.5  # of the variance, by the fit of an oscillation
DRIFT = 0.005  # of the motion: what an integrated reading is off, however smooth it looks


@dataclass(frozen=True, eq=False)
class Observed:
    """Recordings and what a first look tells of them; one entry per recording.

    Attributes
    ----------
    samples : (n,) each, displacements, m; of other quantities as `displacement_of` finds them
    intervals : s
    periods : rough period, samples
    noises : standard deviation of the noise of these, m
    rests : rest reading, m
    arcs : flights on the free side, [first, end)
    biases, reading_noises : offset of the probe (None: the displacement's rest reading is to be
        found), and standard deviation of the noise, in the unit of the recording
    lines : whether a line stands out of the spectrum of the readings
    """

    samples: Sequence[Floats]
    intervals: Sequence[float]
    periods: Sequence[float]
    noises: Sequence[float]
    rests: Sequence[float]
    arcs: Sequence[Sequence[Arc]]
    biases: Sequence[float | None]
    reading_noises: Sequence[float]
    lines: Sequence[bool]

    def size(self, r: int) -> float:
        """Largest distance of a recording from its rest reading."""
        return float(np.abs(self.samples[r] - self.rests[r]).max())

    @property
    def omega(self) -> float:
        """Rough angular frequency of all recordings, rad/s."""
        pairs = zip(self.periods, self.intervals, strict=True)
        return 2 * np.pi / float(np.median([p * dt for p, dt in pairs]))

    def take(self, rows: Sequence[int]) -> Observed:
        """Only the recordings with these indices."""
        parts = {name: [getattr(self, name)[r] for r in rows] for name in self.__dataclass_fields__}
        return replace(self, **parts)


def look(campaign: Campaign) -> Observed:
    """Period, noise, rest reading and flights of every recording."""
    found = [displacement_of(r) for r in campaign.recordings]
    samples = [one.samples for one in found]
    intervals = [r.interval for r in campaign.recordings]
    periods = [spectral_period(x) for x in samples]
    noises = [
        max(local.noise_level(x, p), DRIFT * float(np.ptp(x)) if r.order > 0 else 0.0)
        for x, p, r in zip(samples, periods, campaign.recordings, strict=True)
    ]
    rests = [rest_position(*args) for args in zip(samples, periods, noises, strict=True)]
    if not campaign.stop:  # the motion passes its rest: an extrapolation may lie elsewhere
        rests = [
            rest if x.min() < rest < x.max() else float(np.median(x))
            for x, rest in zip(samples, rests, strict=True)
        ]
    whole: list[list[Arc]] = [[(0, x.size)] for x in samples]
    biases, reading_noises = [one.bias for one in found], [one.noise for one in found]
    lines = [has_line(r.samples) for r in campaign.recordings]
    first = Observed(
        samples, intervals, periods, noises, rests, whole, biases, reading_noises, lines
    )
    return with_arcs(first) if campaign.stop else first


def with_arcs(observed: Observed, depth: float = 0.1) -> Observed:
    """The same with the arcs below rest, by this fraction of their depth, as flights."""
    o = observed
    rows = zip(o.samples, o.rests, o.periods, o.noises, strict=True)
    return replace(o, arcs=[lower_arcs(*row, depth=depth) for row in rows])


def observe_flights(observed: Observed) -> tuple[Observed, Flight | None]:
    """The free oscillator from the flights of all recordings.

    Arcs that reach into the stop (of a preloaded rig that does not come to rest) do not fit. So
    deeper ones are tried, and taken when they fit much better.

    Returns
    -------
    The recordings with the arcs that were taken, and the fit; None when there is not enough to fit.
    """
    best, flight = observed, _fit(observed)
    for depth in (0.35, 0.6):
        if flight is not None and flight.rms < 1.5 * max(observed.noises):
            break
        deeper = with_arcs(observed, depth)
        other = _fit(deeper)
        if other is not None and (flight is None or other.rms < 0.5 * flight.rms):
            best, flight = deeper, other
    return best, flight


def _fit(observed: Observed) -> Flight | None:
    return solve_flight(observed.samples, observed.arcs, observed.intervals, observed.omega)


def observe_decay(observed: Observed) -> Flight | None:
    """The oscillator without a stop, from all samples; None without an oscillation.

    The frequency of the half cycles and that of the strongest line are tried. Where no half cycles
    stand out (slow decays cut short, a beat, many modes, much noise), that line must explain most
    of the readings, or every recording's spectrum must show one.
    """
    found = [] if (rate := _rate_of_half_cycles(observed)) is None else [_decay(observed, rate)]
    other = _decay(observed, observed.omega)
    if other is not None and (
        found or all(observed.lines) or unexplained(other, observed.samples) < MOST_LEFT
    ):
        found.append(other)
    return min((f for f in found if f is not None), key=lambda f: f.rms, default=None)


def _decay(observed: Observed, omega: float) -> Flight | None:
    return solve_flight(observed.samples, observed.arcs, observed.intervals, omega, scan=1.05)


def unexplained(flight: Flight, samples: Sequence[Floats]) -> float:
    """Share of the variance of `samples`, (n,) each, that a fit leaves."""
    square = sum(float(np.sum((x - np.mean(x)) ** 2)) for x in samples)
    return flight.rms**2 * sum(x.size for x in samples) / max(square, 1e-300)


def _rate_of_half_cycles(observed: Observed) -> float | None:
    """Angular frequency of the complete half cycles, rad/s; None where a recording shows none."""
    rates, weights = [], []
    for r, samples in enumerate(observed.samples):
        halves = half_cycles(samples, observed.rests[r], observed.periods[r], observed.noises[r])
        if halves.side.size < 3:
            continue
        # Least squares over the whole recording sees the large cycles most.
        weight = float(np.sum(halves.amplitudes**2))
        period = 2 * float(np.average(halves.durations, weights=halves.amplitudes**2))
        rates.append(2 * np.pi / (period * observed.intervals[r]))
        weights.append(weight)
    return float(np.average(rates, weights=weights)) if rates else None


def observe_cycles(cases: Sequence[int], observed: Observed, flight: Flight) -> tuple[Cycles, Ints]:
    """Cycles between neighbouring flights of all recordings.

    Parameters
    ----------
    cases : per recording, the index of its obstacle
    observed, flight : recordings and the fit of their flights

    Returns
    -------
    The cycles, and (n, 2) the recording of each and the number of the flight that it starts from.
    """
    tables, places = [np.empty((0, 9))], [np.empty((0, 2), dtype=np.intp)]
    for r, case in enumerate(cases):
        table, first = _cycles_of(observed, flight, r)
        tables.append(np.column_stack([table, np.full(first.size, float(case))]))
        places.append(np.column_stack([np.full(first.size, r), first]))
    return Cycles.from_table(np.concatenate(tables)), np.concatenate(places)


def _cycles_of(observed: Observed, flight: Flight, r: int) -> tuple[Floats, Ints]:
    """The first eight columns of `Cycles` for one recording, and the flights they start from."""
    times, depths = flight.minima(r)
    arcs = np.array(observed.arcs[r], dtype=np.intp).reshape(-1, 2)
    noise = max(observed.noises[r], flight.rms)
    length, between = np.diff(times), arcs[1:, 0] - 1 - arcs[:-1, 1]
    clear = np.minimum(depths[:-1], depths[1:]) >= 4 * noise
    k = np.flatnonzero(clear & (between >= 2) & (length > 0) & (length < 6 * np.pi / flight.omega))
    if k.size == 0:
        return np.empty((0, 8)), k
    _, high = local.extremes(
        observed.samples[r], arcs[k, 1], arcs[k + 1, 0] - 1, np.ones(k.size, int), noise
    )
    # Amplitude and phase of a sine from m samples of it: sd about sqrt(2 / m) of the noise.
    relative_sd = noise * np.sqrt(2 / (arcs[:, 1] - arcs[:, 0])) / depths
    error = np.hypot(relative_sd[k], relative_sd[k + 1])
    # The floors keep small misfits of the model from counting; a coarsely sampled top is uncertain.
    coarse = 3e-3 + 2.0 / between[k] ** 2
    columns = [
        depths[k],
        depths[k + 1],
        length[k],
        high - flight.offsets[r],
        np.hypot(error / flight.omega, 3e-4 * length[k]),
        np.hypot(error, 2e-3),
        np.hypot(noise, coarse * depths[k]),
        np.full(k.size, flight.offset_slope[r]),
    ]
    return np.column_stack(columns), k


def with_tails(
    observed: Observed,
    flight: Flight,
    cycles: Cycles,
    places: Ints,
    contact: Contact | None,
    mass: float,
) -> tuple[Flight, list[int]]:
    """Fit the flights again with every free tail as one long flight; and count the impacts.

    Parameters
    ----------
    observed, flight : recordings and the fit of their flights
    cycles, places : as from `observe_cycles`
    contact : the stop, None for none
    mass : kg

    Returns
    -------
    The better flight fit, still with one wave per arc, and the number of cycles with an impact per
    recording.
    """
    count = len(observed.samples)
    impact = np.zeros(len(places), dtype=bool)
    if contact is not None and len(places):
        stop = (contact.c2, contact.g, contact.k2[cycles.case])
        impact = cycle(1.01 * cycles.depth, mass, contact.c1, contact.k1, *stop).impact
    hits = [places[impact & (places[:, 0] == r), 1] for r in range(count)]
    impacts = [here.size for here in hits]
    joined: list[list[Arc]] = []
    for r in range(count):
        arcs = list(observed.arcs[r])
        last = int(hits[r][-1]) + 1 if hits[r].size else 0
        if last < len(arcs) - 1:
            arcs = [*arcs[:last], (arcs[last][0], observed.samples[r].size)]
        joined.append(arcs)
    better = solve_flight(observed.samples, joined, observed.intervals, flight.omega, scan=1.0)
    if better is None or better.rms > 1.5 * max(flight.rms, max(observed.noises)):
        return flight, impacts
    return waves_of(better, observed.samples, observed.arcs, observed.intervals), impacts
