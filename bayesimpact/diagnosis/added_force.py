"""The force that a model adds to the base model, less what the base model's parameters imitate.

A force that is learned, and a set of effects that only imitates what is missing, may hold any
multiple of k1 y or c1 v that the fitted k1 and c1 take back: what they add by themselves says
little of what is missing. The part along the base model's own forces is taken out by least squares,
per recording also a constant, which is the probe's rest reading (`hidden`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesimpact.diagnosis.candidates.equation_error import is_a_force
from bayesimpact.diagnosis.residual_force.hidden import RIDGE, parameter_forces
from bayesimpact.formula.responses import motion_of
from bayesimpact.inference.fit import Fit
from bayesimpact.model.linear_response.path_forces import add_forces
from bayesimpact.model.linear_response.superposition import Motion
from bayesimpact.model.parameters import SLOTS

Array = NDArray[np.float64]
_FRICTION = SLOTS.index("friction")


@dataclass(frozen=True, eq=False)
class AddedForce:
    """A force along a model's own motion, per recording.

    Attributes
    ----------
    points : displacement m and velocity m/s at the samples, (n,) each
    forces : N, (n,)
    """

    points: tuple[tuple[Array, Array], ...]
    forces: tuple[Array, ...]


def added_force(fit: Fit) -> AddedForce | None:
    """What a model's effects add; None where one of them is no force along a path, or all are none.

    What changes readings alone adds none.
    """
    o = fit.density.oscillator
    if not o.effects or not all(map(is_a_force, o.effects)):
        return None
    if not any(e.observe is None for e in o.effects):
        return None
    try:
        motions = [motion_of(fit, r) for r in range(len(fit.linearisation))]
    except np.linalg.LinAlgError:  # it ran away
        return None
    forces = [_along(fit, r, motion) for r, motion in enumerate(motions)]
    if not all(np.isfinite(f).all() for f in forces):
        return None
    points = ((m.y[:: m.factor], m.v[:: m.factor]) for m in motions)
    return AddedForce(tuple(points), _beyond_base(fit, motions, forces))


def _along(fit: Fit, r: int, motion: Motion) -> Array:
    """Force of all effects at the samples of a recording, (n,), N."""
    o = fit.density.oscillator
    q = np.ascontiguousarray(o.layout.slots(fit.mode)[r : r + 1])
    found = np.zeros((1, motion.y.size))
    added = sum(e.law is not None for e in o.effects)  # after those that the campaign declares
    for law in o.laws[o.laws.shape[0] - added :]:
        add_forces(law, motion.y, motion.v, motion.d, motion.t, q, np.zeros(1, np.int64), found)
    found += q[0, _FRICTION] * np.sign(motion.v)
    return np.asarray(found[0, :: motion.factor])


def _beyond_base(fit: Fit, motions: Sequence[Motion], forces: Sequence[Array]) -> tuple[Array, ...]:
    """The rest of forces, per recording (n,), less their part along the base model's own forces."""
    along = parameter_forces(fit, motions)
    base = np.isin(along.moving, fit.density.oscillator.layout.roles("physical"))
    own = [f[base] - f[base].mean(axis=1, keepdims=True) for f in along.forces]
    rest = [f - f.mean() for f in forces]
    products = np.asarray(sum(f @ f.T for f in own))
    products += RIDGE * np.diag(np.maximum(np.diag(products), 1e-300))
    right = np.asarray(sum(f @ g for f, g in zip(own, rest, strict=True)))
    share = np.linalg.solve(products, right)
    return tuple(g - share @ f for f, g in zip(own, rest, strict=True))
