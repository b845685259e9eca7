"""Where in (displacement, velocity) a force is missing: a Gaussian process on the force.

The unexplained force is a(y) + b(y) v with B-spline coefficients of independent normal priors. Each
coefficient's response is simulated, whitened and projected off everything the model fits, so what
remains of the misfit is explained by force, not by displacement errors that an earlier force left
behind. A second form, a(t) y + b(t) v, catches stiffness and damping that change with time; a third
one, a(d) + b(d) v in contact alone, what begins with a jump at impact. In the linearised problem
the coefficients' posterior and the evidence are closed forms; the prior widths and the number of
knots maximise the evidence.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.short_repr import short_repr
from bayesimpact.diagnosis.residual_force.evidence import WIDTHS, ForceEvidence
from bayesimpact.diagnosis.residual_force.learned import (
    DEPTHS,
    KNOTS,
    TIMES,
    learned_contact,
    learned_drift,
    learned_force,
    spline_basis,
)
from bayesimpact.diagnosis.score_test.directions import sigma_of, whitened
from bayesimpact.diagnosis.score_test.projection import Projection, project
from bayesimpact.inference.fit import Fit, inverse
from bayesimpact.model.effects.effect import Effect, Scales
from bayesimpact.model.law_table import law_row
from bayesimpact.model.measurement import smooth
from bayesimpact.model.motions import general_motions
from bayesimpact.model.oscillator import Oscillator
from bayesimpact.model.parameters import SLOTS

Array = NDArray[np.float64]

NULL_DRAWS = 1000
FACTORS = (1, 3, 7)  # 24, 10 and 6 knots: the evidence chooses how smooth a force is


@dataclass(frozen=True, eq=False)
class MissingForce:
    """Posterior of the unexplained force in the linearised problem.

    Attributes
    ----------
    effect : the learned force with these prior widths, to be put back into the simulator
    knots : number of coefficients of a and of b
    low, spacing : first displacement and knot distance, m
    mean, covariance : of the 2 knots coefficients (a in N, then b in N s/m)
    log_evidence : of the force over no force
    p_value : of the largest log evidence, against its simulated law under the model
    projection : scores of the coefficients
    reach : 0 for a(y) + b(y) v; else a(t) y / reach + b(t) v, and `low`, `spacing` are times in s
    touching : acts beyond `low` only, which is the gap
    """

    effect: Effect
    knots: int
    low: float
    spacing: float
    mean: Array
    covariance: Array
    log_evidence: float
    p_value: float
    projection: Projection
    reach: float = 0.0
    touching: bool = False

    __repr__ = short_repr

    @property
    def gain(self) -> float:
        """What the mean force gains in log likelihood, nats, in the linearised problem."""
        bend = self.projection.information @ self.mean
        return float(self.mean @ (self.projection.score - 0.5 * bend))

    def share_within(self, low: float, high: float) -> float:
        """Share of its energy 1/2 s'Cs that a force between two displacements, m, has alone.

        What the fitted parameters imitate counts nowhere, so a force in contact is found there even
        where the mean force, which is arbitrary by such imitations, is not.
        """
        score = self.projection.score
        whole = float(score @ self.covariance @ score)
        centres = self.low + self.spacing * np.arange(-1, self.knots - 1)
        inside = (centres > low - self.spacing) & (centres < high + self.spacing)
        kept = np.flatnonzero(np.tile(inside, 2))
        precision = inverse(self.covariance)[np.ix_(kept, kept)]
        alone = float(score[kept] @ inverse(precision) @ score[kept])
        return alone / max(whole, 1e-300)

    def parts(self, y: Array) -> tuple[Array, Array]:
        """Conservative a N and dissipative b N s/m at displacements (or times) (n,)."""
        basis = self._basis(y)
        return basis @ self.mean[: self.knots], basis @ self.mean[self.knots :]

    def sd(self, y: Array) -> tuple[Array, Array]:
        """Posterior standard deviations of a(y) and b(y) at displacements (n,)."""
        basis, n = self._basis(y), self.knots
        a = np.einsum("ni,ij,nj->n", basis, self.covariance[:n, :n], basis)
        b = np.einsum("ni,ij,nj->n", basis, self.covariance[n:, n:], basis)
        return np.sqrt(np.maximum(a, 0)), np.sqrt(np.maximum(b, 0))

    def deviation(self, y: Array, v: Array, t: Array) -> Array:
        """Posterior standard deviation of the force at points of the trajectory (n,), N."""
        basis, first = (self._basis(t), y / self.reach) if self.reach else (self._basis(y), 1.0)
        both = np.hstack([basis * np.reshape(first, (-1, 1)), basis * v[:, None]])
        variance = np.einsum("ni,ij,nj->n", both, self.covariance, both)
        return np.asarray(np.sqrt(np.maximum(variance, 0.0)))

    def _basis(self, along: Array) -> Array:
        basis = spline_basis(along, self.low, self.spacing, self.knots)
        return basis * (along >= self.low)[:, None] if self.touching else basis

    def force(self, y: Array, v: Array, t: Array) -> Array:
        """Mean force at points of the trajectory (n,), N; times in s."""
        if self.reach:
            a, b = self.parts(t)
            return a * y / self.reach + b * v
        a, b = self.parts(y)
        return a + b * v


@dataclass(frozen=True)
class Form:
    """One form of an unknown force.

    Attributes
    ----------
    learned : the effect for a number of knots and prior widths of a, N, and b, N s/m
    low, length : first displacement (or time) and extent, m (or s)
    intervals : between the knots, at the finest resolution
    factors : divisors of it: how much coarser the other resolutions are
    reach, touching : as in `MissingForce`
    """

    learned: Callable[[int, float, float], Effect]
    low: float
    length: float
    intervals: int
    factors: tuple[int, ...]
    reach: float = 0.0
    touching: bool = False


def missing_force(
    fit: Fit, scales: Scales, *, rng: np.random.Generator, knots: int = KNOTS
) -> MissingForce:
    """Posterior of the force of displacement and velocity that the fit's model leaves out; `knots`
    at the finest resolution.
    """
    low, high = motion_range(fit)

    def learned(count: int, a: float, b: float) -> Effect:
        return learned_force(low, high, a, b, count)

    factors = tuple(f for f in FACTORS if (knots - 3) % f == 0)
    return _missing(fit, scales, rng, Form(learned, low, high - low, knots - 3, factors))


def missing_drift(fit: Fit, scales: Scales, *, rng: np.random.Generator) -> MissingForce:
    """Posterior of a change of stiffness and damping with time that the model leaves out."""

    def learned(knots: int, a: float, b: float) -> Effect:
        return learned_drift(scales.duration, scales.amplitude, a, b, knots)

    form = Form(learned, 0.0, scales.duration, TIMES - 3, (1,), reach=scales.amplitude)
    return _missing(fit, scales, rng, form)


def missing_contact(fit: Fit, scales: Scales, *, rng: np.random.Generator) -> MissingForce | None:
    """Posterior of a force in contact that the model leaves out; None where nothing is touched."""
    if scales.indentation <= 0.0:
        return None

    def learned(knots: int, a: float, b: float) -> Effect:
        return learned_contact(scales.indentation, a, b, knots)

    form = Form(learned, scales.gap, scales.indentation, DEPTHS - 3, (1,), touching=True)
    return _missing(fit, scales, rng, form)


def _missing(
    fit: Fit,
    scales: Scales,
    rng: np.random.Generator,
    form: Form,
) -> MissingForce:
    """The likeliest resolution and prior widths of one form, and their odds by chance.

    Responses are simulated at the finest resolution; coarser splines are combinations of its own.
    """
    unit = scales.force, scales.force / scales.speed
    knots = form.intervals + 3
    responses = basis_responses(fit, form.learned(knots, *unit), knots, scales)
    fine = project(fit, responses)
    draws = ForceEvidence(fine.information, np.repeat(unit, knots), knots).null_draws(
        rng, NULL_DRAWS
    )
    best: tuple[float, int, float, float, Projection] | None = None
    null: Any = np.full(NULL_DRAWS, -np.inf)
    for factor in form.factors:
        count = form.intervals // factor + 3
        weights: Array = np.kron(np.eye(2), refinement(count, factor)).astype(np.float64)
        projection = fine.combined(weights)
        evidence = ForceEvidence(projection.information, np.repeat(unit, count), count)
        found, which = evidence.maximum(projection.score[None])
        null = np.maximum(null, evidence.maximum(draws @ weights)[0])
        if best is None or found[0] > best[0]:
            best = (float(found[0]), count, *evidence.pairs[int(which[0])], projection)
    assert best is not None
    log_evidence, count, width_a, width_b, projection = best
    evidence = ForceEvidence(projection.information, np.repeat(unit, count), count)
    mean, covariance = evidence.posterior(projection.score, width_a, width_b)
    wide_a, wide_b = np.maximum((width_a, width_b), WIDTHS[1])  # a prior needs some width
    return MissingForce(
        form.learned(count, wide_a * unit[0], wide_b * unit[1]),
        count,
        form.low,
        form.length / (count - 3),
        mean,
        covariance,
        log_evidence,
        float((1 + np.sum(null >= log_evidence)) / (1 + NULL_DRAWS)),
        projection,
        form.reach,
        form.touching,
    )


def refinement(count: int, factor: int) -> Array:
    """Coefficients of `count` cubic B-splines in those on knots `factor` times as near (K, count).

    The coarse splines lie in the space of the fine ones, so points enough give them exactly.
    """
    fine = (count - 3) * factor + 3
    points = np.linspace(0.0, count - 3.0, 4 * fine)
    values = spline_basis(points, 0.0, 1.0 / factor, fine)
    return np.asarray(np.linalg.lstsq(values, spline_basis(points, 0.0, 1.0, count), rcond=None)[0])


def motion_range(fit: Fit) -> tuple[float, float]:
    """Smallest and largest displacement of all fitted recordings about their rest, m."""
    moved = fit.displacements
    return float(min(m.min() for m in moved)), float(max(m.max() for m in moved))


def basis_responses(fit: Fit, effect: Effect, knots: int, scales: Scales) -> tuple[Array, ...]:
    """Whitened responses (noise = 1) to a unit of each coefficient: per recording (n, 2 knots)."""
    oscillator, sigma = fit.density.oscillator, sigma_of(fit)
    head = [p.fixed for p in effect.parameters if p.fixed is not None]
    table = with_law(oscillator, effect)
    slots = oscillator.layout.slots(fit.mode)
    step = np.repeat([scales.force, scales.force / scales.speed], knots)
    result = []
    for r, recording in enumerate(oscillator.campaign.recordings):
        q = np.concatenate([slots[r], head, np.zeros(2 * knots)])
        n = recording.samples.size
        first = _change(oscillator, table, q, step * 1e-7, r, n, knots)
        white = whitened_one(fit, r, first, sigma)
        norms = np.sqrt(np.einsum("kn,kn->k", white, white))
        scale = np.where(norms > 0, 1e-7 * np.minimum(1.0 / np.maximum(norms, 1e-12), 1e6), 1e-7)
        change = _change(oscillator, table, q, step * scale, r, n, knots)
        lost = ~np.isfinite(change).all(axis=1)  # a force large enough to be seen: it runs away
        change[lost], scale[lost] = np.nan_to_num(first[lost], posinf=0.0, neginf=0.0), 1e-7
        result.append((whitened_one(fit, r, change, sigma) / (step * scale)[:, None]).T)
    return tuple(result)


def whitened_one(fit: Fit, r: int, values: Array, sigma: Array) -> Array:
    """Filtered, whitened signals (k, n) of one recording in units of the noise."""
    oscillator, noise = fit.density.oscillator, fit.density.likelihood.noise
    recording = oscillator.campaign.recordings[r]
    filtered = smooth(values, oscillator.smoothing, recording.interval)
    white = noise.whitened(recording, filtered)
    return np.asarray(white / sigma[r])


def with_law(oscillator: Oscillator, effect: Effect) -> NDArray[np.int64]:
    assert effect.law is not None
    first = len(SLOTS) + sum(len(e.parameters) for e in oscillator.acting if e.law is not None)
    row = np.array([law_row(effect.law, first)], dtype=np.int64)
    return np.concatenate([oscillator.laws, row])


def _change(
    oscillator: Oscillator,
    laws: NDArray[np.int64],
    q: Array,
    steps: Array,
    r: int,
    n: int,
    knots: int,
) -> Array:
    points = np.repeat(q[None], 2 * knots + 1, axis=0)
    columns = q.size - 2 * knots + np.arange(2 * knots)
    points[1 + np.arange(2 * knots), columns] += steps
    intervals = np.full(points.shape[0], oscillator.intervals[r])
    counts = np.full(points.shape[0], n, dtype=np.int64)
    inputs = oscillator.inputs
    if inputs is not None:
        inputs = inputs.of(np.full(points.shape[0], r))
    orders = np.full(points.shape[0], oscillator.orders[r])
    out = general_motions(points, oscillator.campaign.mass, counts, intervals, laws, orders, inputs)
    return np.asarray(out[1:] - out[0])


def trajectory_points(fit: Fit) -> Sequence[tuple[Array, Array]]:
    """Displacement and velocity of the fitted motion at the samples, per recording, m and m/s."""
    pairs = zip(fit.displacements, fit.density.oscillator.intervals, strict=True)
    return [(y, np.gradient(y, interval)) for y, interval in pairs]


__all__ = ["MissingForce", "missing_force", "motion_range", "trajectory_points", "whitened"]
