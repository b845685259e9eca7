"""A likelihood whose simulated motion begins anew in every period, where the recording says.

Over many cycles small errors of a force add up: a simulation comes out of step with its recording,
the misfit has a side minimum for every cycle, and what is linearised about it means little. Here
the motion starts at every lowest point from the state that is read there, and the misfit is that
of one period ahead. What a wrong start does to its period, to first order, is taken out of
residuals and derivatives alike: the starts are free (multiple shooting: Bock 1981; for chaotic and
oscillating systems Pisarenko and Sornette 2004, Phys. Rev. E 69:036122). Time, the states of laws
and bodies, and the number of impacts go on.

Starts cost information, so this likelihood decides nothing: it says what to try (`diagnosis`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.oscillator import Oscillator
from bayesimpact.model.parameters import SLOTS
from bayesimpact.response.measured_motion import from_rest, lowest_points, measured_motion

Array = NDArray[np.float64]
_K1, _OFFSET = SLOTS.index("k1"), SLOTS.index("offset")

SMALL = 1e-5  # of the largest displacement and speed: changes of a start, for differences


@dataclass(frozen=True, eq=False)
class Starts:
    """Where the motion of one recording begins anew.

    Attributes
    ----------
    restarts : (m, 3) samples, displacements, m, and velocities, m/s
    blocks : per period after the first one (s, 2): orthonormal responses to its start, whitened;
        all starts are moved at once, so that what a state carries on of the last one is in it
    """

    restarts: Array
    blocks: tuple[Array, ...]

    def apart(self, white: Array) -> Array:
        """Whitened signals (..., n) less what other starts would do, period by period."""
        found, first = white.copy(), self.restarts[:, 0].astype(np.int64)
        for begin, block in zip(first, self.blocks, strict=True):
            part = found[..., begin : begin + block.shape[0]]
            part -= (part @ block) @ block.T
        return found


@dataclass(frozen=True, eq=False)
class MultipleShooting(Likelihood):
    """Likelihood of every period ahead; filtered noise counts as white."""

    starts: tuple[Starts, ...] = ()

    in_closed_form: ClassVar[bool] = False

    @cached_property
    def steps(self) -> tuple[float, ...]:
        """Of readings in coarse steps: none, their rounding is noise here."""
        return (0.0,) * len(self.starts)

    @cached_property
    def sizes(self) -> Array:
        """Independent numbers per recording, (R,): two of every start tell nothing."""
        whole = super().sizes
        return np.array(
            [max(n - 2 * len(s.blocks), 1.0) for n, s in zip(whole, self.starts, strict=True)]
        )

    def seen(self, theta: Array) -> tuple[Array, ...]:
        """What the probe would see of every recording, (B, n), for parameter vectors (B, d)."""
        return tuple(self.readings(r, theta, 0.0) for r in range(len(self.starts)))

    def readings(self, r: int, points: Array, error: float) -> Array:
        """Readings (B, n) of recording `r` for parameters (B, d)."""
        return self.oscillator.predict_restarted(r, points, self.starts[r].restarts)

    def whitened(self, r: int, signals: Array) -> Array:
        """Signals (..., n) of recording `r`, whitened, less what other starts would do."""
        return self.starts[r].apart(super().whitened(r, signals))


def multiple_shooting(likelihood: Likelihood, theta: Array) -> MultipleShooting | None:
    """The likelihood of periods ahead, with responses to its starts as `theta` (d,) has them.

    None where no period is told from noise, or there is none (k1 = 0), and for velocities and
    accelerations under an input: their integrals are anchored where a free mass turns.
    """
    o = likelihood.oscillator
    moving = bool(np.all(o.layout.slots(theta)[:, _K1] > 0.0))
    moving &= all(theta[i] != 0.0 for i in o.gains if i >= 0)
    if not moving or not (o.inputs is None or o.reads_displacements):
        return None
    noise = replace(likelihood.noise, smoothing=None)
    starts = tuple(_starts(o, noise, r, theta) for r in range(o.counts.size))
    return from_starts(likelihood, starts) if any(s.blocks for s in starts) else None


def from_starts(likelihood: Likelihood, starts: tuple[Starts, ...]) -> MultipleShooting:
    """The likelihood of periods ahead of given starts, with the responses to these."""
    noise = replace(likelihood.noise, smoothing=None)
    return MultipleShooting(likelihood.oscillator, noise, starts)


def _starts(o: Oscillator, noise: Noise, r: int, theta: Array) -> Starts:
    recording, q = o.campaign.recordings[r], o.layout.slots(theta)[r]
    period = 2 * np.pi * float(np.sqrt(o.campaign.mass / q[_K1]))
    gain = theta[o.gains[r]] if o.gains[r] >= 0 else 1.0
    level = noise.level * noise.scales[recording.order] / abs(gain)
    motion = from_rest(recording, q[_OFFSET], gain, o.settled_on(r, theta))
    y, v, _ = measured_motion(motion, period, level)
    as_displacement = level * (period / (2 * np.pi)) ** recording.order
    at = lowest_points(y, recording.interval, period, as_displacement)
    if recording.used is not None:
        at = at[recording.used[at]]
    restarts = np.column_stack([at, y[at], v[at]])
    if at.size == 0:
        return Starts(restarts, ())
    moved = [restarts]
    for column, size in ((1, np.ptp(y)), (2, np.ptp(v))):
        moved.append(restarts.copy())
        moved[-1][:, column] += SMALL * size
    seen = np.concatenate([o.predict_restarted(r, theta[None], one) for one in moved])
    white = noise.whitened(recording, (seen[1:] - seen[0]) / SMALL).T
    ends = [*at[1:], recording.samples.size]
    parts = [white[a:b] for a, b in zip(at, ends, strict=True)]
    return Starts(restarts, tuple(np.linalg.qr(_scaled(part))[0] for part in parts))


def _scaled(columns: Array) -> Array:
    size = np.linalg.norm(columns, axis=0)
    return np.asarray(columns / np.where(size > 0.0, size, 1.0))
