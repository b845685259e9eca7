"""The force that a model adds to the base model, less what the base model's parameters imitate.

It is what the base model's equation of motion lacks along the better model's motion, so that it
tells all that a model does to the motion: a wear of the gap or a mode of the obstacle is no force
of a path that is given, but changes what the mass feels.

A force that is learned, and a set of effects that only imitates what is missing, may hold any
multiple of k1 y or c1 v that the fitted k1 and c1 take back: what they add by themselves says
little of what is missing. The part along the base model's own forces is taken out by least squares,
per recording also a constant, which is the probe's rest reading (`hidden`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.diagnosis.residual_force.hidden import RIDGE, parameter_forces
from bayesimpact.formula.responses import motion_of
from bayesimpact.inference.fit import Fit
from bayesimpact.model.linear_response.nearby import force_changes
from bayesimpact.model.linear_response.superposition import Motion
from bayesimpact.model.parameters import SLOTS

Array = NDArray[np.float64]
_GAP, _GAIN = SLOTS.index("g"), SLOTS.index("A")
ACCELERATION = np.array([2])  # time derivative of the displacement


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


def added_force(base: Fit, better: Fit) -> AddedForce | None:
    """What a better model adds to the base model; None where it adds none, or what the probe sees
    is not the motion of the mass alone.

    What changes readings alone adds none.
    """
    effects = better.density.oscillator.effects
    seen_beside = any("second_gain" in e.binds for e in effects)
    if seen_beside or not any(e.observe is None for e in effects):
        return None
    try:
        motions = [motion_of(better, r) for r in range(len(better.linearisation))]
    except np.linalg.LinAlgError:  # it ran away
        return None
    base = _beside(base, better)
    forces = [_lacking(base, better, r, motion) for r, motion in enumerate(motions)]
    if not all(np.isfinite(f).all() for f in forces):
        return None
    points = ((m.y[:: m.factor], m.v[:: m.factor]) for m in motions)
    return AddedForce(tuple(points), _beyond_base(base, motions, forces))


def _beside(base: Fit, better: Fit) -> Fit:
    """The base model with the better one's parameters, as far as that has them."""
    own = dict(zip(better.names, better.mode, strict=True))
    values = [own.get(name, value) for name, value in zip(base.names, base.mode, strict=True)]
    return replace(base, mode=np.array(values))


def _lacking(base: Fit, better: Fit, r: int, motion: Motion) -> Array:
    """What the base model's equation of motion lacks at the samples of a recording, (n,), N."""
    o, real = base.density.oscillator, better.density.oscillator
    q = o.layout.slots(base.mode)[r]
    nothing = np.zeros(q.size)
    nothing[_GAP] = q[_GAP]
    d = motion.y - q[_GAP] if o.campaign.stop else motion.d
    along = replace(motion, d=d)
    force = force_changes(along, np.stack([nothing, q]), o.laws)[0, :: motion.factor]
    slots = real.layout.slots(better.mode)[[r]]
    acceleration = real.motions_of(np.array([r]), slots, ACCELERATION)[0, : force.size]
    lacking = -o.campaign.mass * acceleration - force
    recording = real.campaign.recordings[r]
    if recording.input is not None:
        lacking += q[_GAIN] * recording.input.shown(o.campaign.mass, recording.interval)
    return np.asarray(lacking)


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
