"""Backbone and damping curves of a free decay by zero crossings, for asymmetric signals.

The method of Londono, Neild and Cooper (2015), extended to asymmetric signals by Ondra et al. and
applied to an impact oscillator by Tian et al. (Eqs 1-5): frequency from the times between zero
crossings, amplitude from the extremes between them, separately above and below rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayesimpact.data.short_repr import short_repr
from bayesimpact.errors import InputError
from bayesimpact.response import local
from bayesimpact.response.half_cycles import HalfCycles, half_cycles, spectral_period
from bayesimpact.response.rest import rest_position

Floats = NDArray[np.float64]
Estimator = Literal["half", "centred"]
Damping = Literal["reference", "local"]


@dataclass(frozen=True, eq=False)
class Branch:
    """One side of the backbone, one entry per cycle, in the order of time.

    Attributes
    ----------
    times : (k,) time of the extreme since the first sample, s
    frequency : (k,) Hz
    amplitude : (k,) distance of the extreme from rest, positive, m (or rad)
    damping_ratio : (k,) fraction of critical damping; NaN where it is not defined
    """

    times: Floats
    frequency: Floats
    amplitude: Floats
    damping_ratio: Floats

    __repr__ = short_repr


@dataclass(frozen=True, eq=False)
class Backbone:
    """Upper (towards the stop) and lower branch of a recording.

    Attributes
    ----------
    upper, lower : the two branches
    rest : reading at rest, estimated or as given, m (or rad)
    noise : standard deviation of the noise, estimated or as given, m (or rad)
    """

    upper: Branch
    lower: Branch
    rest: float
    noise: float

    __repr__ = short_repr


def backbone(
    samples: ArrayLike,
    interval: float,
    *,
    rest: float | None = None,
    average: int = 1,
    noise: float | None = None,
    estimator: Estimator = "half",
    damping: Damping = "reference",
) -> Backbone:
    """Instantaneous frequency, amplitude and damping ratio of a free decay.

    Two estimators of the frequency:

    "half" (Tian et al., Eq. 1): f = 1 / (2 T) with T the half cycle above (below) rest. This is the
    paper's, and what the initial estimates need: the lower branch knows nothing of the stop.

    "centred": the frequency of the whole cycle, from the half cycle above rest and half of each of
    its neighbours below. The upper branch pairs it with the upper extreme, the lower branch with
    the geometric mean of the two lower extremes around it. Amplitude and period then belong to the
    same instant and the decay cancels to first order: choose this to compare with
    the closed form of the undamped oscillator.

    Two damping ratios:

    "reference" (Eq. 5): (ln a_0 - ln a) / (w (t - t_0)), counted from the first extreme of the
    branch, where it is NaN. It averages over all cycles since then, so it depends on that first
    extreme, and late values still carry the first impacts.

    "local": from the logarithmic decrement d to the next extreme of the branch,
    d / sqrt(4 pi^2 + d^2); NaN for the last cycle.

    Parameters
    ----------
    samples : (n,) displacement in m or angle in rad
    interval : sampling interval, s
    rest : reading at rest; None estimates it from the recording
    average : order N of the moving average over frequencies and times (Eq. 2); the amplitude is
        then the envelope, straight between the extremes, at the averaged time (Eq. 3)
    noise : standard deviation of the noise, in the unit of the samples; None estimates it. Cycles
        below six times this are not used
    estimator, damping : see above

    Returns
    -------
    Backbone; a branch is empty when the motion has no complete cycle on its side.

    Raises
    ------
    InputError : samples not finite or fewer than 16; interval, noise or average out of range
    """
    signal = _checked(samples, interval, average, noise)
    for name, choice, known in (
        ("estimator", estimator, ("half", "centred")),
        ("damping", damping, ("reference", "local")),
    ):
        if choice not in known:
            raise InputError(name, repr(choice), " or ".join(known))
    period = spectral_period(signal)
    level = local.noise_level(signal, period) if noise is None else float(noise)
    zero = rest_position(signal, period, level) if rest is None else float(rest)
    halves = half_cycles(signal, zero, period, level)
    pick = _halves if estimator == "half" else _centred
    upper, lower = (_branch(*pick(halves, s), interval, average, damping) for s in (1, -1))
    return Backbone(upper, lower, zero, level)


def _checked(samples: ArrayLike, interval: float, average: int, noise: float | None) -> Floats:
    signal = np.asarray(samples, dtype=np.float64)
    if signal.ndim != 1 or signal.size < 16:
        raise InputError("samples", f"shape {signal.shape}", "one dimension, 16 samples or more")
    if not np.isfinite(signal).all():
        raise InputError("samples", "values that are not finite", "finite numbers")
    if not (np.isfinite(interval) and interval > 0):
        raise InputError("interval", repr(interval), "a positive time in s")
    if average < 1:
        raise InputError("average", repr(average), "an order of 1 or more")
    if noise is not None and not noise >= 0:
        raise InputError("noise", repr(noise), "a standard deviation, zero or positive")
    return signal


def _halves(halves: HalfCycles, side: int) -> tuple[Floats, Floats, Floats]:
    """Times, full periods and amplitudes (in samples) of the half cycles of one side, Eq. 1."""
    mine = halves.side == side
    return halves.peaks[mine], 2 * halves.durations[mine], halves.amplitudes[mine]


def _centred(halves: HalfCycles, side: int) -> tuple[Floats, Floats, Floats]:
    """The same for whole cycles centred on an upper half cycle."""
    k = np.flatnonzero(halves.side == 1)
    k = k[(k > 0) & (k < halves.side.size - 1)]
    d, a = halves.durations, halves.amplitudes
    period = 0.5 * d[k - 1] + d[k] + 0.5 * d[k + 1]
    amplitude = a[k] if side == 1 else np.sqrt(a[k - 1] * a[k + 1])
    return halves.peaks[k], period, amplitude


def _branch(
    peaks: Floats, periods: Floats, amplitude: Floats, interval: float, order: int, damping: Damping
) -> Branch:
    times, frequency = peaks * interval, 1 / (periods * interval)
    if order > 1 and times.size:
        window = np.full(min(order, times.size), 1 / min(order, times.size))
        mean_times = np.convolve(times, window, "valid")
        frequency = np.convolve(frequency, window, "valid")
        amplitude = np.interp(mean_times, times, amplitude)
        times = mean_times
    return Branch(times, frequency, amplitude, damping_ratios(times, frequency, amplitude, damping))


def damping_ratios(times: Floats, frequency: Floats, amplitude: Floats, kind: Damping) -> Floats:
    """Damping ratios of a branch: Eq. 5 ("reference") or by the local decrement; see `backbone`.

    Parameters
    ----------
    times, frequency, amplitude : (k,) s, Hz, m
    kind : "reference" or "local"

    Returns
    -------
    (k,) damping ratios, NaN where not defined.
    """
    ratio = np.full(times.size, np.nan)
    if times.size < 2:
        return ratio
    logs = np.log(amplitude)
    if kind == "reference":
        ratio[1:] = (logs[0] - logs[1:]) / (2 * np.pi * frequency[1:] * (times[1:] - times[0]))
    else:
        decrement = -np.diff(logs)
        ratio[:-1] = decrement / np.sqrt(4 * np.pi**2 + decrement**2)
    return ratio
