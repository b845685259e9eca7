"""Initial estimates for a preloaded stop (g < 0): the mass rests against it.

Mirrored at rest such a rig is an ordinary one: what was "on the stop" is its free motion, with
stiffness k1 + k2 and damping c1 + c2, and cycles that leave the stop meet something softer, by k2
and c2, at the distance h = -g k1 / (k1 + k2) from rest. So flights and cycles of the mirrored
recordings are read like any other; only the rest reading and the meaning of the numbers differ.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import Campaign
from bayesimpact.inference.initial.contact import Contact, Cycles, capped, misfits, typical_variance
from bayesimpact.inference.initial.cycles import cycle
from bayesimpact.inference.initial.observe import (
    Observed,
    observe_cycles,
    observe_flights,
    with_arcs,
)
from bayesimpact.response.half_cycles import half_cycles
from bayesimpact.response.squares import least

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]


def is_preloaded(observed: Observed) -> bool:
    """Whether the cycles away from the stop, and only those, get shorter with the decay."""
    upper: list[float] = []
    lower: list[float] = []
    for r, samples in enumerate(observed.samples):
        halves = half_cycles(samples, observed.rests[r], observed.periods[r], observed.noises[r])
        for side, ratios in ((1, upper), (-1, lower)):
            length = halves.durations[halves.side == side]
            if length.size >= 5:
                ratios.append(float(np.log(length[:2].mean() / np.median(length[-3:]))))
    if not upper or not lower:
        return False
    grows, other = float(np.median(lower)), abs(float(np.median(upper)))
    return grows > 0.02 and grows > other


@dataclass(frozen=True, eq=False)
class Preloaded:
    """The stop, the readings of y = 0 with their standard error, impacts per recording."""

    contact: Contact
    offsets: Floats
    sd_offset: float
    impacts: list[int]


@dataclass(frozen=True, eq=False)
class _Mirror:
    """Stiffness k1 + k2 per case, damping c1 + c2, and the cycles of the mirrored recordings."""

    mass: float
    stiffness: Floats
    damping: float
    sd_damping: float
    cycles: Cycles


def estimate_preloaded(campaign: Campaign, observed: Observed) -> Preloaded | None:
    """Estimate a preloaded rig; None when no cycle leaves the stop or the fit fails.

    Parameters
    ----------
    campaign, observed : the recordings
    """
    mirrored = with_arcs(
        replace(
            observed,
            samples=[-x for x in observed.samples],
            rests=[-rest for rest in observed.rests],
        )
    )
    stiffness, damping, damping_sd = [], [], []
    rests = np.array(mirrored.rests)
    parts: list[tuple[Cycles, Ints]] = []
    for index, case in enumerate(campaign.cases):
        rows = [r for r, recording in enumerate(campaign.recordings) if recording.case == case]
        some, flight = observe_flights(mirrored.take(rows))
        if flight is None:
            return None
        cycles, places = observe_cycles([index] * len(rows), some, flight)
        parts.append((cycles, np.array(rows)[places[:, 0]]))
        stiffness.append(campaign.mass * (flight.omega**2 + flight.decay**2))
        damping.append(2 * campaign.mass * flight.decay)
        damping_sd.append(2 * campaign.mass * flight.sd_decay)
        rests[rows] = flight.offsets
    cycles = Cycles.joined([part for part, _ in parts])
    owner = np.concatenate([who for _, who in parts])
    if cycles.depth.size == 0:
        return None
    weight = 1 / np.array(damping_sd) ** 2
    mirror = _Mirror(
        campaign.mass,
        np.array(stiffness),
        max(float(np.average(damping, weights=weight)), 0.0),
        float(1 / np.sqrt(weight.sum())) + 0.05 * abs(float(np.mean(damping))),
        cycles,
    )
    found = _fit(mirror)
    return None if found is None else _result(campaign, mirror, found, -rests, owner)


def _model(x: Floats, mirror: _Mirror) -> tuple[float, float, float, Floats]:
    """h over the largest depth is x[0]; k1 over the softest k1 + k2 x[1]; c2 over c1 + c2 x[2]."""
    k1 = float(mirror.stiffness.min() * x[1])
    total = mirror.damping + mirror.sd_damping * x[3]
    gap = float(mirror.cycles.depth.max() * x[0])
    return gap, k1, float(total * x[2]), np.array(total)


def _height_of(x: Floats, mirror: _Mirror) -> tuple[Floats, Floats, Floats, Floats]:
    """Per case: gap of the mirrored rig, its softening, its loss of damping, its damping.

    The preload g is common to the cases; h = -g k1 / (k1 + k2) is not.
    """
    gap, k1, c2, total = _model(x, mirror)
    h = gap * mirror.stiffness.min() / mirror.stiffness
    return h, k1 - mirror.stiffness, np.full(h.size, -c2), np.full(h.size, total)


def _residuals(x: Floats, mirror: _Mirror) -> Floats:
    cycles, case = mirror.cycles, mirror.cycles.case
    h, soft, less, total = (a[case] for a in _height_of(x, mirror))
    end = cycle(cycles.depth, mirror.mass, total, mirror.stiffness[case], less, h, soft)
    rows = misfits(cycles, end.length, end.depth, end.height)
    return np.concatenate([rows.ravel(), [x[3] / 2]])


def _fit(mirror: _Mirror) -> tuple[Floats, Floats] | None:
    """Best point and the standard errors of its coordinates."""
    grid = [
        np.array([h, ratio, share, 0.0])
        for h in (0.02, 0.06, 0.12, 0.2, 0.3, 0.45, 0.6, 0.8)
        for ratio in (0.01, 0.03, 0.08, 0.15, 0.3, 0.5, 0.7, 0.9)
        for share in (0.1, 0.5, 0.9)
    ]
    cost = [float(np.sum(np.log1p((_residuals(x, mirror) / 10) ** 2))) for x in grid]
    best = least(
        lambda x: _residuals(x, mirror),
        [grid[row] for row in np.argsort(cost)[:3]],
        scale=[0.1, 0.1, 0.3, 1.0],
        bounds=([1e-4, 1e-4, 0.0, -6.0], [1.2, 0.9999, 1.0, 6.0]),
        robust=3.0,
        evaluations=60,
    )
    linear = _residuals(np.array([1.2, 0.5, 0.5, 0.0]), mirror)
    if capped(best.residuals) > capped(linear) - 15.0:
        return None
    return best.x, best.standard_errors(typical_variance(best.residuals), 1e-4)


def _result(
    campaign: Campaign, mirror: _Mirror, found: tuple[Floats, Floats], rests: Floats, owner: Ints
) -> Preloaded:
    x, sd = found
    gap, k1, c2, total = _model(x, mirror)
    k2 = mirror.stiffness - k1
    g = -gap * float(mirror.stiffness.min()) / k1
    softest = float(mirror.stiffness.min())
    sd_k1, sd_c2 = softest * float(sd[1]), float(total) * float(sd[2])
    sd_g = abs(g) * float(np.hypot(sd[0] / x[0], sd[1] / x[1]))
    contact = Contact(
        g=g,
        c2=c2,
        k2=k2,
        c1=float(total) - c2,
        k1=k1,
        sd_g=sd_g,
        sd_c2=sd_c2,
        sd_k2=np.full(k2.size, sd_k1),
        sd_c1=float(np.hypot(sd_c2, mirror.sd_damping * sd[3])),
        sd_k1=sd_k1,
        had_contact=np.ones(k2.size, dtype=bool),
    )
    case = np.array([campaign.cases.index(r.case) for r in campaign.recordings])
    offsets = rests - (k2 * g / (k1 + k2))[case]
    impacts = np.bincount(owner, minlength=len(campaign.recordings))
    return Preloaded(contact, offsets, sd_g, [int(count) for count in impacts])
