"""Free flights: decaying sines with one frequency and one decay rate, fitted all at once.

Away from the stop the reading is offset + exp(-b t) (p cos wt + q sin wt). All flights share the
frequency w and the decay rate b, those of one recording its offset; p and q are their own. For
given w and b the rest is linear and solved in closed form (variable projection, Golub and Pereyra
1973), so that only two unknowns are searched, whatever the number of flights.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.response.half_cycles import turning_points
from bayesimpact.response.squares import least

Floats = NDArray[np.float64]
Arc = tuple[int, int]


@dataclass(frozen=True, eq=False)
class Flight:
    """The fitted flights.

    Attributes
    ----------
    omega : damped angular frequency, rad/s
    decay : decay rate b, 1/s
    offsets : (recordings,) rest reading
    rms : root mean square of the residuals
    sd_omega, sd_decay : standard errors for white residuals
    sd_offset : standard error of the offsets, all alike
    offset_slope : (recordings,) change of the offset per relative change of omega: short arcs tell
        depth below rest and frequency apart only together
    waves : per recording, (arcs, 3): time of the arc's middle since the first sample in s, p, q
    """

    omega: float
    decay: float
    offsets: Floats
    rms: float
    sd_omega: float
    sd_decay: float
    sd_offset: float
    offset_slope: Floats
    waves: tuple[Floats, ...]

    def minima(self, recording: int) -> tuple[Floats, Floats]:
        """Turning points on the lower side, one per arc: times in s and depths below rest."""
        middle, p, q = self.waves[recording].T
        w, b = self.omega, self.decay
        # velocity = exp(-bt) ((w q - b p) cos wt - (w p + b q) sin wt)
        phase = np.arctan2(w * q - b * p, w * p + b * q)
        value = np.exp(-b * phase / w) * (p * np.cos(phase) + q * np.sin(phase))
        phase = np.where(value > 0, phase - np.sign(phase) * np.pi, phase)
        value = np.exp(-b * phase / w) * (p * np.cos(phase) + q * np.sin(phase))
        return middle + phase / w, -value


def lower_arcs(
    samples: Floats, rest: float | None, period: float, noise: float, depth: float = 0.1
) -> list[Arc]:
    """Runs of samples on the free side, one around every lower turning point.

    Parameters
    ----------
    samples : (n,) signal
    rest : rest reading; None takes 0.8 of the way from each minimum to the middle between it and
        its neighbouring maxima, which is below rest for every one-sided stop
    period : rough period, samples
    noise : standard deviation of the noise
    depth : with `rest`: the arc is where the signal is deeper than this fraction of its minimum

    Returns
    -------
    [first, end) of each arc; partial ones at the ends of the recording included.
    """
    index, sign = turning_points(samples, period, noise)
    arcs: list[Arc] = []
    high = index[sign > 0]
    for at in _with_ends(samples, index, sign):
        if rest is None:
            beside = high[np.argsort(np.abs(high - at))[:2]]
            if beside.size == 0:
                continue
            level = samples[at] + 0.4 * (float(samples[beside].mean()) - samples[at])
        else:
            level = rest - depth * (rest - samples[at]) - 2 * noise
        if samples[at] > level - 4 * noise:
            continue
        first, end = _run_below(samples, at, level)
        if end - first >= max(6, period / 10) and (not arcs or first >= arcs[-1][1]):
            arcs.append((first, end))
    return arcs


def _with_ends(samples: Floats, index: NDArray[np.intp], sign: NDArray[np.int_]) -> list[int]:
    """Lower turning points, and the ends of the recording where it is on its way to or from one."""
    low = [int(i) for i in index[sign < 0]]
    if index.size and sign[0] > 0:
        low.insert(0, int(np.argmin(samples[: index[0] + 1])))
    if index.size and sign[-1] > 0:
        low.append(int(index[-1] + np.argmin(samples[index[-1] :])))
    return low


def _run_below(samples: Floats, at: int, level: float) -> Arc:
    """The samples around `at` that stay below `level`."""
    before = np.flatnonzero(samples[:at] > level)
    after = np.flatnonzero(samples[at:] > level)
    first = int(before[-1]) + 1 if before.size else 0
    return first, at + int(after[0]) if after.size else samples.size


def solve_flight(
    samples: Sequence[Floats],
    arcs: Sequence[Sequence[Arc]],
    intervals: Sequence[float],
    omega: float,
    *,
    fixed: Sequence[float] | None = None,
    scan: float = 2.5,
) -> Flight | None:
    """Fit all flights of all recordings.

    Parameters
    ----------
    samples : per recording, its samples
    arcs : per recording, [first, end) of every flight
    intervals : per recording, s
    omega : rough angular frequency, rad/s
    fixed : per recording, a known offset; None estimates it
    scan : the best frequency is first looked for between omega / scan and omega * scan; 1 for none

    Returns
    -------
    The fit, or None when there is not enough to fit.
    """
    blocks = _Blocks(samples, arcs, intervals, fixed)
    if blocks.arc_count == 0 or blocks.values.size < 2 * blocks.arc_count + 4:
        return None
    start = omega
    if scan > 1:
        grid = omega * np.geomspace(1 / scan, scan, 2 * int(np.ceil(np.log(scan) / 0.05)) + 1)
        start = float(grid[np.argmin([np.sum(blocks.residuals(w, 0.0) ** 2) for w in grid])])

    # The search stops on relative changes, but also on small gradients: the unit must not matter.
    unit = float(np.sqrt(np.mean(blocks.residuals(start, 0.0) ** 2))) or 1.0

    def residuals(x: Floats) -> Floats:
        return blocks.residuals(start * np.exp(x[0]), start * x[1]) / unit

    found = least(residuals, [[0.0, 0.0]], scale=0.01, bounds=([-0.5, -0.05], [0.5, 0.5]))
    w, b = start * float(np.exp(found.x[0])), start * float(found.x[1])
    freedom = max(1, blocks.values.size - 2 * blocks.arc_count - 3)
    variance = float(np.sum(found.residuals**2)) / freedom
    rms = float(np.sqrt(variance)) * unit
    sd_omega, sd_decay = found.standard_errors(variance)
    offsets, waves, offset_sd = blocks.solve(w, b)
    step = 1e-4
    slope = (blocks.solve(w * (1 + step), b)[0] - blocks.solve(w * (1 - step), b)[0]) / (2 * step)
    return Flight(
        omega=w,
        decay=b,
        offsets=offsets,
        rms=rms,
        sd_omega=float(sd_omega) * w,
        sd_decay=float(sd_decay) * start,
        sd_offset=float(np.hypot(rms * offset_sd, sd_omega * np.abs(slope).max())),
        offset_slope=slope,
        waves=waves,
    )


def waves_of(
    flight: Flight,
    samples: Sequence[Floats],
    arcs: Sequence[Sequence[Arc]],
    intervals: Sequence[float],
) -> Flight:
    """The same oscillator and offsets, with the waves of other arcs."""
    blocks = _Blocks(samples, arcs, intervals, list(flight.offsets))
    _, waves, _ = blocks.solve(flight.omega, flight.decay)
    return replace(flight, waves=waves)


class _Blocks:
    """The linear part: every arc's p and q and every recording's offset for given w and b."""

    def __init__(
        self,
        samples: Sequence[Floats],
        arcs: Sequence[Sequence[Arc]],
        intervals: Sequence[float],
        fixed: Sequence[float] | None,
    ) -> None:
        values, times, middles, owner, sizes = [], [], [], [], []
        for r, (signal, runs, dt) in enumerate(zip(samples, arcs, intervals, strict=True)):
            for first, end in runs:
                middle = 0.5 * (first + end - 1)
                values.append(signal[first:end])
                times.append((np.arange(first, end) - middle) * dt)
                middles.append(middle * dt)
                owner.append(r)
                sizes.append(end - first)
        self.recordings = len(samples)
        self.arc_count = len(sizes)
        self.values = np.concatenate(values) if values else np.empty(0)
        self.times = np.concatenate(times) if times else np.empty(0)
        self.middles = np.array(middles)
        self.owner = np.array(owner, dtype=np.intp)
        self.sizes = np.array(sizes, dtype=np.intp)
        self.reach = 0.5 * np.array([x[-1] - x[0] for x in times])
        self.starts = np.concatenate([[0], np.cumsum(self.sizes)[:-1]]).astype(np.intp)
        self.fixed = None if fixed is None else np.asarray(fixed, dtype=np.float64)

    def _project(self, w: float, b: float) -> tuple[Floats, Floats, Floats, Floats]:
        """Orthonormal pair of columns per arc, and the triangular factor between (p, q) and it."""
        # The envelope is one where it is largest, so that no decay rate overflows on a long arc.
        envelope = np.exp(-b * self.times - self._per_sample(abs(b) * self.reach))
        cosine, sine = envelope * np.cos(w * self.times), envelope * np.sin(w * self.times)
        r11 = np.sqrt(self._sum(cosine**2))
        first = cosine / self._per_sample(r11)
        r12 = self._sum(first * sine)
        second = sine - first * self._per_sample(r12)
        r22 = np.sqrt(self._sum(second**2))
        return first, second / self._per_sample(r22), np.stack([r11, r12]), r22

    def _sum(self, x: Floats) -> Floats:
        return np.add.reduceat(x, self.starts)

    def _per_sample(self, per_arc: Floats) -> Floats:
        return np.repeat(per_arc, self.sizes)

    def _without(self, x: Floats, first: Floats, second: Floats) -> Floats:
        """`x` less its part along both columns of its arc."""
        left = x - first * self._per_sample(self._sum(first * x))
        return np.asarray(left - second * self._per_sample(self._sum(second * x)))

    def _offsets(self, left: Floats, ones: Floats) -> tuple[Floats, float]:
        if self.fixed is not None:
            return self.fixed, 0.0
        weight = np.bincount(self.owner, self._sum(ones**2), self.recordings)
        along = np.bincount(self.owner, self._sum(ones * left), self.recordings)
        safe = np.where(weight > 0, weight, np.inf)
        return along / safe, float(1 / np.sqrt(safe.min()))

    def residuals(self, w: float, b: float) -> Floats:
        """Residuals of all samples for given w and b, everything linear solved."""
        first, second, _, _ = self._project(w, b)
        left = self._without(self.values, first, second)
        ones = self._without(np.ones_like(self.values), first, second)
        offsets, _ = self._offsets(left, ones)
        return np.asarray(left - ones * self._per_sample(offsets[self.owner]))

    def solve(self, w: float, b: float) -> tuple[Floats, tuple[Floats, ...], float]:
        """Offsets per recording, waves per recording, and sd of the offsets for unit noise."""
        first, second, upper, r22 = self._project(w, b)
        left = self._without(self.values, first, second)
        ones = self._without(np.ones_like(self.values), first, second)
        offsets, offset_sd = self._offsets(left, ones)
        signal = self.values - self._per_sample(offsets[self.owner])
        z1, z2 = self._sum(first * signal), self._sum(second * signal)
        q = z2 / r22
        p = (z1 - upper[1] * q) / upper[0]
        scale = np.exp(-abs(b) * self.reach)
        table = np.column_stack([self.middles, p * scale, q * scale])
        waves = tuple(table[self.owner == r] for r in range(self.recordings))
        return offsets, waves, offset_sd
