"""What an instrument reads on average whose readings come in steps, as those of an encoder do.

A value x with Gaussian noise of standard deviation s ahead of rounding to multiples of q reads, on
average (Widrow and Kollar 2008, Quantization Noise, ch. 4; the Fourier series of a sawtooth, every
harmonic damped by the noise),

    x + q sum_k (-1)^k / (pi k) exp(-2 pi^2 k^2 s^2 / q^2) sin(2 pi k x / q).

Where a motion passes many steps within a few samples the sum is as good as noise, of variance
q^2 / 12 with the scatter about it. Where it does not, in the tail of a decay, it repeats from cycle
to cycle: lines at multiples of the motion's frequency, which passed for a hum.

Readings scatter most, and change most with x, beside the edges of the steps. Least squares about
the average take what those tell for twice of what it is. The quasi-likelihood of readings R with
that average,

    sum (R - average(x)) dx,

weighs all samples alike (Wedderburn 1974, Biometrika 61:439, Eq. 3): its estimates scatter as
least squares about the smooth motion do, with the residuals' own variance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from bayesimpact.data.faults.flat import reading_step
from bayesimpact.data.recording import Recording
from bayesimpact.model.jit.compiled import compiled

Array = NDArray[np.float64]

TERMS = 5  # of the series: the next one is below 1e-8 of the step at the least noise
# Noise ahead of rounding, in steps. With less the average is a staircase, that no ascent follows;
# with more the sum has below a thousandth of the noise's variance.
LEAST, MOST = 0.15, 0.45
FAR = 1e9  # steps: no instrument counts as many, and beyond 1e15 a number knows no part of one


@dataclass(frozen=True)
class Rounding:
    """Steps of readings, and the standard deviation of the noise ahead of them, in one unit."""

    step: float
    noise: float

    def read(self, values: Array) -> Array:
        """What is read on average of values of any shape."""
        return np.asarray(self._of(values)[0])

    def squares(self, values: Array, readings: Array) -> Array:
        """Minus twice the quasi-likelihood of readings (n,), up to what they alone decide: on
        average their squared distance from the values.
        """
        return np.asarray((readings - values) ** 2 + self._of(values)[1])

    def _of(self, values: Array) -> Array:
        found = _average(np.ravel(values), self.step, self.noise)
        return np.asarray(found.reshape(2, *values.shape))


def likeliest_rounding(step: float, seen: Array, readings: Array) -> Rounding | None:
    """The rounding of readings (n,) to a step about what a model says that is seen: the noise ahead
    of it from the first harmonic of their average, by least squares. None where they show none, as
    where the model misses them by more.
    """
    if not np.all(np.abs(seen) < FAR * step):  # it ran away
        return None
    wave = np.sin((2.0 * np.pi / step) * seen)
    size = float(wave @ wave)
    shown = -float(wave @ (readings - seen)) * np.pi / (size * step) if size > 0.0 else 0.0
    if not shown > _first_harmonic(MOST):
        return None
    noise = math.sqrt(max(-math.log(shown), 0.0) / 2.0) / math.pi
    return Rounding(step, max(noise, LEAST) * step)


def coarse_step(recording: Recording, level: float) -> float:
    """The step that a recording's readings come in; 0 where they come in none, or in one that is
    fine beside their standard deviation `level`.
    """
    step = _step(recording)
    return step if level <= step * math.sqrt(_variance(MOST)) else 0.0


def scatter(recording: Recording, level: float) -> float:
    """Standard deviation of a recording's readings about their average, where they differ by
    `level` from the motion: the variance of noise and step, s^2 + q^2 / 12, less the average's.
    """
    step = coarse_step(recording, level)
    if step == 0.0:
        return level
    noise = math.sqrt(max((level / step) ** 2 - 1.0 / 12.0, LEAST**2))
    return min(step * math.sqrt(_variance(noise) - _average_variance(noise)), level)


def average_square(step: float, level: float) -> float:
    """Mean square of what the average adds to a motion over many steps, where readings scatter by
    `level` about it.
    """

    def excess(noise: float) -> float:
        return _variance(noise) - _average_variance(noise) - (level / step) ** 2

    ends = (LEAST, MOST)
    if excess(ends[0]) >= 0.0 or excess(ends[1]) <= 0.0:
        noise = ends[0] if excess(ends[0]) >= 0.0 else ends[1]
    else:
        noise = float(brentq(excess, *ends))
    return step**2 * _average_variance(noise)


def _variance(noise: float) -> float:
    """Of readings about the motion, for noise ahead of rounding in steps, in squared steps."""
    return noise**2 + 1.0 / 12.0


def _average_variance(noise: float) -> float:
    """Of their average about the motion."""
    k = np.arange(1, TERMS + 1)
    return 0.5 * float(np.sum((np.exp(-2.0 * (np.pi * k * noise) ** 2) / (np.pi * k)) ** 2))


def _first_harmonic(noise: float) -> float:
    """By how much noise damps the first harmonic of the average."""
    return math.exp(-2.0 * (math.pi * noise) ** 2)


def _step(recording: Recording) -> float:
    """The step of the readings that count; 0 for readings that are all different."""
    used = slice(None) if recording.used is None else recording.used
    return reading_step(recording.samples[used])


@compiled()
def _average(x, step, noise):  # type: ignore[no-untyped-def]
    """Values (n,) as they are read on average, and the integral of twice what that adds, (2, n)."""
    found = np.empty((2, x.size))
    damped = np.empty(TERMS)
    for k in range(1, TERMS + 1):
        damped[k - 1] = (-1.0) ** k * math.exp(-2.0 * (math.pi * k * noise / step) ** 2)
    for i in range(x.size):
        angle = 2.0 * math.pi * (x[i] / step - math.floor(x[i] / step))
        added, integral = 0.0, 0.0
        for k in range(1, TERMS + 1):
            added += damped[k - 1] * math.sin(k * angle) / (math.pi * k)
            integral -= damped[k - 1] * math.cos(k * angle) / (math.pi * k) ** 2
        found[0, i] = x[i] + step * added
        found[1, i] = step * step * integral
    return found
