"""Where in a recording short polynomials follow the motion, so that what they leave is noise.

On the free side of a stop: impacts are kinks. And between two turning points: there dry friction
changes its sign, and the acceleration jumps by 2 F / m while the velocity bends. A displacement
shows neither.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter1d

from bayesimpact.data.gaps import runs
from bayesimpact.data.recording import Recording
from bayesimpact.response import local
from bayesimpact.response.driven_displacement import seen_displacement
from bayesimpact.response.half_cycles import spectral_period, turning_points

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Windows = NDArray[np.int64]

MARGIN = 0.05  # of the largest displacement, below rest: the free side, where no impact is
TURN = 1 / 32  # of a period: what a jump of the acceleration moves the turning points seen


def windows(length: int, where: Mask) -> Windows:
    """Samples of windows (count, length) that lie in `where` (n,), in the middle of its runs."""
    starts = [
        first + (end - first) % length // 2 + np.arange((end - first) // length) * length
        for first, end in runs(where)
    ]
    first = np.concatenate([np.zeros(0, dtype=np.int64), *starts])
    return np.asarray(first[:, None] + np.arange(length))


def smooth_parts(recording: Recording, *, side: bool, turns: bool, reach: int = 0) -> Mask:
    """Samples (n,) on a stop's free side (where `side`) and, but for `turns`, off turning points.

    Without those that are set aside, and off all of these by the `reach` of a filter, samples.
    """
    found = _parts(recording, side, turns)
    if reach == 0:
        return found
    return np.asarray(minimum_filter1d(found, 2 * reach + 1, mode="constant", cval=0))


def _parts(recording: Recording, side: bool, turns: bool) -> Mask:
    found = np.ones(recording.samples.size, dtype=bool)
    if recording.used is not None:
        found &= recording.used
    if not side and turns:
        return found
    moved = centred(seen_displacement(recording).samples)
    if side:
        found &= moved < -MARGIN * np.abs(moved).max()
    if not turns:
        period = spectral_period(moved)
        index, _ = turning_points(moved, period, local.noise_level(moved, period))
        near = int(TURN * period)
        for shift in range(-near, near + 1):
            found[np.clip(index + shift, 0, found.size - 1)] = False
    return found


def period_of(recording: Recording) -> float:
    """Rough period of the motion, in samples: under an input, that of the displacement."""
    if recording.input is None:
        return spectral_period(recording.samples, recording.order)
    return spectral_period(seen_displacement(recording).samples)


def centred(samples: Array) -> Array:
    """Samples (n,) from where they settle."""
    return samples - float(np.median(samples[-max(samples.size // 5, 1) :]))
