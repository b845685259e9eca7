"""Which effects does the equation of motion ask for along the measured motion?

Where the misfit is large, simulation and recording are out of step, and what a score finds along
the simulated motion means little. The equation of motion in weak form (`response.weak_form`) needs
no simulation: every force is evaluated along the measured motion, all sizes follow from one linear
least-squares problem, and every set of effects from its normal equations (equation-error method;
Messenger and Bortz 2021, Multiscale Model. Simul. 19:1474, for sets of terms in weak form). Noise
inside the forces and readings that are too sparse for an impact bias it. So it decides nothing: the
best sets, with all their parameters, are where refits begin.

Impacts that few samples show, and a law of the stop that is not the base model's, bias the sizes of
all forces. The same problem over stretches of free flight alone knows nothing of the stop.

A state that the motion drives (a memory) follows from the measured motion. A velocity or an
acceleration obeys the equation differentiated; what forces act along is its integral, where no
input and no stop is beside it (`response.displacement`). Effects that no force along a given path
stands for (a further mode, another gap) are not seen here.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky_banded, solve_banded

from bayesimpact.data.high_pass import before_high_pass
from bayesimpact.diagnosis.candidates.term_sets import EffectColumns
from bayesimpact.diagnosis.refits.extend import at_null, extend, transfer
from bayesimpact.diagnosis.score_test.directions import (
    is_periodic,
    shape_points,
    size_parameters,
    size_steps,
)
from bayesimpact.diagnosis.thresholds import DOUBT
from bayesimpact.inference.fit import Fit, PosteriorDensity
from bayesimpact.model.effects.effect import Effect, Scales
from bayesimpact.model.linear_response.path_forces import add_forces
from bayesimpact.model.oscillator import Oscillator
from bayesimpact.model.parameters import INPUT_GAIN, SLOTS, instance_name
from bayesimpact.response.measured_motion import from_rest, measured_motion
from bayesimpact.response.weak_form import Rows, products, rows_of

Array = NDArray[np.float64]
_C1, _K1, _GAP, _K2, _OFFSET, _FRICTION = (
    SLOTS.index(n) for n in ("c1", "k1", "g", "k2", "offset", "friction")
)

WIDTH = 0.5  # half width of a stretch, natural periods
FLIGHT_WIDTH = 1 / 8  # of one in flight: every flight lasts half a period, two stretches and more
# points of a shape grid for one of the scores', to which a force along a path costs little: what a
# shape beside the true one leaves of a large effect asks for other effects
FINER = 4
RIDGE = 1e-9  # stretches that overlap much are nearly dependent


@dataclass(frozen=True, eq=False)
class Path:
    """A recording's measured motion, y, v, d, t (n,) in SI units, and its stretches.

    reading : (n,) what is read, less its offset
    operator : (w,) by which a stretch weighs the readings' errors
    factor : (lags, stretches) banded Cholesky factor of the covariance of the stretches' errors
    """

    y: Array
    v: Array
    d: Array
    t: Array
    reading: Array
    rows: Rows
    operator: Array
    factor: Array

    def whiten(self, x: Array) -> Array:
        """Integrals (stretches, k) in units of their noise."""
        return np.asarray(solve_banded((self.factor.shape[0] - 1, 0), self.factor, x))


def measured_paths(fit: Fit, *, flight: bool = False) -> list[Path]:
    """Every recording's displacement and velocity from its own readings, about the fit's rest and
    gap; of those in `flight` the stretches do not reach the stop.
    """
    o, noise = fit.density.oscillator, fit.density.likelihood.noise
    found = []
    for i, q in enumerate(o.layout.slots(fit.mode)):
        r = before_high_pass(
            o.campaign.recordings[i], q[_OFFSET], o.settled_on(i, fit.mode) + q[_OFFSET]
        )
        period = 2 * np.pi * float(np.sqrt(o.campaign.mass / q[_K1]))
        level = noise.level * noise.scales[r.order]
        y, v, reading = measured_motion(from_rest(r, q[_OFFSET]), period, level)
        d = y - q[_GAP] if o.campaign.stop else np.full(y.size, -np.inf)
        rows = rows_of(r, o.campaign.mass, (FLIGHT_WIDTH if flight else WIDTH) * period)
        rows = _without_rests(rows, r.samples, level)
        if flight:
            rows = _without(rows, d > -DOUBT * noise.level)
        operator = o.campaign.mass * rows.bend + q[_C1] * rows.slope + q[_K1] * rows.phi
        factor = _factor(rows, operator * level)
        found.append(Path(y, v, d, r.times, reading, rows, operator, factor))
    return found


def _without(rows: Rows, affected: NDArray[np.bool_]) -> Rows:
    """Stretches less those with a sample in `affected` (n,)."""
    seen = products(affected.astype(np.float64), rows.hop, np.ones(rows.phi.size))[:, 0]
    return _only(rows, seen == 0.0)


def _without_rests(rows: Rows, samples: Array, noise: float) -> Rows:
    """Stretches less those in which the mass moves no more than its readings scatter.

    Dry friction holds it there at a displacement that no law of the motion tells.
    """
    mean = np.full(rows.phi.size, 1.0 / rows.phi.size)
    centred = samples - samples.mean()
    scatter = products(centred**2, rows.hop, mean) - products(centred, rows.hop, mean) ** 2
    return _only(rows, scatter[:, 0] > 2.0 * noise**2)


def _only(rows: Rows, kept: NDArray[np.bool_]) -> Rows:
    return replace(rows, base=rows.base * kept[:, None], target=rows.target * kept)


def _factor(rows: Rows, weights: Array) -> Array:
    """Banded Cholesky factor of the covariance of stretches whose errors weigh the noise so."""
    lags = range(0, weights.size, rows.hop)
    shared = [float(weights[: weights.size - lag] @ weights[lag:]) for lag in lags]
    band = np.zeros((len(shared), rows.target.size))
    for lag, value in enumerate(shared[: rows.target.size]):
        both = rows.kept[: rows.kept.size - lag] & rows.kept[lag:]
        band[lag, : both.size] = np.where(both, value, 0.0)
    band[0] = np.where(rows.kept, band[0] * (1 + RIDGE), 1.0)
    return np.asarray(cholesky_banded(band, lower=True))


def base_columns(fit: Fit, paths: Sequence[Path]) -> tuple[list[Array], list[Array], list[str]]:
    """Whitened (stretches, b) of the base model's parameters and (stretches,) of what they must
    explain, per recording, and the parameters' names; the rest readings are already taken out.
    """
    o = fit.density.oscillator
    campaign, slots = o.campaign, o.layout.slots(fit.mode)
    names = ["k1", "c1", *([INPUT_GAIN] if INPUT_GAIN in o.layout.names else [])]
    if campaign.stop:
        names += ["c2", "g", *(f"k2[{case}]" for case in campaign.cases)]
    columns, targets = [], []
    for r, path, q in zip(campaign.recordings, paths, slots, strict=True):
        rows, found = path.rows, {"k1": path.rows.base[:, 0], "c1": path.rows.base[:, 1]}
        target = rows.target
        if r.input is not None and r.input.free:
            found[INPUT_GAIN] = -rows.base[:, 2]
        else:
            target = target + rows.base[:, 2]
        if campaign.stop:
            inside = np.maximum(path.d, 0.0)
            contact_products = products(inside, rows.hop, rows.phi, rows.slope) * rows.kept[:, None]
            found[f"k2[{r.case}]"], found["c2"] = contact_products.T
            found["g"] = -q[_K2] * rows.integrals((path.d > 0).astype(np.float64))
        own = np.stack([found.get(name, 0.0 * target) for name in names], axis=1)
        white = without_rest(path, np.column_stack([own, target]))
        columns.append(white[:, :-1])
        targets.append(white[:, -1])
    return columns, targets, names


def without_rest(path: Path, x: Array) -> Array:
    """Whitened integrals (stretches, k) less what a constant reading does."""
    white = path.whiten(np.column_stack([x, path.rows.base[:, 3]]))
    rest = white[:, -1] / max(float(np.linalg.norm(white[:, -1])), 1e-300)
    return np.asarray(white[:, :-1] - np.outer(rest, rest @ white[:, :-1]))


def terms_of(
    fit: Fit, effects: Iterable[Effect], scales: Scales, paths: Sequence[Path]
) -> list[EffectColumns]:
    """What every effect adds to the equation of motion, at every point of a finer shape grid.

    None of a periodic one, whose frequency has no grid.
    """
    found = []
    for effect in effects:
        if is_periodic(effect) or not is_a_force(effect) or not effect.admissible(scales):
            continue
        density = extend(fit, (effect,), scales)
        grid = shape_points(effect, scales)
        for shapes in shape_points(effect, scales, FINER):
            term = term_at(fit, density, effect, scales, shapes, paths)
            if term is not None:
                found.append(replace(term, on_grid=shapes in grid))
    return found


def is_a_force(effect: Effect) -> bool:
    """Whether what an effect does is a force along a given path, or an addition to the readings.

    Of a law that stands in the place of a term of the base model, whose size it shares, the force
    beside that term, which stays an unknown.
    """
    plain = not effect.sets or (effect.law is not None and not effect.has_size)
    return set(effect.binds) <= {"friction"} and plain


def term_at(
    fit: Fit,
    density: PosteriorDensity,
    effect: Effect,
    scales: Scales,
    shapes: Mapping[str, float],
    paths: Sequence[Path],
) -> EffectColumns | None:
    """What an effect of `density` adds at one point of its shapes, all others at their null; None
    where that is nothing, or not finite.
    """
    layout = density.oscillator.layout
    theta = at_null(density, transfer(fit, layout, (effect,), scales, shapes))
    sizes = size_parameters(density, effect)
    points, steps = size_steps(density, effect, theta, scales)
    columns = []
    for r, path in enumerate(paths):
        added = _added(density, effect, r, path, points)
        changes = (added[1:] - added[0]) / steps[:, None]
        own = np.concatenate([added[:1], changes])
        columns.append(without_rest(path, own.T))
    one_sided = (True, *(p.lower == p.null for _, p in sizes))
    names = (effect.id, *(name for name, _ in sizes))
    seen = [i for i in range(len(names)) if any(np.any(c[:, i]) for c in columns)]
    if not seen or not all(np.isfinite(c).all() for c in columns):
        return None
    return EffectColumns(
        effect, shapes, tuple(names[i] for i in seen), tuple(c[:, seen] for c in columns),
        tuple(one_sided[i] for i in seen),
    )  # fmt: skip


def _added(density: PosteriorDensity, effect: Effect, r: int, path: Path, points: Array) -> Array:
    """What an effect adds to the left-hand side, integrated, for parameters (K, d): (K, n)."""
    o = density.oscillator
    q = o.layout.slots_of(r, points)
    force = np.zeros((q.shape[0], path.y.size))
    for law in o.laws:
        add_forces(law, path.y, path.v, path.d, path.t, q, np.arange(q.shape[0]), force)
    force += q[:, _FRICTION, None] * np.sign(path.v)
    found = path.rows.integrals(force)
    if effect.observe is not None:
        numbers = np.stack([points[:, i] for i in _own_columns(o, effect, r)], axis=1)
        read = effect.observe(np.repeat(path.reading[None], q.shape[0], axis=0), path.t, numbers)
        moved = [products(one - path.reading, path.rows.hop, path.operator)[:, 0] for one in read]
        found = found - np.where(path.rows.kept, np.stack(moved), 0.0)
    return np.asarray(found)


def _own_columns(oscillator: Oscillator, effect: Effect, r: int) -> list[int]:
    """Where the parameters of an effect of the measuring chain stand in theta."""
    recording = oscillator.campaign.recordings[r]
    keys = {"campaign": None, "case": recording.case, "recording": recording.name}
    index = oscillator.layout.index
    return [index(instance_name(effect, p, keys[p.scope])) for p in effect.parameters]
