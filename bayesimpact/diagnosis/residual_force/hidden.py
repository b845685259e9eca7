"""What the parameters of a fit hide of a force: the part of it along their own forces.

A missing force changes the recordings in two ways. One no parameter can imitate; that remains. The
other is along the forces of the parameters themselves, k1 y or c1 v, and moves them: no remainder
shows it, and nothing is known of it but that it is likely as large as what remains at the same
frequencies. Where a residual force was fitted, its own part along the base model's forces is given
back to these: k1, c1 and the rest are then those of the whole motion, by least squares.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from bayesimpact.diagnosis.residual_force.learned import LEARNED
from bayesimpact.inference.fit import Fit
from bayesimpact.model.linear_response.nearby import force_changes
from bayesimpact.model.linear_response.superposition import Motion
from bayesimpact.model.parameters import SLOTS

Array = NDArray[np.float64]
Index = NDArray[np.int64]

STEP = 1e-4  # of a parameter, for its force
RIDGE = 1e-10  # of the forces' products: some obstacles may hardly be met
_FRICTION = SLOTS.index("friction")


@dataclass(frozen=True, eq=False)
class ParameterForces:
    """Forces along the fitted motion per unit of each parameter.

    Attributes
    ----------
    fit : whose parameters
    moving : positions in theta of the physical parameters and those of effects, (m,)
    forces : per recording (m, n), N; 0 for parameters of other recordings
    """

    fit: Fit
    moving: Index
    forces: tuple[Array, ...]

    def whole(self) -> tuple[Array, tuple[Array, ...]]:
        """Matrix (d, d) that gives a residual force's part along the base model's forces back to
        its parameters, and the rest of that force, N, per recording (n,).
        """
        names, back = self.fit.names, np.eye(self.fit.mode.size)
        base = np.isin(self.moving, self.fit.density.oscillator.layout.roles("physical"))
        learned = np.array([names[i].startswith(LEARNED) for i in self.moving])
        if not learned.any():
            return back, tuple(np.zeros(f.shape[1]) for f in self.forces)
        own = sum(f[base] @ f[base].T for f in self.forces)
        along = sum(f[base] @ f[learned].T for f in self.forces)
        own = own + RIDGE * np.diag(np.maximum(np.diag(own), 1e-300))
        share = np.linalg.solve(own, along)
        back[np.ix_(self.moving[base], self.moving[learned])] = share
        size = self.fit.mode[self.moving[learned]]
        return back, tuple(size @ f[learned] - (share @ size) @ f[base] for f in self.forces)

    def imitations(self, remaining: Sequence[Array]) -> Array:
        """Change of every parameter, (d,), whose force is as large as the `remaining` one, N, per
        recording (n,), about the frequencies of its own force; 0 for those of no force.
        """
        above, below = np.zeros(self.moving.size), np.zeros(self.moving.size)
        rows = zip(self.forces, remaining, self.fit.displacements, strict=True)
        for force, left, y in rows:
            power = np.abs(np.fft.rfft(force, axis=-1)) ** 2
            near = about(power, y)
            above += near @ np.abs(np.fft.rfft(left)) ** 2
            below += np.einsum("mf,mf->m", near, power)
        found = np.zeros(self.fit.mode.size)
        ratio = np.divide(above, below, out=np.zeros_like(above), where=below > 0)
        found[self.moving] = np.sqrt(ratio)
        return found


def about(power: Array, y: Array) -> Array:
    """A spectrum (..., f) spread over half the strongest frequency of y (n,) on either side.

    A fit leaves nothing at the very frequency of a decay; beside it what changes along the decay is
    seen.
    """
    own = max(int(np.argmax(np.abs(np.fft.rfft(y - y.mean())))), 1)
    return np.asarray(uniform_filter1d(power, own, axis=-1, mode="constant"))


def parameter_forces(fit: Fit, motions: Sequence[Motion]) -> ParameterForces:
    """Of a fit, along its recordings' motions."""
    o = fit.density.oscillator
    moving = o.layout.roles("physical", "effect")
    steps = STEP * np.maximum(np.abs(fit.mode[moving]), fit.sd[moving])
    theta = np.tile(fit.mode, (1 + moving.size, 1))
    theta[1 + np.arange(moving.size), moving] += steps
    slots = np.ascontiguousarray(o.layout.slots(theta).swapaxes(0, 1))
    forces = []
    for q, motion in zip(slots, motions, strict=True):
        change = force_changes(motion, q, o.laws)
        change += (q[1:, [_FRICTION]] - q[0, _FRICTION]) * np.sign(motion.v)
        forces.append(change[:, :: motion.factor] / steps[:, None])
    return ParameterForces(fit, moving, tuple(forces))
