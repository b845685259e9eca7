"""The rest position of a decaying signal that may hit a stop on its upper side."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesimpact.response import local
from bayesimpact.response.flight import lower_arcs, solve_flight
from bayesimpact.response.half_cycles import turning_points

Floats = NDArray[np.float64]


def rest_position(samples: Floats, period: float, noise: float) -> float:
    """Reading at which the motion comes to rest.

    A free decay turns at r + a, r - a q, r + a q^2, ...: three successive extremes give its centre
    r exactly (Shanks' transformation). While the mass hits the stop the centre wanders with the
    amplitude; it stays once the cycles no longer reach it. So the centres of the last cycles count,
    as far back as they agree and the motion between them is a decaying sine. A recording that ends
    before the impacts do has no such cycles: there the lower half cycles, free flights all of them,
    give r as the reading where their curvature would vanish.

    Parameters
    ----------
    samples : (n,) signal
    period : rough period, samples
    noise : standard deviation of the noise
    """
    centres, spans, where = cycle_centres(samples, period, noise)
    if centres.size < 2:
        return float(np.median(samples))
    count, value = _plateau(centres, spans, 0.6 * noise * np.sqrt(6 / max(period, 6)))
    if count >= 2:
        own = 2 * float(np.median(np.diff(where[-count:])))
        tail = samples[max(0, int(where[-count] - 0.5 * own)) :]
        if _is_sine(tail, own, noise, value):
            return value
    arcs = lower_arcs(samples, None, period, noise)
    if arcs:
        flight = solve_flight([samples], [arcs], [1.0], 2 * np.pi / period)
        if flight is not None:
            return float(flight.offsets[0])
    return value if count else float(np.median(samples))


def cycle_centres(samples: Floats, period: float, noise: float) -> tuple[Floats, Floats, Floats]:
    """Centre and amplitude of the motion about every inner turning point.

    Returns
    -------
    (k,) centres, (k,) half distances between neighbouring extremes, (k,) positions in samples.
    """
    index, sign = turning_points(samples, period, noise)
    if index.size < 3:
        return np.empty(0), np.empty(0), np.empty(0)
    middle = (index[:-1] + index[1:]) // 2
    first = np.concatenate([[max(0, 2 * index[0] - middle[0])], middle + 1]).astype(np.intp)
    last = np.concatenate([middle, [min(samples.size - 1, 2 * index[-1] - middle[-1])]])
    _, value = local.extremes(samples, first, last.astype(np.intp), sign, noise)
    before, here, after = value[:-2], value[1:-1], value[2:]
    bend = before + after - 2 * here
    spans = np.abs(bend) / 4
    sound = spans > 3 * noise
    centres = (before * after - here**2)[sound] / bend[sound]
    return centres, spans[sound], index[1:-1][sound].astype(np.float64)


def _plateau(centres: Floats, spans: Floats, sd: float) -> tuple[int, float]:
    """How many of the last centres agree within their standard deviation `sd`, and their mean."""
    last = min(4, centres.size)
    value = float(np.median(centres[-last:]))
    tolerance = 5 * sd + 0.001 * spans
    off = np.flatnonzero(np.abs(centres - value) > tolerance)
    count = centres.size - (int(off[-1]) + 1 if off.size else 0)
    if count == 0:
        return 0, value
    return count, float(centres[-count:].mean())


def _is_sine(samples: Floats, period: float, noise: float, centre: float) -> bool:
    """Whether the signal is a decaying sine about `centre`, to the noise or 1 % of its size."""
    keep = samples[-min(samples.size, int(6 * period)) :]
    if keep.size < period:
        return False
    flight = solve_flight(
        [keep], [[(0, keep.size)]], [1.0], 2 * np.pi / period, fixed=[centre], scan=1.05
    )
    if flight is None:
        return False
    size = float(np.std(keep - centre))
    return flight.rms < max(1.5 * noise, 0.01 * size)
