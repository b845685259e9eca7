"""How much larger the noise is at every sample of a recording, once its growth is known."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.recording import Recording
from bayesimpact.inference.noise.windows import centred
from bayesimpact.response.half_cycles import spectral_period

Array = NDArray[np.float64]

KEPT = 64  # recordings, whole and shortened: every residual and derivative of a fit asks for it
WINDOWS_PER_PERIOD = 9.0
DEGREE = 3


def smoothed(recording: Recording) -> tuple[Array, Array]:
    """Reading from where it settles and its rate of change, (n,) each: of cubics over short windows
    (Savitzky and Golay 1964, Anal. Chem. 36:1627), so that noise itself is no size.
    """
    from scipy.signal import savgol_filter

    x, interval = centred(recording.samples), recording.interval
    half = max(int(0.5 * spectral_period(x, recording.order) / WINDOWS_PER_PERIOD), 2)
    length = min(2 * half + 1, (x.size - 1) // 2 * 2 + 1)
    if length <= DEGREE:
        return x, np.asarray(np.gradient(x, interval))
    size, rate = (savgol_filter(x, length, DEGREE, deriv=order, delta=interval) for order in (0, 1))
    return np.asarray(size), np.asarray(rate)


@lru_cache(maxsize=KEPT)
def relative_sd(growth: tuple[float, float], recording: Recording) -> Array:
    """Standard deviation of the noise over its level, (n,), read-only.

    growth : by the reading's distance from where it settles, and by its rate
    """
    size, rate = smoothed(recording)
    found = np.sqrt(1.0 + (growth[0] * size) ** 2 + (growth[1] * rate) ** 2)
    found.setflags(write=False)
    return np.asarray(found)
