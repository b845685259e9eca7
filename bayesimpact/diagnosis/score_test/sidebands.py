"""Is a line of a model a sideband of the motion?

What pulsates, a stiffness say, makes of a motion at f0 two lines at f0 - f and f0 + f (Nayfeh and
Mook 1979, Nonlinear Oscillations, chapter 5); to first order the upper one has (2 f0 - f) / (2 f0 +
f) of the lower one's amplitude. A mode or a hum fits one of them well. That the other one is there
too, as far below as this one is above, tells that it is neither.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.recording import Recording

Array = NDArray[np.float64]

ALIKE = 0.25  # of the amplitude of a line, from which on another one may be its mirror image
STANDS_OUT = 4.0  # times the amplitudes beside it
NEAR = 1  # lines that the duration resolves, on either side of where the mirror image should be
BESIDE = range(4, 11)  # lines on either side, with which a line is compared
CLOSE = 4  # lines: what is as near to the motion's own is of its band


def is_sideband(
    recording: Recording, left: Array, own: float, frequency: float, others: Sequence[float]
) -> bool:
    """Whether the mirror image of a line about the motion's own is there as well.

    Parameters
    ----------
    left : (n,) what the model leaves of the recording's readings
    own, frequency : of the motion and of the line, Hz
    others : frequencies of further lines that the model has, Hz
    """
    resolved = 1.0 / (recording.samples.size * recording.interval)
    mirror = 2.0 * own - frequency
    k, m = round(frequency / resolved), round(mirror / resolved)
    last = left.size // 2 - BESIDE.stop
    if abs(k - own / resolved) < CLOSE or not (BESIDE.stop <= m <= last and NEAR < k <= last):
        return False
    if any(abs(other - mirror) < (NEAR + 0.5) * resolved for other in others):
        return True
    rest = _amplitudes(left)
    near = rest[m - NEAR : m + NEAR + 1].max()
    beside = np.median([rest[m + s * i] for i in BESIDE for s in (-1, 1)])
    line = _amplitudes(recording.samples)[k - NEAR : k + NEAR + 1].max()
    return bool(near > ALIKE * line and near > STANDS_OUT * beside)


def _amplitudes(samples: Array) -> Array:
    """Of the lines that the duration resolves, through a Hann window."""
    return np.asarray(np.abs(np.fft.rfft((samples - samples.mean()) * np.hanning(samples.size))))
