"""How every recording would change under a small amount of an effect that the model leaves out.

A direction is the derivative of the prediction with respect to the size of an effect, at the fitted
model, through simulation, sensor, filter and whitening. Sizes of difference steps are chosen such
that the change is a fraction of the noise: small enough to be linear, far above rounding.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.short_repr import short_repr
from bayesimpact.diagnosis.refits.extend import extend, replaced_slot, transfer
from bayesimpact.inference.fit import Fit, PosteriorDensity
from bayesimpact.model.effects.effect import Effect, EffectParameter, Scales
from bayesimpact.model.parameters import instance_name

Array = NDArray[np.float64]

CHANGE = 3.0  # norm of the response to a difference step, in units of the noise
FIRST_STEP = 1e-5  # of a parameter's physical scale, to find the right step
SIZE_STEP = 1e-3  # of an effect's plausible size
DECAY = "decay"  # parameter of a periodic effect that rings down, 1/s
INVISIBLE = 1e-6  # a response below this at the first step is rounding, not physics


@dataclass(frozen=True, eq=False)
class Direction:
    """Whitened response, in units of the noise, to one unit of an effect.

    Attributes
    ----------
    effect : the effect
    shapes : values of its shape parameters, by `<effect>.<parameter>`
    names : the k size parameters, `<effect>.<parameter>[...]`; (the id itself for an effect that is
        on or off)
    parts : per recording (n_r, k)
    one_sided : sizes below the null are not admissible
    contrast : only differences between the k sizes mean something; the model has their common value
    """

    effect: Effect
    shapes: Mapping[str, float]
    names: tuple[str, ...]
    parts: tuple[Array, ...]
    one_sided: bool
    contrast: bool = False

    __repr__ = short_repr


def directions(fit: Fit, effects: Iterable[Effect], scales: Scales) -> tuple[Direction, ...]:
    """Directions of all admissible effects that the fit lacks, one per point of their shape grids.

    Effects with a phase are left to `frequency_scan`, which scans frequencies.
    """
    acting = fit.density.oscillator.acting
    have = {e.id for e in acting}
    found = []
    for effect in effects:
        if effect.id in have or is_periodic(effect):
            continue
        if not all(map(effect.stands_beside, acting)):
            continue
        if not effect.admissible(scales):
            continue
        steps = dict[str, float]()
        for shapes in shape_points(effect, scales):
            direction = _direction(fit, effect, scales, shapes, steps)
            if direction is not None:
                found.append(direction)
    return tuple(found)


def is_periodic(effect: Effect) -> bool:
    """True for an effect with a phase."""
    return any(p.circular for p in effect.parameters)


def is_steady(effect: Effect) -> bool:
    """False for a periodic effect that rings down."""
    return all(p.name != DECAY for p in effect.parameters)


def decays_of(effect: Effect, scales: Scales) -> Array:
    """Rates (k,) at which a periodic effect may ring down, 1/s; zero for a steady one."""
    if is_steady(effect):
        return np.zeros(1)
    decay = effect.parameter(DECAY)
    return decay.grid(scales) if decay.grid else np.array([decay.scale(scales)])


def sigma_of(fit: Fit) -> Array:
    """Noise level of every recording at the fit's mode, (R,), m."""
    return fit.mode[fit.density.likelihood.sigma_columns]


def whitened(fit: Fit, values: Sequence[Array]) -> tuple[Array, ...]:
    """Changes (..., n_r) of what is seen per recording, whitened and in units of the noise."""
    recordings, noise = fit.density.oscillator.campaign.recordings, fit.density.likelihood.noise
    rows = zip(values, recordings, sigma_of(fit), strict=True)
    return tuple(noise.whitened(r, v) / s for v, r, s in rows)


def shape_points(effect: Effect, scales: Scales, finer: int = 1) -> list[dict[str, float]]:
    """The points of an effect's shape grid, `<effect>.<parameter>` -> value, `finer` times as many
    along every axis.
    """
    shapes = [p for p in effect.parameters if p.is_shape]
    axes = [np.asarray(p.grid(scales) if p.grid else [p.scale(scales)]) for p in shapes]
    axes = [_finer(axis, finer) for axis in axes]
    keys = [f"{effect.id}.{p.name}" for p in shapes]
    return [dict(zip(keys, map(float, point), strict=True)) for point in itertools.product(*axes)]


def _finer(axis: Array, times: int) -> Array:
    """An axis with `times` - 1 points between each two."""
    places = np.arange(times * (axis.size - 1) + 1) / times
    return np.interp(places, np.arange(axis.size), axis)


def size_parameters(density: PosteriorDensity, effect: Effect) -> list[tuple[str, EffectParameter]]:
    """Names in theta and records of the parameters by which an effect begins at its null."""
    campaign = density.oscillator.campaign
    keys: dict[str, list[str | None]] = {
        "campaign": [None],
        "case": list(campaign.cases),
        "recording": [r.name for r in campaign.recordings],
    }
    return [(instance_name(effect, p, key), p) for p in effect.scored for key in keys[p.scope]]


def size_steps(
    density: PosteriorDensity, effect: Effect, theta: Array, scales: Scales
) -> tuple[Array, Array]:
    """Points (1 + k, d): theta, and with each of an effect's k sizes larger by a small part of what
    is plausible; these steps (k,).
    """
    sizes = size_parameters(density, effect)
    steps = np.array([SIZE_STEP * parameter.scale(scales) for _, parameter in sizes])
    points = np.repeat(theta[None], 1 + len(sizes), axis=0)
    for i, (name, _) in enumerate(sizes):
        points[1 + i, density.oscillator.layout.index(name)] += steps[i]
    return points, steps


def _direction(
    fit: Fit, effect: Effect, scales: Scales, shapes: Mapping[str, float], steps: dict[str, float]
) -> Direction | None:
    """A direction, None where a size changes nothing; `steps` are the sizes' last difference steps,
    from which those at the next shape begin.
    """
    effects = (*fit.density.oscillator.effects, effect)
    density = extend(fit, effects, scales)
    layout = density.oscillator.layout
    theta = transfer(fit, layout, effects, scales, shapes)
    sizes = size_parameters(density, effect)
    if not sizes:
        change = [b - a for a, b in zip(fit.seen, density.oscillator.predict(theta), strict=True)]
        if not all(np.isfinite(c).all() for c in change):  # the motion would run away
            return None
        parts = tuple(p[:, None] for p in whitened(fit, change))
        return Direction(effect, dict(shapes), (effect.id,), parts, True)
    base = whitened(fit, density.oscillator.predict(theta))
    columns = []
    for name, parameter in sizes:
        first = steps.get(name, FIRST_STEP * parameter.scale(scales))
        ends = (first, parameter.scale(scales))
        response = _response(fit, density, theta, base, layout.index(name), ends)
        if response is None:
            return None
        columns.append(response[0])
        steps[name] = response[1]
    parts = tuple(np.stack(part, axis=1) for part in zip(*columns, strict=True))
    names = tuple(name for name, _ in sizes)
    replaces = replaced_slot(effect, sizes[0][1]) is not None
    one_sided = sizes[0][1].lower == sizes[0][1].null and not replaces
    return Direction(effect, dict(shapes), names, parts, one_sided, replaces)


def _response(
    fit: Fit,
    density: PosteriorDensity,
    theta: Array,
    base: tuple[Array, ...],
    index: int,
    steps: tuple[float, float],
) -> tuple[tuple[Array, ...], float] | None:
    """Whitened change per unit of parameter `index`, and the difference step that showed it, of
    `steps`, the first and the largest one; None when it changes nothing.
    """
    (step, largest), found = steps, None
    for _ in range(4):
        moved = theta.copy()
        moved[index] += step
        values = whitened(fit, density.oscillator.predict(moved))
        change = [b - a for a, b in zip(base, values, strict=True)]
        with np.errstate(over="ignore", invalid="ignore"):
            norm = float(np.sqrt(sum(float(c.ravel() @ c.ravel()) for c in change)))
        if not np.isfinite(norm):
            return None
        if norm < INVISIBLE:  # such as a lag far below the sampling interval
            if found is not None or step == largest:
                break
            step = largest
            continue
        found = tuple(c / step for c in change), step
        if 0.1 * CHANGE < norm < 10 * CHANGE:
            break
        step = min(step * CHANGE / norm, largest)
    return found
