"""The rig's measuring chain: probe, rest reading, noise, smoothing, digits, in this order.

measured = round(smooth(y + gain2 y^2 + gain3 y^3 + drift t + hum exp(-r t) sin(2 pi f t + phase)
                        - z + offset + noise))
with z of the high-pass, see `Probe`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import pi, sqrt
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter, lsim, savgol_filter

from bayesimpact.data.campaign import Smoothing
from bayesimpact.errors import InputError

Series = NDArray[np.float64]
FINER = 8  # steps of a high-pass in an interval


@dataclass(frozen=True)
class MeasuringChain:
    """What lies between the true displacement and the recorded numbers.

    Attributes
    ----------
    noise : standard deviation of the raw noise, m
    correlation : of neighbouring noise samples, AR(1), in (-1, 1); `noise` stays its standard
        deviation, and it is stationary from the first sample
    white : share of the noise's variance that is white, where the rest is AR(1); in [0, 1)
    offsets : recording -> rest reading of the probe, m; 0 where not given
    smoothing : applied to the noisy signal. `savgol`: odd window, polynomial fitted at the ends;
        `lag`: x_i = x_(i-1) + (1 - exp(-1 / (rate time_constant))) (signal_i - x_(i-1)),
        starting from the first sample
    rounding : least significant digit, m; 0 for none
    """

    noise: float = 0.0
    correlation: float = 0.0
    offsets: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    smoothing: Smoothing | None = None
    rounding: float = 0.0
    white: float = 0.0

    def __post_init__(self) -> None:
        if not 0 <= self.noise < np.inf:
            raise InputError("noise", repr(self.noise), "a standard deviation >= 0 in m")
        if not -1 < self.correlation < 1:
            raise InputError("correlation", repr(self.correlation), "a number within (-1, 1)")
        if not 0 <= self.white < 1:
            raise InputError("white", repr(self.white), "a share of the variance within [0, 1)")
        if not 0 <= self.rounding < np.inf:
            raise InputError("rounding", repr(self.rounding), "a digit >= 0 in m")


@dataclass(frozen=True)
class Probe:
    """How the probe distorts the displacement of one recording; all zero for a true one.

    Attributes
    ----------
    quadratic, cubic : gains of y^2 (1/m) and y^3 (1/m2)
    drift : m/s
    hum, hum_frequency, hum_phase, hum_decay : m, Hz, rad, 1/s
    corner, settling : of a first-order high-pass, Hz, which takes off z, z' = w (y - z) with
        w = 2 pi corner, from z = 0 on; and the rate in m/s at which the zero moves at first for
        what it took for the constant before. Between samples the signal is a cubic spline: an
        acceleration that jumps at a touch does so within an interval of its place
    """

    quadratic: float = 0.0
    cubic: float = 0.0
    drift: float = 0.0
    hum: float = 0.0
    hum_frequency: float = 0.0
    hum_phase: float = 0.0
    hum_decay: float = 0.0
    corner: float = 0.0
    settling: float = 0.0

    def reads(self, displacement: Series, times: Series) -> Series:
        """Reading of the probe, (n,), m; the true displacement is not rescaled."""
        y = displacement
        wave = np.sin(2 * pi * self.hum_frequency * times + self.hum_phase)
        wave = wave * np.exp(-self.hum_decay * times)
        distorted = y + self.quadratic * y**2 + self.cubic * y**3
        return distorted + self.drift * times + self.hum * wave - self.taken_off(y, times)

    def taken_off(self, signal: Series, times: Series) -> Series:
        """What the high-pass takes off (n,), the constant of the first sample apart."""
        if self.corner == 0.0:
            return -self.settling * times
        w = 2 * pi * self.corner
        fine = np.linspace(times[0], times[-1], FINER * (times.size - 1) + 1)
        constant = lsim(([w], [1.0, w]), CubicSpline(times, signal)(fine), fine - fine[0])[1]
        return np.asarray(constant[::FINER] - self.settling * (1 - np.exp(-w * times)) / w)


def measure(
    displacement: Series,
    times: Series,
    probe: Probe,
    chain: MeasuringChain,
    name: str,
    rng: np.random.Generator,
) -> Series:
    """Pass one recording's true displacement (n,) in m through probe and chain -> (n,) m."""
    signal = probe.reads(displacement, times) + chain.offsets.get(name, 0.0)
    noise = _unit_noise(times.size, chain.correlation, rng)
    if chain.white:
        more = rng.standard_normal(times.size)
        noise = sqrt(1 - chain.white) * noise + sqrt(chain.white) * more
    signal = signal + chain.noise * noise
    if chain.smoothing is not None:
        signal = smooth(signal, chain.smoothing, float(times[1] - times[0]))
    if chain.rounding > 0:
        signal = np.round(signal / chain.rounding) * chain.rounding
    return np.asarray(signal, dtype=np.float64)


def smooth(signal: Series, smoothing: Smoothing, interval: float) -> Series:
    """Pass equally spaced samples (n,) through the chain's filter.

    Raises
    ------
    InputError : an even or too short window, a polynomial order that does not fit in it, or a
        time constant that is not positive
    """
    if smoothing.kind == "savgol":
        window, order = smoothing.window, smoothing.polyorder
        if window % 2 == 0 or not 0 <= order < window or window > signal.size:
            raise InputError("smoothing", f"window {window}, order {order}", "odd window > order")
        return np.asarray(savgol_filter(signal, window, order, mode="interp"))
    if not smoothing.time_constant > 0:
        raise InputError("smoothing", f"time constant {smoothing.time_constant}", "above 0 s")
    keep = np.exp(-interval / smoothing.time_constant)
    lagged, _ = lfilter([1 - keep], [1, -keep], signal, zi=[keep * signal[0]])
    return np.asarray(lagged)


def _unit_noise(size: int, correlation: float, rng: np.random.Generator) -> Series:
    """Stationary AR(1) noise of unit variance, (size,)."""
    white = rng.standard_normal(size)
    if correlation == 0:
        return white
    white[1:] *= sqrt(1 - correlation**2)
    return np.asarray(lfilter([1.0], [1.0, -correlation], white))
