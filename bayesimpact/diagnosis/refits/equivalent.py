"""The sizes at which one force does what another one does along a motion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesimpact.diagnosis.refits.size import effect_numbers, force_along
from bayesimpact.diagnosis.residual_force.gaussian_process import trajectory_points
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect, Scales

Array = NDArray[np.float64]

POINTS = 2000  # of all recordings


def equivalent(old: Effect, new: Effect, fit: Fit, scales: Scales) -> dict[str, float]:
    """Parameters of an effect whose force along a fitted motion is nearest to that of another one,
    which the fit has: shapes of one name are its, sizes those of least squares; {} where either is
    no force of place, speed and time alone, or has a parameter of a case or recording, or is not
    finite.
    """
    if not (_is_plain(old) and _is_plain(new) and new.has_size and new.admissible(scales)):
        return {}
    theirs = {p.name: fit.value(f"{old.id}.{p.name}") for p in old.parameters if p.is_shape}
    start = np.array(
        [theirs.get(p.name, p.scale(scales)) if p.null is None else p.null for p in new.parameters]
    )
    sizes = [i for i, p in enumerate(new.parameters) if p.is_size]
    steps = [new.parameters[i].scale(scales) for i in sizes]
    points = np.repeat(start[None], 1 + len(sizes), axis=0)
    for row, (i, step) in enumerate(zip(sizes, steps, strict=True), 1):
        points[row, i] += step
    rows = [_forces(old, new, fit, r, points) for r in range(len(fit.linearisation))]
    own, *forces = np.concatenate(rows, axis=1)
    columns = np.stack([(force - forces[0]) for force in forces[1:]], axis=1)
    if not (np.isfinite(columns).all() and np.isfinite(own - forces[0]).all()):
        return {}
    found = np.linalg.lstsq(columns, own - forces[0], rcond=None)[0]
    for i, step, number in zip(sizes, steps, found, strict=True):
        kind = new.parameters[i]
        start[i] = min(max(start[i] + step * number, kind.lower), kind.upper)
    names = [f"{new.id}.{p.name}" for p in new.parameters]
    return dict(zip(names, map(float, start), strict=True))


def _is_plain(effect: Effect) -> bool:
    law = effect.law
    return (
        law is not None
        and not (law.rate or law.travel or effect.sets or effect.observe)
        and all(
            p.scope == "campaign" and not p.circular and p.fixed is None for p in effect.parameters
        )
    )


def _forces(old: Effect, new: Effect, fit: Fit, r: int, points: Array) -> Array:
    """The old effect's force in recording r, and the new one's with each of some `points` (k, p):
    (1 + k, n).
    """
    assert old.law is not None and new.law is not None
    y, v = list(trajectory_points(fit))[r]
    t = np.asarray(fit.density.oscillator.campaign.recordings[r].times)
    few = slice(0, y.size, max(1, y.size * len(fit.linearisation) // POINTS))
    path = y[few], v[few], t[few]
    slots = fit.density.oscillator.layout.slots(fit.mode)[r]
    mine = force_along(old.law, *path, effect_numbers(old, fit, r), slots)
    return np.stack([mine, *(force_along(new.law, *path, p, slots) for p in points)])
