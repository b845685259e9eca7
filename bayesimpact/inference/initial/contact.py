"""Gap, stiffness and damping of the stop from the observed cycles of one rig.

Each cycle gives three numbers: its length, the ratio of the depths at its two ends and the height
it reached. A stop shortens the cycle, eats energy and cuts the height; cycles that stay below the
gap do none of this, which is the knee of the backbone. A coarse grid over gap, stiffness and
damping finds the neighbourhood, least squares on the closed-form cycle the minimum.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.inference.initial.cycles import cycle
from bayesimpact.response.squares import Minimum, least

Floats = NDArray[np.float64]

STIFFNESS_RATIOS = np.geomspace(0.02, 5000.0, 20)
DAMPING_RATIOS = np.array([0.005, 0.05, 0.4])
GAP_STEPS = 16
CYCLES_IN_GRID = 9


@dataclass(frozen=True, eq=False)
class Cycles:
    """Observed cycles from lower turning point to lower turning point, (n,) each, SI.

    `depth`, `after`: depth below rest at the start and end; `length`: time between; `height`:
    highest displacement between; `sd_length`, `sd_ratio`, `sd_height`: standard deviations of the
    length, of ln(after / depth) and of the height; `slope`: change of the rest reading per relative
    change of the free frequency; `case`: index of the obstacle.
    """

    depth: Floats
    after: Floats
    length: Floats
    height: Floats
    sd_length: Floats
    sd_ratio: Floats
    sd_height: Floats
    slope: Floats
    case: NDArray[np.intp]

    @staticmethod
    def from_table(table: Floats) -> Cycles:
        """From an (n, 9) table, columns in the order of the fields."""
        depth, after, length, height, sd_length, sd_ratio, sd_height, slope, case = table.T
        whole = case.astype(np.intp)
        return Cycles(depth, after, length, height, sd_length, sd_ratio, sd_height, slope, whole)

    def take(self, rows: NDArray[np.intp]) -> Cycles:
        """The cycles with these indices."""
        fields = {name: getattr(self, name)[rows] for name in self.__dataclass_fields__}
        return replace(self, **fields)

    def moved(self, relative: float) -> Cycles:
        """Depths and heights about the rest readings that belong to another free frequency."""
        by = self.slope * relative
        floor = 0.05 * self.depth
        return replace(
            self,
            depth=np.maximum(self.depth + by, floor),
            after=np.maximum(self.after + by, floor),
            height=self.height - by,
        )

    @staticmethod
    def joined(parts: Sequence[Cycles]) -> Cycles:
        """The cycles of several sets, one after the other."""
        names = Cycles.__dataclass_fields__
        return Cycles(*(np.concatenate([getattr(p, name) for p in parts]) for name in names))


@dataclass(frozen=True, eq=False)
class Contact:
    """What the cycles say of the stop, with standard errors; (cases,) arrays for `k2`.

    `had_contact` (cases,): whether any cycle of the case touches. Without, k2 is not known.
    """

    g: float
    c2: float
    k2: Floats
    c1: float
    k1: float
    sd_g: float
    sd_c2: float
    sd_k2: Floats
    sd_c1: float
    sd_k1: float
    had_contact: NDArray[np.bool_]


@dataclass(frozen=True)
class Free:
    """The free oscillator as known from the flights: kg, N s/m, N/m and standard errors."""

    mass: float
    c1: float
    k1: float
    sd_c1: float
    sd_k1: float


def fit_contact(
    cycles: Cycles, free: Free, cases: int, start: Contact | None = None
) -> Contact | None:
    """Estimate the stop.

    Parameters
    ----------
    cycles : of all recordings
    free : the free oscillator; it is refined within its standard errors, because where no cycle is
        free the cycles tell c1 and c2 apart better than the flights do
    cases : number of obstacles
    start : an earlier estimate to start from; None looks on a grid

    Returns
    -------
    The estimates, or None when the cycles look no different with a stop than without.
    """
    scale = float(cycles.depth.max())
    starts = _grid(cycles, free, cases, scale) if start is None else [_point(start, scale)]

    def descend(points: list[Floats], evaluations: int) -> Minimum:
        return least(
            lambda x: _residuals(x, cycles, free, scale),
            points,
            scale=np.concatenate([[0.05, 0.3, 1.0, 1.0], np.full(cases, 0.2)]),
            bounds=_bounds(cases, scale, cycles, free),
            robust=3.0,
            evaluations=evaluations,
            tolerance=1e-5,
        )

    # A few steps tell which start leads to the lowest minimum.
    best = descend([descend(starts, 8).x], 60)
    # Three unknowns more than without a stop, at least; 5 for each is far beyond chance.
    if capped(best.residuals) > _free_misfit(cycles, free) - 5.0 * (2 + cases):
        return None
    return _contact(best, cycles, free, cases, scale)


def _unpack(x: Floats, free: Free, scale: float) -> tuple[float, float, Floats, float, float]:
    """g, c2, k2, c1, k1 of a point of the search."""
    c1 = free.c1 + free.sd_c1 * x[2]
    k1 = free.k1 * float(np.exp(x[3] * free.sd_k1 / free.k1))
    k2 = k1 * np.exp(x[4:])
    return float(scale * x[0]), float(np.exp(x[1])), k2, max(float(c1), 0.0), k1


def _residuals(x: Floats, cycles: Cycles, free: Free, scale: float) -> Floats:
    g, c2, k2, c1, k1 = _unpack(x, free, scale)
    cycles = cycles.moved(0.5 * float(np.log(k1 / free.k1)))
    end = cycle(cycles.depth, free.mass, c1, k1, c2, g, k2[cycles.case])
    rows = misfits(cycles, end.length, end.depth, end.height)
    return np.concatenate([rows.ravel(), x[2:4]])


def misfits(cycles: Cycles, length: Floats, depth: Floats, height: Floats) -> Floats:
    """(3, ...) standardised misfits; a cycle that the stop never lets go counts as far off."""
    ratio = np.log(np.maximum(depth, 1e-300) / cycles.depth)
    rows = np.stack(
        [
            (cycles.length - length) / cycles.sd_length,
            (np.log(cycles.after / cycles.depth) - ratio) / cycles.sd_ratio,
            (cycles.height - height) / cycles.sd_height,
        ]
    )
    return np.clip(np.nan_to_num(rows, nan=1e4, posinf=1e4, neginf=-1e4), -1e4, 1e4)


def capped(rows: Floats) -> float:
    """Sum of squares in which no single misfit counts more than a hundred."""
    return float(np.sum(np.minimum(rows**2, 100.0)))


def typical_variance(rows: Floats) -> float:
    """Variance of misfits from their median square (0.455 for unit variance); 1 at least."""
    return max(1.0, float(np.median(rows**2)) / 0.455)


def _free_misfit(cycles: Cycles, free: Free) -> float:
    """Misfit without a stop, with the free oscillator refined in the same way."""

    def residuals(x: Floats) -> Floats:
        # A gap beyond reach leaves c1 and k1, the third and fourth coordinate.
        return _residuals(np.array([np.inf, 0.0, x[0], x[1], 0.0]), everywhere, free, 1.0)

    everywhere = replace(cycles, case=np.zeros(cycles.case.size, dtype=np.intp))
    # By the median loss of depth per cycle, should the flights tell little of c1.
    losses = np.log(cycles.depth / cycles.after) / np.pi * np.sqrt(free.k1 * free.mass)
    start = (float(np.median(losses)) - free.c1) / free.sd_c1
    bounds = ([-6.0, -6.0], [6.0, 6.0])
    starts = [[0.0, 0.0], [start, 0.0]]
    return capped(least(residuals, starts, scale=1.0, bounds=bounds, robust=3.0).residuals)


def _grid(cycles: Cycles, free: Free, cases: int, scale: float) -> list[Floats]:
    """The best starting points of a coarse grid, at up to three gaps."""
    # Below zero as well: a gap of nothing must not sit at the edge of the grid.
    highest = max(float(cycles.height.max()), 0.02 * scale)
    gaps = np.concatenate(
        [scale * np.array([-0.3, -0.1, -0.03]), np.linspace(0.0, highest, GAP_STEPS)[:-1]]
    )
    cost = np.zeros(gaps.size)
    choice = np.zeros((gaps.size, cases, 2))
    for case in range(cases):
        mine = np.flatnonzero(cycles.case == case)
        if mine.size == 0:
            choice[:, case] = [0.0, np.nan]
            continue
        rows = mine[np.unique(np.linspace(0, mine.size - 1, CYCLES_IN_GRID).astype(int))]
        some = cycles.take(rows)
        shape = (gaps.size, STIFFNESS_RATIOS.size, DAMPING_RATIOS.size, rows.size)
        g = gaps[:, None, None, None]
        k2 = free.k1 * STIFFNESS_RATIOS[None, :, None, None]
        c2 = 2 * DAMPING_RATIOS[:, None] * np.sqrt((free.k1 + k2) * free.mass)
        args = (np.broadcast_to(a, shape).ravel() for a in (some.depth, c2, g, k2))
        depth, c2_flat, g_flat, k2_flat = args
        end = cycle(depth, free.mass, free.c1, free.k1, c2_flat, g_flat, k2_flat)
        rows3 = misfits(
            some, end.length.reshape(shape), end.depth.reshape(shape), end.height.reshape(shape)
        )
        misfit = np.sum(np.log1p((rows3 / 10) ** 2), axis=(0, 4)) * mine.size / rows.size
        flat = misfit.reshape(gaps.size, -1)
        at = np.argmin(flat, axis=1)
        cost += flat[np.arange(gaps.size), at]
        k, z = np.unravel_index(at, misfit.shape[1:])
        ratio = STIFFNESS_RATIOS[k]
        choice[:, case, 0] = np.log(ratio)
        choice[:, case, 1] = np.log(
            2 * DAMPING_RATIOS[z] * np.sqrt((1 + ratio) * free.k1 * free.mass)
        )
    starts = []
    for row in np.argsort(cost)[:3]:
        damping = float(np.nanmedian(choice[row, :, 1]))
        starts.append(np.concatenate([[gaps[row] / scale, damping, 0.0, 0.0], choice[row, :, 0]]))
    return starts


def _point(contact: Contact, scale: float) -> Floats:
    """The point of the search that an estimate stands for."""
    k2 = np.log(contact.k2 / contact.k1)
    return np.concatenate([[contact.g / scale, np.log(contact.c2), 0.0, 0.0], k2])


def _bounds(cases: int, scale: float, cycles: Cycles, free: Free) -> tuple[Floats, Floats]:
    top = max(1.2 * float(cycles.height.max()) / scale, 0.05)
    critical = float(np.log(2 * np.sqrt(free.k1 * free.mass)))
    low = np.concatenate([[-0.98, critical - 7.0, -6.0, -6.0], np.full(cases, np.log(1e-3))])
    high = np.concatenate([[top, critical + 9.0, 6.0, 6.0], np.full(cases, np.log(1e5))])
    return low, high


def _contact(best: Minimum, cycles: Cycles, free: Free, cases: int, scale: float) -> Contact:
    g, c2, k2, c1, k1 = _unpack(best.x, free, scale)
    end = cycle(cycles.depth, free.mass, c1, k1, c2, g, k2[cycles.case])
    had_contact = np.array([bool(end.impact[cycles.case == case].any()) for case in range(cases)])
    sd = best.standard_errors(typical_variance(best.residuals), 1e-4)
    return Contact(
        g=g,
        c2=c2,
        k2=k2,
        c1=c1,
        k1=k1,
        sd_g=scale * float(sd[0]),
        sd_c2=c2 * float(np.expm1(min(sd[1], 20.0))),
        sd_k2=np.where(had_contact, k2 * np.expm1(np.minimum(sd[4:], 20.0)), np.inf),
        sd_c1=free.sd_c1 * float(sd[2]),
        sd_k1=free.sd_k1 * float(sd[3]),
        had_contact=had_contact,
    )
