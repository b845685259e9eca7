"""The oscillator without a stop from velocities or accelerations as they were read.

A derivative of a decaying sine is a decaying sine of the same frequency and decay, about a bias of
the probe that needs no mean over whole cycles. So the readings tell what their integral does not
where the motion loses much of itself within a cycle: a velocity then changes over every whole
cycle, so that the mean of the acceleration is no bias, and the acceleration does not vanish where
the displacement does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.recording import Recording
from bayesimpact.inference.initial.observe import MOST_LEFT, Observed, unexplained
from bayesimpact.response.flight import Flight, solve_flight
from bayesimpact.response.half_cycles import spectral_period

Floats = NDArray[np.float64]

SCAN = 1.25  # a period is good to some ten per cent


def decay_of_readings(
    recordings: Sequence[Recording], observed: Observed, flight: Flight | None
) -> tuple[Observed, Flight | None]:
    """Displacements and their fit, by one decaying sine through the readings where that explains
    more of these than `flight` of the displacements, None for none, and most of them.

    Returns
    -------
    As given; or `observed` with the displacements behind the sine in closed form, about zero.
    """
    if all(r.order == 0 for r in recordings):
        return observed, flight
    periods = [spectral_period(r.samples, r.order) * r.interval for r in recordings]
    omega = 2 * np.pi / float(np.median(periods))
    sizes = [omega**r.order for r in recordings]  # so recordings of every quantity count alike
    scaled = [r.samples / size for r, size in zip(recordings, sizes, strict=True)]
    whole = [[(0, x.size)] for x in scaled]
    found = solve_flight(scaled, whole, observed.intervals, omega, scan=SCAN)
    most = MOST_LEFT if flight is None else min(MOST_LEFT, unexplained(flight, observed.samples))
    if found is None or unexplained(found, scaled) > most:
        return observed, flight
    waves = tuple(
        _integrated(wave, found, r.order, size)
        for wave, r, size in zip(found.waves, recordings, sizes, strict=True)
    )
    rests = np.where([r.order == 0 for r in recordings], found.offsets, 0.0)
    motions = [
        rest + _motion(wave, found, r)
        for rest, wave, r in zip(rests, waves, recordings, strict=True)
    ]
    moved = replace(
        observed,
        samples=motions,
        rests=list(rests),
        noises=[n / size for n, size in zip(observed.reading_noises, sizes, strict=True)],
        biases=[
            None if r.order == 0 else size * float(at)
            for r, size, at in zip(recordings, sizes, found.offsets, strict=True)
        ],
    )
    return moved, replace(found, offsets=rests, waves=waves)


def _integrated(wave: Floats, flight: Flight, order: int, size: float) -> Floats:
    """(1, 3) middle, p and q of the displacement whose `order`-th derivative over `size` has
    those of `wave`.
    """
    middle, p, q = wave[0]
    found = size * complex(p, -q) / complex(-flight.decay, flight.omega) ** order
    return np.array([[middle, found.real, -found.imag]])


def _motion(wave: Floats, flight: Flight, recording: Recording) -> Floats:
    """(n,) the wave at the recording's samples."""
    middle, p, q = wave[0]
    t = np.arange(recording.samples.size) * recording.interval - middle
    w = flight.omega
    return np.asarray(np.exp(-flight.decay * t) * (p * np.cos(w * t) + q * np.sin(w * t)))
