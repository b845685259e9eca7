"""Gaussian likelihood of the displacement residuals, and its linearisation.

    log L = sum_r [ -n_r log sigma_r - S_r / (2 sigma_r^2) - (n_r / 2) log 2 pi + log volume_r ]

with S_r the sum of squares of the whitened residual of recording r and n_r its size (see `noise`);
of readings in coarse steps the quasi-likelihood of what they are on average (`model.rounding`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.short_repr import short_repr
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.exact.sensitivities.derivatives import trajectories_and_derivatives
from bayesimpact.model.exact.simulate import sums_of_squares
from bayesimpact.model.linear_response.nearby import readings_near
from bayesimpact.model.measurement import high_passed, remembered, smooth
from bayesimpact.model.oscillator import Oscillator
from bayesimpact.model.parameters import BASE_SLOTS, SLOTS, Layout
from bayesimpact.model.rounding import Rounding, average_square, coarse_step, likeliest_rounding

Array = NDArray[np.float64]
Index = NDArray[np.int64]
_OFFSET = SLOTS.index("offset")
# of the noise: how wrong a superposed step may be. Steps are a twentieth of a standard deviation:
# a derivative times that is then right to a tenth of the noise
SLIGHT = 0.005
_CHUNK_SAMPLES = 4_000_000  # predictions held at once, so that memory stays bounded


@dataclass(frozen=True)
class DifferenceFormula:
    """Difference formula: shifts in steps, weights per step of the centre and of the shifted."""

    shifts: tuple[float, ...]
    weights: tuple[float, ...]


FORWARD = DifferenceFormula((1.0,), (-1.0, 1.0))
CENTRAL = DifferenceFormula((1.0, -1.0), (0.0, 0.5, -0.5))
INWARD = DifferenceFormula((1.0, 2.0), (-1.5, 2.0, -0.5))  # to second order, from a bound


@dataclass(frozen=True, eq=False)
class Linearisation:
    """One recording near a parameter vector, whitened: residual ~ r - J (theta - theta0)[columns].

    Attributes
    ----------
    residual : (n,), recorded minus predicted, m
    jacobian : (n, k), derivative of the prediction
    columns : (k,), positions in theta
    """

    residual: Array
    jacobian: Array
    columns: Index

    __repr__ = short_repr

    def whole(self, size: int) -> Array:
        """The derivative with respect to all of `size` parameters, (n, size)."""
        found = np.zeros((self.residual.size, size))
        found[:, self.columns] = self.jacobian
        return found


@dataclass(frozen=True, eq=False)
class Likelihood:
    """Likelihood of all recordings under an oscillator and a noise model."""

    oscillator: Oscillator
    noise: Noise

    in_closed_form: ClassVar[bool] = True
    """The base oscillator's motions and derivatives are those of the closed form."""

    __repr__ = short_repr

    @cached_property
    def sizes(self) -> Array:
        """Independent numbers per recording, (R,)."""
        recordings = self.oscillator.campaign.recordings
        return np.array(
            [self.noise.size(r.samples.size, r.interval, r.used) for r in recordings],
            dtype=np.float64,
        )

    @cached_property
    def log_volume(self) -> Array:
        """Log determinant of the whitening per recording, (R,)."""
        recordings = self.oscillator.campaign.recordings
        return np.array([self.noise.volume_of(r) for r in recordings])

    @cached_property
    def scales(self) -> Array:
        """Level of every recording's noise over that of the first quantity's, (R,)."""
        return np.array([self.noise.scales[order] for order in self.oscillator.orders])

    @cached_property
    def sigma_columns(self) -> Index:
        """Position in theta of every recording's noise level, (R,)."""
        positions = self.oscillator.layout.roles("noise")
        return np.resize(positions, self.oscillator.counts.size)

    @cached_property
    def steps(self) -> tuple[float, ...]:
        """Coarse steps that every recording's readings come in, 0 for none, as behind a filter; see
        `rounding`.
        """
        if self.noise.smoothing is not None:
            return (0.0,) * self.oscillator.counts.size
        pairs = zip(self.oscillator.campaign.recordings, self.scales, strict=True)
        return tuple(coarse_step(one, self.noise.level * scale) for one, scale in pairs)

    @cached_property
    def _average_squares(self) -> tuple[float, ...]:
        """Mean squares (R,) of what coarse steps add to an average reading; 0 for none."""
        pairs = zip(self.steps, self.noise.level * self.scales, strict=True)
        return tuple(average_square(q, float(s)) if q > 0.0 else 0.0 for q, s in pairs)

    def misfit(self, theta: Array) -> Array:
        """Sums of squares of the whitened residuals, (B, R), m2, of readings in coarse steps as
        their quasi-likelihood has them; inf where inadmissible.
        """
        o = self.oscillator
        theta = np.ascontiguousarray(np.atleast_2d(theta))
        plain = self.in_closed_form and o.is_plain and o.is_whole
        if plain and self.noise.is_white and not any(self.steps):
            base = slice(0, len(BASE_SLOTS))
            columns = np.ascontiguousarray(o.layout.columns[:, base])
            constants = np.ascontiguousarray(o.layout.constants[:, base])
            sums, _ = sums_of_squares(
                theta,
                columns,
                constants,
                o.campaign.mass,
                o.samples,
                o.starts,
                o.counts,
                o.intervals,
                o.orders,
                o.inputs,
            )
            return np.asarray(sums / self.scales**2)
        sums = np.empty((theta.shape[0], o.counts.size))
        size = max(1, _CHUNK_SAMPLES // (o.counts.size * int(o.counts.max())))
        for first in range(0, theta.shape[0], size):
            part = slice(first, first + size)
            sums[part] = self.residuals_and_sums(theta[part])[1]
        return np.where(np.isfinite(sums), sums, np.inf)

    def residuals(self, theta: Array) -> tuple[Array, ...]:
        """Whitened residual of every recording, (B, m), m, for parameter vectors (B, d)."""
        return tuple(self.residual(r, seen) for r, seen in enumerate(self.seen(theta)))

    def residuals_and_sums(self, theta: Array) -> tuple[tuple[Array, ...], Array]:
        """The same, and their sums of squares (B, R), of readings in coarse steps as their
        quasi-likelihood has them; finite or not.
        """
        residuals = list[Array]()
        sums = np.empty((theta.shape[0], self.oscillator.counts.size))
        for r, seen in enumerate(self.seen(theta)):
            white = self.residual(r, seen)
            residuals.append(white)
            sums[:, r] = np.einsum("bn,bn->b", white, white)
            if self.steps[r] > 0.0:
                sums[:, r] += self.coarse_squares(r, seen).sum(axis=1)
        return tuple(residuals), sums

    def residual(self, r: int, seen: Array) -> Array:
        """Whitened residual (B, m) of recording `r` from what the probe would see (B, n)."""
        samples = self.oscillator.campaign.recordings[r].samples
        return self.whitened(r, samples - self.average(r, seen))

    def coarse_squares(self, r: int, seen: Array) -> Array:
        """By what squares of recording `r`, in coarse steps, about a model (B, n) exceed those of
        its whitened residuals, as the quasi-likelihood counts them (`rounding`), with a mean of 0
        for the noise level; 0 for samples set aside.
        """
        recording = self.oscillator.campaign.recordings[r]
        found = np.full(seen.shape, -self._average_squares[r])
        for row, own in zip(seen, found, strict=True):
            rounding = self.rounding(r, row)
            if rounding is not None:
                own += rounding.squares(row, recording.samples)
                own -= (recording.samples - rounding.read(row)) ** 2
        weight = self.scales[r]
        if self.noise.grows:
            weight = weight * self.noise.relative_sd(recording)
        found /= weight**2
        return found if recording.used is None else np.where(recording.used, found, 0.0)

    def average(self, r: int, seen: Array) -> Array:
        """What recording `r` reads on average of what the probe sees, (..., n); see `rounding`."""
        if self.steps[r] == 0.0:
            return seen
        read = []
        for row in seen.reshape(-1, seen.shape[-1]):
            rounding = self.rounding(r, row)
            read.append(row if rounding is None else rounding.read(row))
        return np.array(read).reshape(seen.shape)

    def rounding(self, r: int, seen: Array) -> Rounding | None:
        """How recording `r` is rounded about what a model says that the probe sees, (n,); None
        where that is no more than noise, as where the model misses the readings by more.
        """
        if self.steps[r] == 0.0:
            return None
        recording = self.oscillator.campaign.recordings[r]
        used = slice(None) if recording.used is None else recording.used
        return likeliest_rounding(self.steps[r], seen[used], recording.samples[used])

    def per_recording(self, theta: Array) -> Array:
        """Log likelihood of every recording, (B, R); -inf where inadmissible."""
        theta = np.atleast_2d(theta)
        sigma = theta[:, self.sigma_columns]
        with np.errstate(divide="ignore", invalid="ignore"):
            value = (
                -self.sizes * (np.log(sigma) + 0.5 * np.log(2 * np.pi))
                - self.misfit(theta) / (2 * sigma**2)
                + self.log_volume
            )
        return np.where((sigma > 0) & np.isfinite(value), value, -np.inf)

    def __call__(self, theta: Array) -> Array:
        """Log likelihood, (B,)."""
        return np.asarray(self.per_recording(theta).sum(axis=1))

    def linearise(
        self,
        theta: Array,
        steps: Array | None = None,
        recordings: Sequence[int] | None = None,
        *,
        roughly: bool = False,
    ) -> tuple[Linearisation, ...]:
        """Whitened residual and Jacobian of the `recordings` (all by default) at `theta` (d,).

        Derivatives are exact (through the events) for the base oscillator and central differences
        with `steps` (d,) otherwise, `roughly` forward differences at half the cost; `steps` should
        be a small fraction of the posterior's standard deviations.
        """
        wanted = range(self.oscillator.counts.size) if recordings is None else recordings
        if self.in_closed_form and self.oscillator.is_base and not self.oscillator.sensors:
            parts = self._exact(theta)
            return tuple(parts[r] for r in wanted)
        if steps is None:
            raise ValueError("an oscillator with added effects needs difference steps")
        return tuple(self._differences(r, theta, steps, roughly) for r in wanted)

    def _whitened(self, r: int, predicted: Array, jacobian: Array, columns: Index) -> Linearisation:
        """Linearisation from what the probe sees (n,) and derivatives (k, n)."""
        recording = self.oscillator.campaign.recordings[r]
        stacked = np.vstack([recording.samples - self.average(r, predicted), jacobian])
        white = self.whitened(r, stacked)
        return Linearisation(white[0], white[1:].T, columns)

    def seen(self, theta: Array) -> tuple[Array, ...]:
        """What the probe would see of every recording, (B, n), for parameter vectors (B, d)."""
        return self.oscillator.predict(theta)

    def whitened(self, r: int, signals: Array) -> Array:
        """Signals (..., n) of recording `r`, whitened."""
        return self.noise.whitened(self.oscillator.campaign.recordings[r], signals)

    def readings(self, r: int, points: Array, error: float) -> Array:
        """Readings (B, n) of recording `r` for parameters (B, d) near the first ones, as right as
        `readings_near` has them.
        """
        return readings_near(self.oscillator, r, points, error)

    def _exact(self, theta: Array) -> tuple[Linearisation, ...]:
        o = self.oscillator
        base = slice(0, len(BASE_SLOTS))
        columns = np.ascontiguousarray(o.layout.columns[:, base])
        constants = np.ascontiguousarray(o.layout.constants[:, base])
        values, slopes, codes = trajectories_and_derivatives(
            np.ascontiguousarray(theta), columns, constants, o.campaign.mass, o.counts, o.intervals,
            int(o.counts.sum()), o.orders, o.inputs,
        )  # fmt: skip
        result = []
        for r, (start, n) in enumerate(zip(o.starts, o.counts, strict=True)):
            part = slice(int(start), int(start + n))
            predicted, jacobian = values[part], slopes[part].T
            if codes[r] != 0:
                predicted = np.full_like(predicted, np.nan)
            used = np.flatnonzero(columns[r] >= 0)
            rows, places = np.vstack([predicted, jacobian[used]]), columns[r, used]
            if (own := o.gains[r]) >= 0:
                rows, places = _with_gain(rows, places, o.layout, theta, r, int(own))
            if (own := o.high_pass_states[r]) >= 0:
                rows, places = _with_high_pass(rows, places, o, theta, r, int(own))
            stacked = smooth(rows, o.smoothing, float(o.intervals[r]))
            result.append(self._whitened(r, stacked[0], stacked[1:], places))
        return tuple(result)

    def _differences(self, r: int, theta: Array, steps: Array, roughly: bool) -> Linearisation:
        o = self.oscillator
        columns = o.recording_columns(r)
        lower = np.array([p.lower for p in o.layout.parameters])
        points, weights = [theta], []
        for i in columns:
            one_sided = theta[i] - steps[i] < lower[i]
            formula = FORWARD if roughly else INWARD if one_sided else CENTRAL
            for shift in formula.shifts:
                point = theta.copy()
                point[i] += shift * steps[i]
                points.append(point)
            weights.append(formula.weights)
        error = SLIGHT * float(theta[self.sigma_columns[r]] * self.scales[r])
        values = self.readings(r, np.array(points), error)
        w = np.array(weights) / steps[columns, None]
        others = w.shape[1] - 1
        jacobian = w[:, :1] * values[0]
        for k in range(1, others + 1):
            jacobian += w[:, k : k + 1] * values[k::others]
        return self._whitened(r, values[0], jacobian, columns)


def _with_gain(
    rows: Array, places: Index, layout: Layout, theta: Array, r: int, gain: int
) -> tuple[Array, Index]:
    """Reading and derivatives (1 + k, n) of recording r under its probe's gain, and the gain's own.

    The rest reading is added behind the gain.
    """
    offset = layout.offsets(r, theta)
    motion = rows[0] - offset
    scaled = rows * theta[gain]
    scaled[0] = motion * theta[gain] + offset
    rest = 1 + np.flatnonzero(places == layout.columns[r, _OFFSET])
    scaled[rest] = rows[rest]
    return np.vstack([scaled, motion]), np.append(places, gain)


def _with_high_pass(
    rows: Array, places: Index, o: Oscillator, theta: Array, r: int, state: int
) -> tuple[Array, Index]:
    """Reading and derivatives (1 + k, n) of recording r after its high-pass, and that by what this
    had settled on. The rest reading is added behind the filter.
    """
    corner, interval = o.campaign.recordings[r].high_pass, float(o.intervals[r])
    kept = remembered(corner, interval, rows.shape[1])
    offset = o.layout.offsets(r, theta)
    rest = 1 + np.flatnonzero(places == o.layout.columns[r, _OFFSET])
    passed = high_passed(np.vstack([rows[:1] - offset, rows[1:]]), corner, interval)
    passed[0] += offset - theta[state] * kept
    passed[rest] = rows[rest]
    return np.vstack([passed, -kept]), np.append(places, state)
